// What a fit tells of itself at its parameters, as sums over parts of the directions:
//
//   E = Σ r_n²,  r_n = s_n f_n − y_n                               the objective (13)
//   the largest f_n of those that count
//   G_ij = Σ s_n² ∂f_n/∂p_i ∂f_n/∂p_j                              packed by rows, by the parameters themselves
//   S_ij = Σ s_n² (s_n σ_n)² ∂f_n/∂p_i ∂f_n/∂p_j                   //@noise alone
//   deviation_n = ((f_n − m_n) / m_n)², 0 where m_n ≤ 0
//
//   rows         (F, N_padded)  features, one row each, padded to whole vectors
//   parameters   (W, P)
//   target, scale, noise, inverse   (W, N_padded)  y, s, s σ, and 1 / m where m counts for the deviation, else 0;
//                               where `inverse` is not given, all y > 0 count; all 0 in the padding
//   sums         (W, C, SUMS)   in vectors of WIDTH, to be added up
//   deviation    (W, N_padded)
//
// Work item (c, w): lanes are neighbouring directions, `part` vectors of them, so that sums depend on neither the
// number of wavelengths nor of cores.

#define PACKED(i, j) ((i) * ((i) + 1) / 2 + (j))
#define PAIRS (P * (P + 1) / 2)

kernel void summary(global const real *restrict rows, const ulong n_padded, const uint part,
                    global const real *restrict parameters, global const real *restrict target_all,
                    global const real *restrict scale_all,
                    global const real *restrict noise_all,  //@noise
                    global const real *restrict inverse_all,  //@apart
                    global real *restrict deviation_all, global real *restrict sums) {
    const size_t c = get_global_id(0), parts = get_global_size(0), w = get_global_id(1);
    const size_t vectors = n_padded / WIDTH, first = c * part;
    const size_t last = first + part < vectors ? first + part : vectors;
    global const real *target = target_all + w * n_padded, *scale = scale_all + w * n_padded;
    realv p[P], G[PAIRS], E = (realv)0.0, peak = (realv)(-INFINITY);
    realv S[PAIRS];  //@noise
    for (int j = 0; j < P; ++j) p[j] = (realv)parameters[w * P + j];
    for (int k = 0; k < PAIRS; ++k) G[k] = (realv)0.0;
    for (int k = 0; k < PAIRS; ++k) S[k] = (realv)0.0;  //@noise
    model_state m = model_prepare(p);
    for (size_t g = first; g < last; ++g) {
        const geometry x = geometry_lanes(rows, n_padded, g);
        const realv s = LOAD(g, scale), y = LOAD(g, target);
        const integerv counts = s > (realv)0.0;
        realv tangent[TANGENTS], factor[P];
        model_incident(&m, x);
        const realv f = model_tangents(&m, x, tangent);
        model_factors(&m, factor);
        // What is masked has no part in it, whatever the model is there.
        const realv r = counts ? s * f - y : (realv)0.0;
        E += r * r;
        peak = (counts & (f > peak)) ? f : peak;
        realv away = y > (realv)0.0 ? r / y : (realv)0.0;
        const realv inverse = LOAD(g, inverse_all + w * n_padded);  //@apart
        away = inverse > (realv)0.0 ? f * inverse - (realv)1.0 : (realv)0.0;  //@apart
        STORE(away * away, g, deviation_all + w * n_padded);
        for (int j = 0; j < P; ++j) factor[j] = counts ? s * factor[j] * tangent[tangent_of[j]] : (realv)0.0;
        for (int i = 0; i < P; ++i)
            for (int j = 0; j <= i; ++j) G[PACKED(i, j)] += factor[i] * factor[j];
        const realv noise = LOAD(g, noise_all + w * n_padded);  //@noise
        for (int j = 0; j < P; ++j) factor[j] *= noise;  //@noise
        for (int i = 0; i < P; ++i)  //@noise
            for (int j = 0; j <= i; ++j) S[PACKED(i, j)] += factor[i] * factor[j];  //@noise
    }
    size_t place = (w * parts + c) * (2 + PAIRS);
    place = (w * parts + c) * (2 + 2 * PAIRS);  //@noise
    STORE(E, place, sums);
    STORE(peak, place + 1, sums);
    for (int k = 0; k < PAIRS; ++k) STORE(G[k], place + 2 + k, sums);
    for (int k = 0; k < PAIRS; ++k) STORE(S[k], place + 2 + PAIRS + k, sums);  //@noise
}
