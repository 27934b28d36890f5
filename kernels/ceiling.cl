// What the processor can do at most: two exp2 and two multiply-adds for each evaluation, and nothing else;
// no loads, no geometry, no residual.
kernel void ceiling(const uint count, const real slope, global real *restrict out) {
    realv x[UNROLL], sums[UNROLL];
    for (int k = 0; k < UNROLL; ++k) {
        x[k] = (realv)((real)-1.0 - (real)0.1 * (real)k);
        sums[k] = (realv)0.0;
    }
    for (uint n = 0; n < count; n += UNROLL) {
#pragma unroll
        for (int k = 0; k < UNROLL; ++k) {
            const realv power = exp2_falling(x[k]);
            sums[k] += exp2_lanes(power * slope + x[k]);
            x[k] -= (realv)(real)1e-3;
        }
    }
    realv sum = sums[0];
    for (int k = 1; k < UNROLL; ++k) sum += sums[k];
    STORE(sum, get_global_id(0), out);
}
