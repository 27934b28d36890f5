// The objective (13) of WIDTH parameter sets at one wavelength:
//
//   E = Σ (s_n (f_n − m_n))²,  s_n = √(g_n / Σ g m²), 0 where masked
//
//   error    the model's, plus N/2 ulp for the sum in the worst case

inline realv objective_of(const realv *p, global const real *restrict rows,
                          global const real *restrict measured, global const real *restrict scale,
                          const uint n_directions) {
    const model_state m = model_prepare(p);
    realv sum = (realv)0.0;
    for (uint n = 0; n < n_directions; ++n) {
        const geometry x = geometry_of(rows, n);
        realv residual = (realv)scale[n] * (model_brdf(&m, x) - (realv)measured[n]);
        sum += residual * residual;
    }
    return sum;
}
