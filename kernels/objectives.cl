// The objective (13) of many parameter sets at each wavelength.
//
//   parameters   (W, G, P) in vectors of WIDTH sets
//   out          (W, G) in vectors of WIDTH
//
// Work item (g, w): lanes are WIDTH parameter sets at wavelength w. Of points, in the unrolled loops of the searches;
// else of what the detector sees.
kernel void objectives(OBSERVATION, global const uint *restrict starts, const uint incident_groups,
                       const uint n_directions, global const real *restrict target_all,
                       global const real *restrict scale_all, global const real *restrict parameters,
                       global real *restrict out) {
    const size_t g = get_global_id(0), w = get_global_id(1);
    const size_t place = w * get_global_size(0) + g;
    global const real *target = target_all + w * n_directions, *scale = scale_all + w * n_directions;
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = LOAD(place * P + j, parameters);
    realv E = (realv)0.0;
    E = objective_of(p, rows, starts, incident_groups, target, scale);  //@points
    const observation seen = OBSERVED;                                  //@nodes
    model_state m = model_prepare(p);                                   //@nodes
    for (uint i = 0; i < incident_groups; ++i) {                        //@nodes
        seen_incident(&m, &seen, starts[i]);                            //@nodes
        for (uint n = starts[i]; n < starts[i + 1]; ++n) {              //@nodes
            const realv r = seen_brdf(&m, &seen, n) * (realv)scale[n] - (realv)target[n];  //@nodes
            E += r * r;                                                 //@nodes
        }                                                               //@nodes
    }                                                                   //@nodes
    STORE(E, place, out);
}
