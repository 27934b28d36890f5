// Real and integer vectors of WIDTH lanes. REAL and WIDTH come from the program that is assembled.
// Every kernel is written for lanes: PoCL does not vectorise calls across work items, so the lanes
// are explicit on a CPU and there is one per work item on a GPU.

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

#ifdef REAL_IS_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double real;
typedef long integer;
#define INTEGER long
#else
typedef float real;
typedef int integer;
#define INTEGER int
#endif

#if WIDTH == 1
typedef real realv;
typedef integer integerv;
#define LOAD(i, p) ((p)[i])
#define STORE(x, i, p) ((p)[i] = (x))
#define ANY(mask) ((mask) != 0)
#define ALL(mask) ((mask) != 0)
#define AS_REALV(x) JOIN(as_, REAL)(x)
#define AS_INTEGERV(x) JOIN(as_, INTEGER)(x)
#define LANE(x, k) (x)
#else
typedef JOIN(REAL, WIDTH) realv;
typedef JOIN(INTEGER, WIDTH) integerv;
#define LOAD(i, p) JOIN(vload, WIDTH)((i), (p))
#define STORE(x, i, p) JOIN(vstore, WIDTH)((x), (i), (p))
#define ANY(mask) any(mask)
#define ALL(mask) all(mask)
#define AS_REALV(x) JOIN(JOIN(as_, REAL), WIDTH)(x)
#define AS_INTEGERV(x) JOIN(JOIN(as_, INTEGER), WIDTH)(x)
#endif
