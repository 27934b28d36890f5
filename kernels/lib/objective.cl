// The objective (13) of WIDTH parameter sets at one wavelength:
//
//   E = Σ (s_n f_n − y_n)²,  s_n = √(g_n / Σ g m²), y_n = s_n m_n, both 0 where masked
//
// Directions stand in groups of one incident direction, starts[0 … groups]: what the model makes of the
// incident direction is formed once a group. UNROLL directions at a time, with sums of their own, keep the
// pipelines full.
//
//   error    the model's, plus N ulp for the sum in the worst case

#ifdef MODEL_UNROLLED
// The model's own stages stay loops: their arrays are in memory, and each stage has the registers to itself.
#define SIDE_BY_SIDE UNROLL
#define EACH(k) for (int k = 0; k < SIDE_BY_SIDE; ++k)
#else
#if UNROLL < MODEL_SIDE_BY_SIDE
#define SIDE_BY_SIDE UNROLL
#else
#define SIDE_BY_SIDE MODEL_SIDE_BY_SIDE
#endif
// Without the hint the compiler of PoCL 3.0 keeps the loops, and with them their arrays in memory.
#define ALL_AT_ONCE __attribute__((opencl_unroll_hint(SIDE_BY_SIDE)))
#define EACH(k) ALL_AT_ONCE for (int k = 0; k < SIDE_BY_SIDE; ++k)

inline void model_brdf_unrolled(const model_state *m, const geometry *x, realv *f) {
    EACH(k) f[k] = model_brdf(m, x[k]);
}
#endif

#if defined(MODEL_DIVIDES) && defined(REAL_IS_DOUBLE) && SIDE_BY_SIDE % 2 == 0
// One division for two directions: a/b = a d / (b d). In fp64 alone: its range holds the product, and where it does
// not, the product times 0 makes the sum no number.
#define DIVISIONS_ARE_SHARED
inline void model_brdf_sharing(const model_state *m, const geometry *x, realv *f) {
    realv under[SIDE_BY_SIDE];
    EACH(k) f[k] = model_fraction(m, x[k], &under[k]);
    ALL_AT_ONCE for (int k = 0; k < SIDE_BY_SIDE; k += 2) {
        const realv both = under[k] * under[k + 1], inverse = (real)1.0 / both;
        f[k] = f[k] * (under[k + 1] * inverse) + both * (real)0.0;
        f[k + 1] *= under[k] * inverse;
    }
}
#endif

// E of a model that is prepared; `shared` lets directions share divisions.
inline realv sum_of_squares(model_state *m, global const real *restrict rows,
                            global const uint *restrict starts, const uint groups,
                            global const real *restrict target, global const real *restrict scale,
                            const bool shared) {
    realv sums[SIDE_BY_SIDE];
    EACH(k) sums[k] = (realv)0.0;
    for (uint g = 0; g < groups; ++g) {
        const uint end = starts[g + 1];
        uint n = starts[g];
        model_incident(m, geometry_of(rows, n));
        for (; n + SIDE_BY_SIDE <= end; n += SIDE_BY_SIDE) {
            geometry x[SIDE_BY_SIDE];
            realv f[SIDE_BY_SIDE];
            EACH(k) x[k] = geometry_of(rows, n + k);
#ifdef DIVISIONS_ARE_SHARED
            if (shared)
                model_brdf_sharing(m, x, f);
            else
#endif
                model_brdf_unrolled(m, x, f);
            EACH(k) {
                const realv r = f[k] * (realv)scale[n + k] - (realv)target[n + k];
                sums[k] += r * r;
            }
        }
        for (; n < end; ++n) {
            const realv r = model_brdf(m, geometry_of(rows, n)) * (realv)scale[n] - (realv)target[n];
            sums[0] += r * r;
        }
    }
    realv sum = sums[0];
    for (int k = 1; k < SIDE_BY_SIDE; ++k) sum += sums[k];
    return sum;
}

inline realv objective_of(const realv *p, global const real *restrict rows,
                          global const uint *restrict starts, const uint groups,
                          global const real *restrict target, global const real *restrict scale) {
    model_state m = model_prepare(p);
    realv sum = sum_of_squares(&m, rows, starts, groups, target, scale, true);
#ifdef DIVISIONS_ARE_SHARED
    const realv largest = (realv)1.7976931348623157e308;
    if (!ALL(sum <= largest)) sum = sum_of_squares(&m, rows, starts, groups, target, scale, false);
#endif
    return sum;
}

// log2 E; E is floored where a perfect fit would make it −∞, and stays no number where it is none.
inline realv log2_of_objective(realv objective) {
    return log2(objective <= (realv)1e-37 ? (realv)1e-37 : objective);
}
