// The objective (13) of WIDTH parameter sets at one wavelength:
//
//   E = Σ (s_n f_n − y_n)²,  s_n = √(g_n / Σ g m²), y_n = s_n m_n, both 0 where masked
//
// Directions stand in groups of one incident direction, starts[0 … groups]: what the model makes of the
// incident direction is formed once a group. UNROLL directions at a time, with sums of their own, keep the
// pipelines full.
//
//   error    the model's, plus N ulp for the sum in the worst case

#ifndef MODEL_UNROLLED
inline void model_brdf_unrolled(const model_state *m, const geometry *x, realv *f) {
    for (int k = 0; k < UNROLL; ++k) f[k] = model_brdf(m, x[k]);
}
#endif

inline realv objective_of(const realv *p, global const real *restrict rows,
                          global const uint *restrict starts, const uint groups,
                          global const real *restrict target, global const real *restrict scale) {
    model_state m = model_prepare(p);
    realv sums[UNROLL];
    for (int k = 0; k < UNROLL; ++k) sums[k] = (realv)0.0;
    for (uint g = 0; g < groups; ++g) {
        const uint end = starts[g + 1];
        uint n = starts[g];
        model_incident(&m, geometry_of(rows, n));
        for (; n + UNROLL <= end; n += UNROLL) {
            geometry x[UNROLL];
            realv f[UNROLL];
            for (int k = 0; k < UNROLL; ++k) x[k] = geometry_of(rows, n + k);
            model_brdf_unrolled(&m, x, f);
            for (int k = 0; k < UNROLL; ++k) {
                const realv r = f[k] * (realv)scale[n + k] - (realv)target[n + k];
                sums[k] += r * r;
            }
        }
        for (; n < end; ++n) {
            const realv r = model_brdf(&m, geometry_of(rows, n)) * (realv)scale[n] - (realv)target[n];
            sums[0] += r * r;
        }
    }
    realv sum = sums[0];
    for (int k = 1; k < UNROLL; ++k) sum += sums[k];
    return sum;
}

// log2 E; E is floored where a perfect fit would make it −∞, and stays no number where it is none.
inline realv log2_of_objective(realv objective) {
    return log2(objective <= (realv)1e-37 ? (realv)1e-37 : objective);
}
