// Model values of every parameter set in every direction.
//
//   feature_rows   (F, N_padded), one row per geometry feature, padded to whole vectors
//   parameters     (W, P)
//   out            (W, N_padded)
//
// Work item (g, w): lanes are WIDTH neighbouring directions, all with the parameters of wavelength w.
//
// With CAREFUL, features and parameters come as pairs: (2F, N_padded) and (W, 2P), high parts first, and
// the parameters are the model's derived ones.
kernel void evaluate(global const real *restrict feature_rows, const ulong n_padded,
                     global const real *restrict parameters, global real *restrict out) {
    const size_t group = get_global_id(0), w = get_global_id(1);
    const geometry x = geometry_lanes(feature_rows, n_padded, group);
#ifdef CAREFUL
    const geometry rest = geometry_lanes(feature_rows + F * n_padded, n_padded, group);
    pair p[P];
    for (int j = 0; j < P; ++j) {
        p[j].hi = (realv)parameters[w * 2 * P + j];
        p[j].lo = (realv)parameters[w * 2 * P + P + j];
    }
    STORE(model_brdf_careful(p, x, rest), group, out + w * n_padded);
#else
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = (realv)parameters[w * P + j];
    model_state m = model_prepare(p);
    model_incident(&m, x);
    STORE(model_brdf(&m, x), group, out + w * n_padded);
#endif
}
