// The objective (13) at shapes of a model without free linear parameters, whose values are the same at all
// wavelengths: each is formed once for TOGETHER of them.
//
//   shapes       (G, P) coordinates q in vectors of WIDTH shapes; given parameters come from the limits (P) of all
//   energy       (W, G) log2 of E in vectors of WIDTH
//
// Work item (g, b): lanes are WIDTH shapes at the wavelengths from TOGETHER · b on. Behind the last wavelength
// the last is taken again, and not stored.
//
//   error    the model's, plus N ulp for the sum in the worst case

#define TOGETHER 8  // as in clbrdf/fit/lookup.py

kernel void lookup_together(global const real *restrict rows, global const uint *restrict starts,
                            const uint incident_groups, const uint n_directions, const uint n_wavelengths,
                            global const real *restrict target_all, global const real *restrict scale_all,
                            global const real *restrict lower, global const real *restrict shapes,
                            global real *restrict energy) {
    const size_t g = get_global_id(0), groups = get_global_size(0), first = get_global_id(1) * TOGETHER;
    realv p[P], sums[TOGETHER];
    global const real *target[TOGETHER], *scale[TOGETHER];
    for (int k = 0; k < TOGETHER; ++k) {
        const size_t w = min(first + k, (size_t)(n_wavelengths - 1));
        target[k] = target_all + w * n_directions;
        scale[k] = scale_all + w * n_directions;
        sums[k] = (realv)0.0;
    }
    for (int j = 0; j < P; ++j) p[j] = value_of(j, (realv)lower[j]);
    for (int k = 0; k < NONLINEAR; ++k) {
        const int j = searched_place[k];
        p[j] = value_of(j, LOAD(g * P + j, shapes));
    }
    model_state m = model_prepare(p);
    for (uint i = 0; i < incident_groups; ++i) {
        model_incident(&m, geometry_of(rows, starts[i]));
        for (uint n = starts[i]; n < starts[i + 1]; ++n) {
            const realv f = model_brdf(&m, geometry_of(rows, n));
            for (int k = 0; k < TOGETHER; ++k) {
                const realv r = f * (realv)scale[k][n] - (realv)target[k][n];
                sums[k] += r * r;
            }
        }
    }
    for (int k = 0; k < TOGETHER && first + k < n_wavelengths; ++k)
        STORE(log2_of_objective(sums[k]), (first + k) * groups + g, energy);
}
