/* The objective (13) as a C programmer writes it for the compiler: plain loops, the incident factor hoisted,
   everything else left to -O3 -march=native -ffast-math -fopenmp and the vector mathematics library.
   Built and timed by clbrdf/bench/throughput.py beside the OpenCL kernels; nothing else uses it. */
#include <math.h>
#include <stddef.h>

#define OBJECTIVE(NAME, REAL, EXP2, LOG2)                                                                  \
    void NAME(size_t sets, size_t groups, const unsigned *restrict starts, const REAL *restrict parameters, \
              const REAL *restrict cos_i, const REAL *restrict log2_v, const REAL *restrict log2_s,         \
              const REAL *restrict target, const REAL *restrict scale, REAL *restrict out) {                \
        _Pragma("omp parallel for schedule(static)") for (size_t k = 0; k < sets; ++k) {                    \
            const REAL *p = parameters + 6 * k;                                                             \
            const REAL a = p[0] * (REAL)1.4426950408889634, b = p[1], c = p[2] * (REAL)1.4426950408889634;  \
            const REAL d = p[3], log2_ks = LOG2(p[4]), diffuse = p[5] * (REAL)0.31830988618379067;          \
            REAL sum = 0;                                                                                   \
            for (size_t g = 0; g < groups; ++g) {                                                           \
                const REAL away = b - cos_i[starts[g]];                                                     \
                const REAL level = a * away * away + log2_ks;                                               \
                for (size_t n = starts[g]; n < starts[g + 1]; ++n) {                                        \
                    const REAL f = EXP2(c * EXP2(d * log2_v[n]) + (level + log2_s[n])) + diffuse;           \
                    const REAL r = f * scale[n] - target[n];                                                \
                    sum += r * r;                                                                           \
                }                                                                                           \
            }                                                                                               \
            out[k] = sum;                                                                                   \
        }                                                                                                   \
    }

OBJECTIVE(objective_single, float, exp2f, log2f)
OBJECTIVE(objective_double, double, exp2, log2)
