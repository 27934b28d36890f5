// Model values on the points of a lobe mesh, for one incident direction and one parameter set.
//
//   views        (4, N_padded) rows x, y, z of the unit view vectors and sin²γ; x points forward (to the
//                side of the mirror direction), z along the surface normal
//   incident     cosθi, sinθi
//   parameters   (P)
//   out          (N_padded)
//
// G cosθi cosθr = |v_h cosθi − s_h cosθr| with the horizontal parts of the view and source vectors, the
// source at (−sinθi, 0, cosθi).
kernel void mesh(global const real *restrict views, const ulong n_padded, const real cos_i,
                 const real sin_i, global const real *restrict parameters, global real *restrict out) {
    const size_t group = get_global_id(0);
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = (realv)parameters[j];
    model_state m = model_prepare(p);
    const realv x = LOAD(group, views), y = LOAD(group, views + n_padded);
    const realv z = LOAD(group, views + 2 * n_padded);
    const realv along = x * cos_i + z * sin_i, across = y * cos_i;
    direction v;
    v.cos_i = (realv)cos_i;
    v.cos_r = z;
    v.sin2_gamma = LOAD(group, views + 3 * n_padded);
    v.attenuation = sqrt(along * along + across * across);
    const geometry features = geometry_of_direction(v);
    model_incident(&m, features);
    STORE(model_brdf(&m, features), group, out);
}
