// Weighted means of model values: over nodes, the directions of an aperture or a beam, and over bands, the
// wavelengths of a slit. Which of the two loops there is, the program that is assembled says.
//
//   feature_rows   (F, nodes, N_padded)
//   weights        (nodes, N_padded)
//   shares         (bands,)
//   parameters     (W, bands, P)
//   out            (W, N_padded)
//
// Work item (w, g): wavelengths are neighbours, so that the nodes of a group stay in the cache for all of them.
// Lanes, CAREFUL: as in evaluate.cl.
kernel void mean(global const real *restrict feature_rows, const ulong n_padded,
                 global const real *restrict weights, const ulong nodes,  //@nodes
                 global const real *restrict shares, const ulong bands,   //@bands
                 global const real *restrict parameters, global real *restrict out) {
    const size_t w = get_global_id(0), group = get_global_id(1);
    ulong length = n_padded, set = w;
    length *= nodes;  //@nodes
    realv total = (realv)0.0;
    for (ulong b = 0; b < bands; ++b) {  //@bands
    set = w * bands + b;                 //@bands
#ifdef CAREFUL
    pair p[P];
    for (int j = 0; j < P; ++j) {
        p[j].hi = (realv)parameters[set * 2 * P + j];
        p[j].lo = (realv)parameters[set * 2 * P + P + j];
    }
#else
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = (realv)parameters[set * P + j];
    model_state m = model_prepare(p);
#endif
    size_t place = group;
    realv sum = (realv)0.0;
    for (ulong k = 0; k < nodes; ++k) {      //@nodes
    place = k * (n_padded / WIDTH) + group;  //@nodes
    const geometry x = geometry_lanes(feature_rows, length, place);
#ifdef CAREFUL
    const geometry rest = geometry_lanes(feature_rows + F * length, length, place);
    realv f = model_brdf_careful(p, x, rest);
#else
    model_incident(&m, x);
    realv f = model_brdf(&m, x);
#endif
    f *= LOAD(place, weights);  //@nodes
    sum += f;
    }                           //@nodes
    sum *= (realv)shares[b];    //@bands
    total += sum;
    }                           //@bands
    STORE(total, group, out + w * n_padded);
}
