/* The objective (13) of one model in C: the model's own formula as functions of one direction, loops as a C programmer
   writes them, and everything else left to -O3 -march=native -ffast-math -fopenmp and the vector mathematics library.
   `clbrdf/bench/peers/c_peer.py` puts the model's functions and its table in place of the two lines that say so. */
#include <math.h>
#include <stddef.h>

typedef REAL real;
typedef REAL realv;
#define constant static const
#define inline static inline

#ifdef SINGLE
#define sqrt_lanes sqrtf
#define tan tanf
#define sin sinf
#define cos cosf
#define exp_lanes expf
#define log_lanes logf
#define log1p_lanes log1pf
inline realv erfcx_lanes(realv x) { return expf(x * x) * erfcf(x); }
#else
#define sqrt_lanes sqrt
#define exp_lanes exp
#define log_lanes log
#define log1p_lanes log1p
inline realv erfcx_lanes(realv x) { return exp(x * x) * erfc(x); }
#endif

/* TABLE */
/* MODEL */

void objective(size_t sets, size_t groups, const unsigned *restrict starts, const REAL *restrict parameters,
               const REAL *restrict features, size_t directions, const REAL *restrict target,
               const REAL *restrict scale, REAL *restrict out) {
#pragma omp parallel for schedule(static)
    for (size_t k = 0; k < sets; ++k) {
        model_state m = model_prepare(parameters + P * k);
        REAL sum = 0;
        for (size_t g = 0; g < groups; ++g) {
            model_incident(&m, geometry_at(features, directions, starts[g]));
#pragma omp simd reduction(+ : sum)
            for (size_t n = starts[g]; n < starts[g + 1]; ++n) {
                const REAL r = model_brdf(&m, geometry_at(features, directions, n)) * scale[n] - target[n];
                sum += r * r;
            }
        }
        out[k] = sum;
    }
}
