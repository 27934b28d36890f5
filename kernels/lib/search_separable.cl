// A search in the coordinates that do not enter linearly: at each step the two linear parameters are set to
// their best values within the limits, and the energy is log2 of the objective there.
//
// With f = t0 + t1, t0 and t1 the terms at the linear parameters the chain last had, a step δ that multiplies
// them by 1 + δ0 and 1 + δ1 changes E by the quadratic form
//
//   ΔE = 2 (δ0 Σ t0 r + δ1 Σ t1 r) + δ0² Σ t0² + 2 δ0 δ1 Σ t0 t1 + δ1² Σ t1²,  r = t0 + t1 − data, all scaled.
//
// Sums of residuals rather than of data: what cancels is small once the chain is near, so that single precision
// does. Where E falls far, the sums are formed once more about the new values. The minimum lies inside the box
// or on one of its edges; all five are formed.
//
//   error    E as of the objective, plus a few ulp of Σ r² at the chain's last linear parameters
//   source   Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413

#define SEARCHED (P - 2)
#define SOLVED 2

#ifdef REAL_IS_DOUBLE
#define LEAST_LENGTH 1e-290
#else
#define LEAST_LENGTH 1e-34f
#endif

inline int searched(int k) { return searched_place[k]; }

inline realv bounded(realv x, realv low, realv high) {
    const realv above = x > low ? x : low;
    return above < high ? above : high;
}

// Sums at p, and p with the linear parameters set to their best values; returns E there and writes E at p.
inline realv solve_linear(realv *p, realv *before, global const real *restrict rows,
                          global const uint *restrict starts, const uint groups,
                          global const real *restrict target, global const real *restrict scale,
                          global const real *restrict lower, global const real *restrict upper) {
    model_state m = model_prepare(p);
    realv rr = (realv)0.0, r0 = rr, r1 = rr, s00 = rr, s01 = rr, s11 = rr;
    for (uint g = 0; g < groups; ++g) {
        model_incident(&m, geometry_of(rows, starts[g]));
        for (uint n = starts[g]; n < starts[g + 1]; ++n) {
            const realv s = (realv)scale[n];
            realv term[2];
            model_terms(&m, geometry_of(rows, n), term);
            const realv t0 = s * term[0], t1 = s * term[1];
            const realv r = t0 + t1 - (realv)target[n];
            rr += r * r;
            r0 += t0 * r;
            r1 += t1 * r;
            s00 += t0 * t0;
            s01 += t0 * t1;
            s11 += t1 * t1;
        }
    }
    // In units in which both terms have length 1; a term that is not felt stays where it is.
    const realv tiny = (realv)LEAST_LENGTH;
    const realv u0 = s00 > tiny ? rsqrt(s00) : (realv)0.0, u1 = s11 > tiny ? rsqrt(s11) : (realv)0.0;
    realv least[2], most[2], low[2], high[2];
    for (int k = 0; k < 2; ++k) {
        const int j = linear_place[k];
        const realv length = sqrt(k ? s11 : s00);
        least[k] = value_of(j, (realv)lower[j]);
        most[k] = value_of(j, (realv)upper[j]);
        low[k] = (least[k] / p[j] - (realv)1.0) * length;
        high[k] = (most[k] / p[j] - (realv)1.0) * length;
    }
    const realv b0 = r0 * u0, b1 = r1 * u1, rho = s01 * u0 * u1;
    const realv determinant = (realv)1.0 - rho * rho;
    realv x = (realv)0.0, y = (realv)0.0, change = (realv)0.0;  // staying is always possible
    for (int k = 0; k < 5; ++k) {
        realv tx, ty;
        integerv possible = rr == rr;
        if (k < 2) {
            tx = k ? high[0] : low[0];
            ty = bounded(-b1 - rho * tx, low[1], high[1]);
        } else if (k < 4) {
            ty = k == 3 ? high[1] : low[1];
            tx = bounded(-b0 - rho * ty, low[0], high[0]);
        } else {
            tx = (rho * b1 - b0) / determinant;
            ty = (rho * b0 - b1) / determinant;
            possible = (determinant > (realv)1e-5) & (tx >= low[0]) & (tx <= high[0]) & (ty >= low[1]) &
                       (ty <= high[1]);
        }
        const realv gain = (realv)2.0 * (tx * b0 + ty * b1 + rho * tx * ty) + tx * tx + ty * ty;
        const integerv better = possible & (gain < change);
        x = better ? tx : x;
        y = better ? ty : y;
        change = better ? gain : change;
    }
    const int j0 = linear_place[0], j1 = linear_place[1];
    p[j0] = bounded(p[j0] * ((realv)1.0 + x * u0), least[0], most[0]);
    p[j1] = bounded(p[j1] * ((realv)1.0 + y * u1), least[1], most[1]);
    *before = rr;
    return rr + change;
}

inline realv energy_at(realv *p, global const real *restrict rows, global const uint *restrict starts,
                       const uint groups, global const real *restrict target,
                       global const real *restrict scale, global const real *restrict lower,
                       global const real *restrict upper) {
    const int j0 = linear_place[0], j1 = linear_place[1];
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
        p[j0] = again ? trial[j0] : p[j0];
        p[j1] = again ? trial[j1] : p[j1];
        before = again ? before : (realv)0.0;
    }
    return log2_of_objective(E);
}
