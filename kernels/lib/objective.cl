// The objective (13) of WIDTH parameter sets at one wavelength:
//
//   E = Σ (s_n f_n − y_n)²,  s_n = √(g_n / Σ g m²), y_n = s_n m_n, both 0 where masked
//
// Directions stand in groups of one incident direction, starts[0 … groups]: what the model makes of the
// incident direction is formed once a group. Four directions at a time, with sums of their own, keep the
// pipelines full.
//
//   error    the model's, plus N/8 ulp for the sums in the worst case

inline realv residual_of(const model_state *m, global const real *restrict rows,
                         global const real *restrict target, global const real *restrict scale, const uint n) {
    return model_brdf(m, geometry_of(rows, n)) * (realv)scale[n] - (realv)target[n];
}

inline realv objective_of(const realv *p, global const real *restrict rows,
                          global const uint *restrict starts, const uint groups,
                          global const real *restrict target, global const real *restrict scale) {
    model_state m = model_prepare(p);
    realv sum_0 = (realv)0.0, sum_1 = (realv)0.0, sum_2 = (realv)0.0, sum_3 = (realv)0.0;
    for (uint g = 0; g < groups; ++g) {
        const uint end = starts[g + 1];
        uint n = starts[g];
        model_incident(&m, geometry_of(rows, n));
        for (; n + 4 <= end; n += 4) {
            const realv r_0 = residual_of(&m, rows, target, scale, n);
            const realv r_1 = residual_of(&m, rows, target, scale, n + 1);
            const realv r_2 = residual_of(&m, rows, target, scale, n + 2);
            const realv r_3 = residual_of(&m, rows, target, scale, n + 3);
            sum_0 += r_0 * r_0;
            sum_1 += r_1 * r_1;
            sum_2 += r_2 * r_2;
            sum_3 += r_3 * r_3;
        }
        for (; n < end; ++n) {
            const realv r = residual_of(&m, rows, target, scale, n);
            sum_0 += r * r;
        }
    }
    return (sum_0 + sum_1) + (sum_2 + sum_3);
}
