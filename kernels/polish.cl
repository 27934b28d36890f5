// Bounded Levenberg-Marquardt with analytic derivatives, one start a lane, to a stationary point of (13). Lanes are
// starts of one wavelength, which share its data, or wavelengths with one start each.
//
// Each iteration makes one pass over the directions, seen as lib/seen_*.cl say, and forms E = rᵀr, h = Jᵀr and
// H = JᵀJ of the trial.
// Coordinates at a limit whose gradient points outwards are held there. The system is scaled to a unit
// diagonal and damped, (H + μI) δ = −h; the trial is cut to the limits and taken where E falls. A lane is
// done when the step would lower E by less than `tolerance` relative, or no damping lowers it any more.
//
//   start, end     (W, G, P) coordinates q, vectors of WIDTH
//   objective      (W, G)    E at the end
//   iterations     (W, G)    passes over the directions while the lane was not done
//   done           (W, G)    given: 1 for lanes that stay as they are; then 1 where stopped by itself, 0
//                            where by `most_iterations`
//
// In single precision the limits below keep the damped system solvable; E is then good to about 1e-6.
//
// Sources: Marquardt, J. SIAM 11 (1963) 431, doi:10.1137/0111030 (method, scaling); Nielsen, Damping
// parameter in Marquardt's method, IMM-REP-1999-05 (change of μ).

#ifdef REAL_IS_DOUBLE
#define LEAST_SQUARE 1e-290
#define LEAST_PIVOT 1e-30
#define LEAST_DAMPING 1e-15
#define MOST_DAMPING 1e16
#else
#define LEAST_SQUARE 1e-36f
#define LEAST_PIVOT 1e-9f
#define LEAST_DAMPING 1e-6f
#define MOST_DAMPING 1e7f
#endif

#define DATUM(i, p) ((realv)((p)[i]))  //@starts
#define TOGETHER 1                     //@starts
#define DATUM(i, p) LOAD((i), (p))     //@wavelengths
#define TOGETHER WIDTH                 //@wavelengths

#define PACKED(i, j) ((i) * ((i) + 1) / 2 + (j))
#define PAIRS (FREE * (FREE + 1) / 2)

#define PRODUCTS (SEEN_TANGENTS * (SEEN_TANGENTS + 1) / 2)

// E at q, h and H over the free coordinates. Within one incident direction the derivatives are multiples of a few
// tangents: products of those are summed, and spread over the parameters once a group.
inline realv normal_equations(const realv *q, const observation *seen, global const uint *restrict starts,
                              const uint groups,
                              global const real *restrict target, global const real *restrict scale,
                              realv *h, realv *H) {
    realv p[P];
    for (int j = 0; j < P; ++j) p[j] = value_of(j, q[j]);
    for (int i = 0; i < FREE; ++i) h[i] = (realv)0.0;
    for (int k = 0; k < PAIRS; ++k) H[k] = (realv)0.0;
    model_state m = model_prepare(p);
    realv E = (realv)0.0;
    for (uint g = 0; g < groups; ++g) {
        seen_incident(&m, seen, starts[g]);
        realv product[PRODUCTS], with_residual[SEEN_TANGENTS];
        for (int k = 0; k < PRODUCTS; ++k) product[k] = (realv)0.0;
        for (int k = 0; k < SEEN_TANGENTS; ++k) with_residual[k] = (realv)0.0;
        for (uint n = starts[g]; n < starts[g + 1]; ++n) {
            const realv s = DATUM(n, scale);
            realv tangent[SEEN_TANGENTS];
            const realv residual = s * seen_tangents(&m, seen, n, tangent) - DATUM(n, target);
            E += residual * residual;
            for (int i = 0; i < SEEN_TANGENTS; ++i) {
                tangent[i] *= s;
                with_residual[i] += tangent[i] * residual;
                for (int j = 0; j <= i; ++j) product[PACKED(i, j)] += tangent[i] * tangent[j];
            }
        }
        realv factor[P];
        seen_factors(&m, factor);
        for (int i = 0; i < FREE; ++i) {
            const int s = seen_tangent(free_place[i]);
            factor[free_place[i]] *= slope_of(free_place[i], p[free_place[i]]);
            h[i] += factor[free_place[i]] * with_residual[s];
            for (int j = 0; j <= i; ++j) {
                const int t = seen_tangent(free_place[j]);
                H[PACKED(i, j)] +=
                    factor[free_place[i]] * factor[free_place[j]] * product[s > t ? PACKED(s, t) : PACKED(t, s)];
            }
        }
    }
    return E;
}

// Solve (S H S + μI) y = −S h over the free coordinates, S the scaling to a unit diagonal; δ = S y.
// Returns the decrease of E that the quadratic model predicts for δ.
inline realv damped_step(const realv *h, const realv *H, const realv *free, realv mu, realv *delta) {
    realv L[PAIRS], S[FREE], y[FREE];
    for (int i = 0; i < FREE; ++i) S[i] = rsqrt(max(H[PACKED(i, i)], (realv)LEAST_SQUARE)) * free[i];
    for (int i = 0; i < FREE; ++i)
        for (int j = 0; j <= i; ++j) {
            realv sum = H[PACKED(i, j)] * S[i] * S[j];
            if (i == j) sum += mu + ((realv)1.0 - free[i]);
            for (int k = 0; k < j; ++k) sum -= L[PACKED(i, k)] * L[PACKED(j, k)];
            L[PACKED(i, j)] = i == j ? sqrt(max(sum, (realv)LEAST_PIVOT)) : sum / L[PACKED(j, j)];
        }
    for (int i = 0; i < FREE; ++i) {
        realv sum = -h[i] * S[i];
        for (int k = 0; k < i; ++k) sum -= L[PACKED(i, k)] * y[k];
        y[i] = sum / L[PACKED(i, i)];
    }
    realv predicted = (realv)0.0;
    for (int i = FREE - 1; i >= 0; --i) {
        realv sum = y[i];
        for (int k = i + 1; k < FREE; ++k) sum -= L[PACKED(k, i)] * y[k];
        y[i] = sum / L[PACKED(i, i)];
    }
    for (int i = 0; i < FREE; ++i) {
        predicted += y[i] * (mu * y[i] - h[i] * S[i]);
        delta[i] = y[i] * S[i];
    }
    return predicted;
}

kernel void polish(OBSERVATION, global const uint *restrict starts, const uint incident_groups,
                   const uint n_directions,
                   global const real *restrict target_all, global const real *restrict scale_all,
                   global const real *restrict lower_all, global const real *restrict upper_all,
                   const uint most_iterations, const real tolerance, const real damping,
                   global real *restrict q_all, global real *restrict objective_all,
                   global real *restrict iterations_all, global real *restrict done_all) {
    const size_t g = get_global_id(0), groups = get_global_size(0), w = get_global_id(1);
    const size_t place = w * groups + g;
    global const real *target = target_all + w * n_directions * TOGETHER;
    global const real *scale = scale_all + w * n_directions * TOGETHER;
    global const real *lower = lower_all + w * P * TOGETHER, *upper = upper_all + w * P * TOGETHER;
    const observation seen = OBSERVED;
    realv done = LOAD(place, done_all);
    if (!ANY(done == (realv)0.0)) return;
    realv q[P], h[FREE], H[PAIRS];
    for (int j = 0; j < P; ++j) q[j] = clamp(LOAD(place * P + j, q_all), DATUM(j, lower), DATUM(j, upper));
    realv E = normal_equations(q, &seen, starts, incident_groups, target, scale, h, H);
    realv mu = (realv)damping, growth = (realv)2.0, iterations = (realv)1.0 - done;

    for (uint iteration = 1; iteration < most_iterations; ++iteration) {
        realv free[FREE], delta[FREE], trial[P], trial_h[FREE], trial_H[PAIRS];
        for (int i = 0; i < FREE; ++i) {
            const int j = free_place[i];
            const integerv held = ((q[j] <= DATUM(j, lower)) & (h[i] > (realv)0.0)) |
                                  ((q[j] >= DATUM(j, upper)) & (h[i] < (realv)0.0));
            free[i] = held ? (realv)0.0 : (realv)1.0;
        }
        const realv predicted = damped_step(h, H, free, mu, delta);
        for (int j = 0; j < P; ++j) trial[j] = q[j];
        for (int i = 0; i < FREE; ++i) {
            const int j = free_place[i];
            // A coordinate without effect asks for endless steps: a quarter of its range is enough.
            const realv longest = (realv)0.25 * (DATUM(j, upper) - DATUM(j, lower));
            trial[j] = clamp(q[j] + clamp(delta[i], -longest, longest), DATUM(j, lower), DATUM(j, upper));
        }
        const realv trial_E = normal_equations(trial, &seen, starts, incident_groups, target, scale, trial_h, trial_H);
        iterations += (realv)1.0 - done;

        const integerv open = done == (realv)0.0;
        const integerv accept = open & (trial_E < E);
        const realv ratio = (E - trial_E) / max(predicted, (realv)LEAST_SQUARE);
        const realv bend = (realv)2.0 * ratio - (realv)1.0;
        const realv shrink = max((realv)1.0 / (realv)3.0, (realv)1.0 - bend * bend * bend);
        // Judged before the trial is taken: the trial may still bring the last digit.
        const integerv finished = ((predicted <= (realv)tolerance * E) & (mu <= (realv)1.0)) |
                                  (mu > (realv)MOST_DAMPING) | (E <= (realv)1e-30);
        mu = accept ? max(mu * min(shrink, (realv)2.0), (realv)LEAST_DAMPING) : (open ? mu * growth : mu);
        growth = accept ? (realv)2.0 : (open ? growth * (realv)2.0 : growth);
        E = accept ? trial_E : E;
        for (int j = 0; j < P; ++j) q[j] = accept ? trial[j] : q[j];
        for (int i = 0; i < FREE; ++i) h[i] = accept ? trial_h[i] : h[i];
        for (int k = 0; k < PAIRS; ++k) H[k] = accept ? trial_H[k] : H[k];
        done = finished ? (realv)1.0 : done;
        if (!ANY(done == (realv)0.0)) break;
    }
    for (int j = 0; j < P; ++j) STORE(q[j], place * P + j, q_all);
    STORE(E, place, objective_all);
    STORE(iterations, place, iterations_all);
    STORE(done, place, done_all);
}
