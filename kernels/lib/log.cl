// Natural logarithm for vectors, faster than the built-in where that is not inlined.
//
// x = 2^e m with m in [√½, √2); log x = e log 2 + log m, log m = 2s + s³ P(s²), s = (m − 1)/(m + 1).
// The exponent is taken out of the bits as an integer and brought to a real number by adding it to the bits of
// EXP2_ROUNDER (exp2.cl), so that no conversion of 64-bit integers is needed.
//
//   error    log_lanes    2 ulp relative, below half an ulp of 1 absolute about x = 1
//            log1p_lanes  2 ulp relative (tests/kernels/test_library.py, mpmath)
//   domain   log_lanes: normal numbers; log1p_lanes: x ≥ 0
//   source   P by interpolation in Chebyshev nodes, in 50 digits; Muller, Elementary Functions (3rd ed., 2016),
//            chapter 3; log1p after Kahan's correction, Goldberg, ACM Comput. Surv. 23 (1991) 5, theorem 4

#ifdef REAL_IS_DOUBLE
#define LOG_BIAS 1023
#define LOG_ONE_LESS_ROOT_HALF (0x3FF0000000000000L - 0x3FE6A09E667F3BCDL)
#else
#define LOG_BIAS 127
#define LOG_ONE_LESS_ROOT_HALF (0x3F800000 - 0x3F3504F3)
#endif

inline realv log_lanes(realv x) {
    const integerv bits = AS_INTEGERV(x);
    const integerv e = ((bits + (integerv)LOG_ONE_LESS_ROOT_HALF) >> EXP2_MANTISSA_BITS) - (integerv)LOG_BIAS;
    const realv m = AS_REALV(bits - (e << EXP2_MANTISSA_BITS));
    const realv exponent = AS_REALV(AS_INTEGERV((realv)EXP2_ROUNDER) + e) - (realv)EXP2_ROUNDER;
    const realv s = (m - (realv)1.0) / (m + (realv)1.0), z = s * s;
#ifdef REAL_IS_DOUBLE
    realv p = (realv)0.146164496850434059;
    p = p * z + 0.153317216005560413;
    p = p * z + 0.181828891252617221;
    p = p * z + 0.222222111347950799;
    p = p * z + 0.285714286259754849;
    p = p * z + 0.399999999998995045;
    p = p * z + 0.666666666666666969;
#else
    realv p = (realv)0.295799494f;
    p = p * z + 0.399887806f;
    p = p * z + 0.666666850f;
#endif
    return exponent * (real)0.6931471805599453 + (s + s + s * z * p);
}

inline realv log1p_lanes(realv x) {
    const realv u = (realv)1.0 + x;
    // What 1 + x has rounded away comes back; beyond the mantissa there is nothing to bring back.
    return log_lanes(u) + (x - (u - (realv)1.0)) / u;
}
