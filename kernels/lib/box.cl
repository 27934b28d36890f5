// The minimum of a small quadratic form within a box, lane by lane.
//
//   q(x) = xᵀ R x + 2 bᵀ x,  low ≤ x ≤ high,  R of unit diagonal, packed by rows; x = 0 lies in the box
//
// A few rounds of descent along one coordinate after another find which limits hold; then the free coordinates
// are solved for together, twice, and what comes out is taken where it is lower. q never rises.
//
//   source   Björck, Numerical Methods for Least Squares Problems (1996), section 5.2

#define BOX_PACKED(i, j) ((i) >= (j) ? (i) * ((i) + 1) / 2 + (j) : (j) * ((j) + 1) / 2 + (i))
#define BOX_ROUNDS (LINEAR > 1 ? 10 : 1)

#ifdef REAL_IS_DOUBLE
#define BOX_PIVOT 1e-13
#define BOX_ROUNDING 1e-15
#else
#define BOX_PIVOT 1e-5f
#define BOX_ROUNDING 1e-6f
#endif

inline realv bounded(realv x, realv low, realv high) {
    const realv above = x > low ? x : low;
    return above < high ? above : high;
}

// q at x, and the rounding that may be in it: long steps along nearly equal terms cancel.
inline realv box_value(const realv *R, const realv *b, const realv *x, realv *rounding) {
    realv sum = (realv)0.0, size = (realv)0.0;
    for (int i = 0; i < LINEAR; ++i) {
        realv row = (realv)2.0 * b[i], length = fabs(row);
        for (int j = 0; j < LINEAR; ++j) {
            const realv part = R[BOX_PACKED(i, j)] * x[j];
            row += part;
            length += fabs(part);
        }
        sum += row * x[i];
        size += length * fabs(x[i]);
    }
    *rounding = size * (realv)BOX_ROUNDING;
    return sum;
}

// Writes the x that was found and returns q there, at most 0.
inline realv box_minimum(const realv *R, const realv *b, const realv *low, const realv *high, realv *x) {
    for (int i = 0; i < LINEAR; ++i) x[i] = (realv)0.0;
    for (int round = 0; round < BOX_ROUNDS; ++round)
        for (int i = 0; i < LINEAR; ++i) {
            realv pull = b[i];
            for (int j = 0; j < LINEAR; ++j)
                if (j != i) pull += R[BOX_PACKED(i, j)] * x[j];
            x[i] = bounded(-pull, low[i], high[i]);
        }
    realv rounding;
    realv value = box_value(R, b, x, &rounding);
    for (int attempt = 0; LINEAR > 1 && attempt < 2; ++attempt) {
        // Cholesky of the free block; a coordinate at a limit stands alone there.
        realv free[LINEAR], L[LINEAR * (LINEAR + 1) / 2], y[LINEAR];
        for (int i = 0; i < LINEAR; ++i)
            free[i] = ((x[i] > low[i]) & (x[i] < high[i])) ? (realv)1.0 : (realv)0.0;
        for (int i = 0; i < LINEAR; ++i) {
            realv right = -b[i];
            for (int j = 0; j < LINEAR; ++j) right -= R[BOX_PACKED(i, j)] * x[j] * ((realv)1.0 - free[j]);
            right = free[i] * right + ((realv)1.0 - free[i]) * x[i];
            for (int j = 0; j <= i; ++j) {
                realv sum = R[BOX_PACKED(i, j)] * free[i] * free[j];
                if (i == j) sum += (realv)1.0 - free[i];
                for (int k = 0; k < j; ++k) sum -= L[BOX_PACKED(i, k)] * L[BOX_PACKED(j, k)];
                if (i == j) sum = sqrt(sum > (realv)BOX_PIVOT ? sum : (realv)BOX_PIVOT);
                L[BOX_PACKED(i, j)] = i == j ? sum : sum / L[BOX_PACKED(j, j)];
            }
            for (int k = 0; k < i; ++k) right -= L[BOX_PACKED(i, k)] * y[k];
            y[i] = right / L[BOX_PACKED(i, i)];
        }
        for (int i = LINEAR - 1; i >= 0; --i) {
            realv sum = y[i];
            for (int k = i + 1; k < LINEAR; ++k) sum -= L[BOX_PACKED(k, i)] * y[k];
            y[i] = bounded(sum / L[BOX_PACKED(i, i)], low[i], high[i]);
        }
        const realv tried = box_value(R, b, y, &rounding);
        const integerv lower = tried + rounding < value;
        for (int i = 0; i < LINEAR; ++i) x[i] = lower ? y[i] : x[i];
        value = lower ? tried : value;
    }
    // Where sums have overflowed, x = 0 is what is known.
    const integerv sound = (value <= (realv)0.0) & (value > (realv)-INFINITY);
    for (int i = 0; i < LINEAR; ++i) x[i] = sound ? x[i] : (realv)0.0;
    return sound ? value : (realv)0.0;
}
