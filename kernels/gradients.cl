// The objective (13) and its derivatives by the coordinates, for many points at one wavelength:
//
//   E = Σ r_n²,  ∂E/∂q_j = 2 (dp_j/dq_j) Σ r_n s_n ∂f_n/∂p_j,  r_n = s_n f_n − y_n
//
//   coordinates  (G, P)       in vectors of WIDTH points
//   out          (G, 1 + P)   E, then the derivatives, in vectors of WIDTH
//
// Work item g: lanes are WIDTH points. Tangents are summed within an incident direction, and spread over the
// parameters once for each.
kernel void gradients(OBSERVATION, global const uint *restrict starts, const uint incident_groups,
                      global const real *restrict target, global const real *restrict scale,
                      global const real *restrict coordinates, global real *restrict out) {
    const size_t g = get_global_id(0);
    const observation seen = OBSERVED;
    realv p[P], sums[P];
    for (int j = 0; j < P; ++j) {
        p[j] = value_of(j, LOAD(g * P + j, coordinates));
        sums[j] = (realv)0.0;
    }
    model_state m = model_prepare(p);
    realv E = (realv)0.0;
    for (uint i = 0; i < incident_groups; ++i) {
        seen_incident(&m, &seen, starts[i]);
        realv with_residual[SEEN_TANGENTS];
        for (int k = 0; k < SEEN_TANGENTS; ++k) with_residual[k] = (realv)0.0;
        for (uint n = starts[i]; n < starts[i + 1]; ++n) {
            const realv s = (realv)scale[n];
            realv tangent[SEEN_TANGENTS];
            const realv r = s * seen_tangents(&m, &seen, n, tangent) - (realv)target[n];
            E += r * r;
            for (int k = 0; k < SEEN_TANGENTS; ++k) with_residual[k] += r * s * tangent[k];
        }
        realv factor[P];
        seen_factors(&m, factor);
        for (int j = 0; j < P; ++j) sums[j] += factor[j] * with_residual[seen_tangent(j)];
    }
    STORE(E, g * (P + 1), out);
    for (int j = 0; j < P; ++j)
        STORE((realv)2.0 * slope_of(j, p[j]) * sums[j], g * (P + 1) + 1 + j, out);
}
