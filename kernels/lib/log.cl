// Natural logarithm for vectors, faster than the built-in where that is not inlined.
//
// x = 2^e m with m in [√½, √2); log x = e log 2 + log m, log m = 2s + s³ P(s²), s = (m − 1)/(m + 1).
// The exponent is taken out of the bits as an integer and brought to a real number by adding it to the bits of
// EXP2_ROUNDER (exp2.cl), so that no conversion of 64-bit integers is needed.
//
//   error    log_lanes    2 ulp relative, below half an ulp of 1 absolute about x = 1
//            log1p_lanes  2 ulp relative (tests/kernels/test_library.py, mpmath)
//   domain   log_lanes: normal numbers; log1p_lanes: 0 ≤ x < 2^127 (2^1023)
//   source   P by interpolation in Chebyshev nodes, in 50 digits; Muller, Elementary Functions (3rd ed., 2016),
//            chapter 3; log1p keeps what 1 + x rounds away, after Goldberg, ACM Comput. Surv. 23 (1991) 5, theorem 4

#ifdef REAL_IS_DOUBLE
#define LOG_BIAS 1023
#define LOG_ONE_LESS_ROOT_HALF (0x3FF0000000000000L - 0x3FE6A09E667F3BCDL)
#else
#define LOG_BIAS 127
#define LOG_ONE_LESS_ROOT_HALF (0x3F800000 - 0x3F3504F3)
#endif

// e log 2 + log(1 + m), 1 + m in [√½, √2), from e, m and 2 + m.
inline realv log_of_parts(realv exponent, realv m, realv two_and_m) {
    const realv s = m / two_and_m, z = s * s;
#ifdef REAL_IS_DOUBLE
    const realv q = z * z;
    realv even = (realv)0.146164496850434059;
    even = even * q + 0.181828891252617221;
    even = even * q + 0.285714286259754849;
    even = even * q + 0.666666666666666969;
    realv odd = (realv)0.153317216005560413;
    odd = odd * q + 0.222222111347950799;
    odd = odd * q + 0.399999999998995045;
    const realv p = odd * z + even;
#else
    realv p = (realv)0.295799494f;
    p = p * z + 0.399887806f;
    p = p * z + 0.666666850f;
#endif
    return exponent * (real)0.6931471805599453 + (s + s + s * z * p);
}

inline integerv log_exponent(realv x) {
    return ((AS_INTEGERV(x) + (integerv)LOG_ONE_LESS_ROOT_HALF) >> EXP2_MANTISSA_BITS) - (integerv)LOG_BIAS;
}

inline realv log_real(integerv e) {
    return AS_REALV(AS_INTEGERV((realv)EXP2_ROUNDER) + e) - (realv)EXP2_ROUNDER;
}

inline realv log_lanes(realv x) {
    const integerv e = log_exponent(x);
    const realv m = AS_REALV(AS_INTEGERV(x) - (e << EXP2_MANTISSA_BITS));
    return log_of_parts(log_real(e), m - (realv)1.0, m + (realv)1.0);
}

inline realv log1p_lanes(realv x) {
    const realv u = (realv)1.0 + x;
    const integerv e = log_exponent(u), shift = e << EXP2_MANTISSA_BITS;
    const realv m = AS_REALV(AS_INTEGERV(u) - shift);
    // What 1 + x has rounded away comes back, on the scale of m; beyond the mantissa there is nothing to bring back.
    const realv rest = (x - (u - (realv)1.0)) * AS_REALV(AS_INTEGERV((realv)1.0) - shift);
    return log_of_parts(log_real(e), (m - (realv)1.0) + rest, m + (realv)1.0);
}
