// Model values of every parameter set in every direction.
//
//   features     (F, N_padded) one row per geometry feature, padded to whole vectors
//   parameters   (W, P)
//   out          (W, N_padded)
//
// Work item (g, w): lanes are WIDTH neighbouring directions, all with the parameters of wavelength w.
kernel void evaluate(global const real *restrict feature_rows, const ulong n_padded,
                     global const real *restrict parameters, global real *restrict out) {
    const size_t group = get_global_id(0), w = get_global_id(1);
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = (realv)parameters[w * P + j];
    model_state m = model_prepare(p);
    const geometry x = geometry_lanes(feature_rows, n_padded, group);
    model_incident(&m, x);
    STORE(model_brdf(&m, x), group, out + w * n_padded);
}
