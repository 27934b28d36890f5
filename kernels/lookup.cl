// The objective (13) at shapes that all wavelengths share, the linear parameters solved at each (lib/search_*.cl).
//
//   shapes       (G, P) coordinates q in vectors of WIDTH shapes; given parameters and starts of the linear ones
//                come from the limits
//   energy       (W, G) log2 of E in vectors of WIDTH
//   linear       (W, G, LINEAR) the linear parameters there, as coordinates, in vectors of WIDTH
//
// Work item (g, w): lanes are WIDTH shapes at wavelength w.
kernel void lookup(global const real *restrict rows, global const uint *restrict starts,
                   const uint incident_groups, const uint n_directions, global const real *restrict target_all,
                   global const real *restrict scale_all, global const real *restrict lower_all,
                   global const real *restrict upper_all, global const real *restrict shapes,
                   global real *restrict energy, global real *restrict linear) {
    const size_t g = get_global_id(0), groups = get_global_size(0), w = get_global_id(1);
    global const real *lower = lower_all + w * P, *upper = upper_all + w * P;
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = value_of(j, (realv)lower[j]);
    for (int k = 0; k < SEARCHED; ++k) p[searched(k)] = value_of(searched(k), LOAD(g * P + searched(k), shapes));
    const realv E = energy_at(p, rows, starts, incident_groups, target_all + w * n_directions,
                              scale_all + w * n_directions, lower, upper);
    STORE(E, w * groups + g, energy);
    for (int k = 0; k < SOLVED; ++k) {
        const int j = linear_place[k];
        STORE(coordinate_of(j, p[j]), (w * groups + g) * SOLVED + k, linear);
    }
}
