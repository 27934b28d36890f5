// Numbers as unevaluated sums hi + lo of two, for exponents whose rounding one number would show.
//
// Splitting is by masking half of the mantissa away, so that the products of halves are exact whether or
// not the compiler fuses them.
//
//   error    pair_sum 2^-44 of the larger term, pair_product 2^-34 relative (tests/kernels); exp2_pair 6e-8
//            (through model values, tests/test_precision.py)
//   domain   finite numbers whose products neither overflow nor underflow
//   source   Dekker, Numer. Math. 18 (1971) 224, doi:10.1007/BF01397083; Knuth, TAOCP 2, 4.2.2

typedef struct {
    realv hi, lo;
} pair;

inline pair pair_sum(pair a, pair b) {
    const realv sum = a.hi + b.hi;
    const realv part = sum - a.hi;
    const realv rest = ((a.hi - (sum - part)) + (b.hi - part)) + (a.lo + b.lo);
    pair out;
    out.hi = sum + rest;
    out.lo = rest - (out.hi - sum);
    return out;
}

inline realv head_of(realv x) {
    return AS_REALV(AS_INTEGERV(x) & (integerv)0xFFFFF000);
}

inline pair pair_product(pair a, pair b) {
    const realv a_1 = head_of(a.hi), b_1 = head_of(b.hi);
    const realv a_2 = a.hi - a_1, b_2 = b.hi - b_1;
    const realv product = a_1 * b_1;
    const realv rest = (a_1 * b_2 + a_2 * b_1) + (a_2 * b_2 + (a.hi * b.lo + a.lo * b.hi));
    pair out;
    out.hi = product + rest;
    out.lo = rest - (out.hi - product);
    return out;
}

// 2^x − 1 for |x| ≤ 1/2, degree 6 as in exp2.cl.
inline realv exp2_less_1(realv r) {
    const realv q = r * r;
    const realv even = (0.000153533620f * q + 0.00961843692f) * q + 0.240226477f;
    const realv odd = (0.00133988739f * q + 0.0555033237f) * q + 0.693147182f;
    return odd * r + even * q;
}

// 2^x as a pair, for x ≤ 0; 0 below −126.
inline pair exp2_pair(pair x) {
    const realv bounded = x.hi > (realv)EXP2_LOWEST ? x.hi : (realv)EXP2_LOWEST;
    const realv shifted = bounded + (realv)EXP2_ROUNDER;
    const realv rounded = shifted - (realv)EXP2_ROUNDER;
    const realv excess = exp2_less_1((bounded - rounded) + (x.hi > (realv)EXP2_LOWEST ? x.lo : (realv)0.0));
    const integerv exponent = AS_INTEGERV(shifted) - AS_INTEGERV((realv)EXP2_ROUNDER) + (integerv)127;
    const realv scale = AS_REALV(exponent << EXP2_MANTISSA_BITS);
    pair out;
    out.hi = (realv)1.0 + excess;
    out.lo = excess - (out.hi - (realv)1.0);
    out.hi *= scale;
    out.lo *= scale;
    return out;
}

// 2^x as one number.
inline realv exp2_of_pair(pair x) {
    realv bounded = x.hi > (realv)EXP2_LOWEST ? x.hi : (realv)EXP2_LOWEST;
    bounded = bounded < (realv)EXP2_HIGHEST ? bounded : (realv)EXP2_HIGHEST;
    const realv rest = bounded == x.hi ? x.lo : (realv)0.0;
    const realv shifted = bounded + (realv)EXP2_ROUNDER;
    const realv p = exp2_polynomial((bounded - (shifted - (realv)EXP2_ROUNDER)) + rest);
    return AS_REALV(AS_INTEGERV(p) + (AS_INTEGERV(shifted) << EXP2_MANTISSA_BITS));
}
