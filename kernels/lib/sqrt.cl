// Square root of vectors, without a call.
//
// The built-in of PoCL is a call on vectors, and each call spills every vector register. The compiler's own operation
// is reached by its name: PoCL is built on LLVM on every processor (LLVM Language Reference, "llvm.sqrt.* intrinsic").
// A vector that is wider than a register would be handed over in memory, which the operation does not take: it is
// halved until it fits, 32 bytes with AVX and 16 without.
//
//   error    correctly rounded on a CPU; on a GPU in single precision 3 ulp, which OpenCL allows (OpenCL 1.2, 7.4);
//            9.2e-8 was measured on an H200
//   domain   x ≥ 0; no number below

#if !defined(POCL_DEVICE_ADDRESS_BITS) || WIDTH == 1 || !(defined(__x86_64__) || defined(__aarch64__))
#define sqrt_lanes sqrt
#else
float4 sqrt_4f(float4 x) __asm("llvm.sqrt.v4f32");
#ifdef REAL_IS_DOUBLE
double2 sqrt_2d(double2 x) __asm("llvm.sqrt.v2f64");
#endif
#ifdef __AVX__
float8 sqrt_8f(float8 x) __asm("llvm.sqrt.v8f32");
#else
inline float8 sqrt_8f(float8 x) { return (float8)(sqrt_4f(x.lo), sqrt_4f(x.hi)); }
#endif
inline float2 sqrt_2f(float2 x) { return sqrt_4f((float4)(x, x)).lo; }
inline float16 sqrt_16f(float16 x) { return (float16)(sqrt_8f(x.lo), sqrt_8f(x.hi)); }
#ifdef REAL_IS_DOUBLE
#ifdef __AVX__
double4 sqrt_4d(double4 x) __asm("llvm.sqrt.v4f64");
#else
inline double4 sqrt_4d(double4 x) { return (double4)(sqrt_2d(x.lo), sqrt_2d(x.hi)); }
#endif
inline double8 sqrt_8d(double8 x) { return (double8)(sqrt_4d(x.lo), sqrt_4d(x.hi)); }
#if WIDTH == 16  // calls with such vectors are warned of
inline double16 sqrt_16d(double16 x) { return (double16)(sqrt_8d(x.lo), sqrt_8d(x.hi)); }
#endif
#define sqrt_lanes JOIN(JOIN(sqrt_, WIDTH), d)
#else
#define sqrt_lanes JOIN(JOIN(sqrt_, WIDTH), f)
#endif
#endif
