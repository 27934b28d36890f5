// The objective (13) of many parameter sets at each wavelength.
//
//   parameters   (W, G, P) in vectors of WIDTH sets
//   out          (W, G) in vectors of WIDTH
//
// Work item (g, w): lanes are WIDTH parameter sets at wavelength w.
kernel void objectives(global const real *restrict rows, global const uint *restrict starts,
                       const uint incident_groups, const uint n_directions,
                       global const real *restrict target, global const real *restrict scale,
                       global const real *restrict parameters, global real *restrict out) {
    const size_t g = get_global_id(0), w = get_global_id(1);
    const size_t place = w * get_global_size(0) + g;
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = LOAD(place * P + j, parameters);
    STORE(objective_of(p, rows, starts, incident_groups, target + w * n_directions, scale + w * n_directions),
          place, out);
}
