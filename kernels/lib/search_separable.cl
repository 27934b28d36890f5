// A search in the coordinates that do not enter linearly: at each step the linear parameters are set to their best
// values within the limits, and the energy is log2 of the objective there.
//
// A step that adds δ_k u_k to the linear parameters, u_k their unit (the parameter itself where it is on a log
// scale, else 1), changes f by Σ δ_k t_k with the terms t_k of the model, and E by the quadratic form
//
//   ΔE = 2 Σ δ_k Σ t_k r + Σ δ_k δ_l Σ t_k t_l,  r = f − data, all scaled.
//
// Sums of residuals rather than of data: what cancels is small once the chain is near, so that single precision
// does. Where E falls far, the sums are formed once more about the new values.
//
//   error    E as of the objective, plus a few ulp of Σ r² at the chain's last linear parameters
//   source   Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413

#define SEARCHED NONLINEAR
#define SOLVED LINEAR

#ifdef REAL_IS_DOUBLE
#define LEAST_LENGTH 1e-290
#else
#define LEAST_LENGTH 1e-34f
#endif

inline int searched(int k) { return searched_place[k]; }

// Sums at p, and p with the linear parameters set to their best values; returns E there and writes E at p.
inline realv solve_linear(realv *p, realv *before, global const real *restrict rows,
                          global const uint *restrict starts, const uint groups,
                          global const real *restrict target, global const real *restrict scale,
                          global const real *restrict lower, global const real *restrict upper) {
    model_state m = model_prepare(p);
    realv rr = (realv)0.0, b[LINEAR], R[LINEAR * (LINEAR + 1) / 2];
    for (int i = 0; i < LINEAR; ++i) {
        b[i] = (realv)0.0;
        for (int j = 0; j <= i; ++j) R[BOX_PACKED(i, j)] = (realv)0.0;
    }
    for (uint g = 0; g < groups; ++g) {
        model_incident(&m, geometry_of(rows, starts[g]));
        for (uint n = starts[g]; n < starts[g + 1]; ++n) {
            const realv s = (realv)scale[n];
            const geometry x = geometry_of(rows, n);
            realv term[TERMS];
            model_terms(&m, x, term);
            const realv r = s * model_brdf(&m, x) - (realv)target[n];
            rr += r * r;
            for (int i = 0; i < LINEAR; ++i) {
                const realv t = s * term[term_of[i]];
                b[i] += t * r;
                for (int j = 0; j <= i; ++j) R[BOX_PACKED(i, j)] += t * (s * term[term_of[j]]);
            }
        }
    }
    // In units in which each term has length 1; a term that is not felt stays where it is.
    realv u[LINEAR], unit[LINEAR], low[LINEAR], high[LINEAR], x[LINEAR];
    for (int k = 0; k < LINEAR; ++k) {
        const int j = linear_place[k];
        const realv square = R[BOX_PACKED(k, k)], length = sqrt(square);
        u[k] = square > (realv)LEAST_LENGTH ? (realv)1.0 / length : (realv)0.0;
        unit[k] = on_log_scale[j] ? p[j] : (realv)1.0;
        low[k] = (bound_of(j, lower[j], upper[j], 0) - p[j]) / unit[k] * length;
        high[k] = (bound_of(j, lower[j], upper[j], 1) - p[j]) / unit[k] * length;
        // The limits may round past the parameter; and what is not a number stays 0.
        low[k] = low[k] < (realv)0.0 ? low[k] : (realv)0.0;
        high[k] = high[k] > (realv)0.0 ? high[k] : (realv)0.0;
        b[k] *= u[k];
    }
    for (int i = 0; i < LINEAR; ++i)
        for (int j = 0; j <= i; ++j) R[BOX_PACKED(i, j)] = i == j ? (realv)1.0 : R[BOX_PACKED(i, j)] * u[i] * u[j];
    const realv change = box_minimum(R, b, low, high, x);
    for (int k = 0; k < LINEAR; ++k) {
        const int j = linear_place[k];
        p[j] = bounded(p[j] + x[k] * u[k] * unit[k], bound_of(j, lower[j], upper[j], 0),
                       bound_of(j, lower[j], upper[j], 1));
    }
    *before = rr;
    return rr + change;
}

inline realv energy_at(realv *p, global const real *restrict rows, global const uint *restrict starts,
                       const uint groups, global const real *restrict target,
                       global const real *restrict scale, global const real *restrict lower,
                       global const real *restrict upper) {
    realv before;
    realv E = solve_linear(p, &before, rows, starts, groups, target, scale, lower, upper);
    // Where E fell far, the difference has lost its digits: once more about the new values, for such lanes only.
    for (int k = 0; k < 2; ++k) {
        const integerv again = E < (realv)0.01 * before;
        if (!ANY(again)) break;
        realv trial[P];
        for (int j = 0; j < P; ++j) trial[j] = p[j];
        const realv E_again =
            solve_linear(trial, &before, rows, starts, groups, target, scale, lower, upper);
        E = again ? E_again : E;
        for (int i = 0; i < LINEAR; ++i) p[linear_place[i]] = again ? trial[linear_place[i]] : p[linear_place[i]];
        before = again ? before : (realv)0.0;
    }
    return log2_of_objective(E);
}
