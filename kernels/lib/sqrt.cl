// Square root of vectors, as one instruction.
//
// The built-in of PoCL is a call on vectors, and each call spills every vector register. The compiler's own
// operation is reached by its name: PoCL is built on LLVM on every processor
// (LLVM Language Reference, "llvm.sqrt.* intrinsic").
//
//   error    correctly rounded
//   domain   x ≥ 0; no number below
#if WIDTH > 1 && defined(POCL_DEVICE_ADDRESS_BITS)
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)
#ifdef REAL_IS_DOUBLE
realv sqrt_lanes(realv x) __asm("llvm.sqrt.v" TEXT(WIDTH) "f64");
#else
realv sqrt_lanes(realv x) __asm("llvm.sqrt.v" TEXT(WIDTH) "f32");
#endif
#else
#define sqrt_lanes sqrt
#endif
