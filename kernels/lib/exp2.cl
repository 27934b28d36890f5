// 2^x for vectors, faster than the built-in where that is not inlined.
//
// n = round(x) by adding and subtracting 1.5·2^(mantissa bits); 2^r for r = x − n in [−1/2, 1/2] by a
// polynomial; n is added to the exponent field. Never build with -cl-fast-relaxed-math: it deletes the
// rounding.
//
//   error    single: 1.6e-7 relative;  double: 3.0e-16 relative (measured by tests/kernels/test_exp2.py)
//   domain   all finite x. Above 128 (1024) the result is +∞; below −127 (−1023) it is 0; in the last
//            octave of normal numbers, [−127, −126) ([−1023, −1022)), it lies between 0 and the
//            smallest normal number.
//   source   single: minimax in the relative error on [−1/2, 1/2], degree 6; double: Taylor series
//            (ln 2)^k / k!, degree 13, remainder 4e-18. Muller, Elementary Functions (3rd ed., 2016),
//            chapters 3 and 11.

#ifdef REAL_IS_DOUBLE
#define EXP2_ROUNDER 6755399441055744.0
#define EXP2_MANTISSA_BITS 52
#define EXP2_LOWEST -1023.0
#define EXP2_HIGHEST 1024.0
#else
#define EXP2_ROUNDER 12582912.0f
#define EXP2_MANTISSA_BITS 23
#define EXP2_LOWEST -127.0f
#define EXP2_HIGHEST 128.0f
#endif

inline realv exp2_polynomial(realv r) {
#ifdef REAL_IS_DOUBLE
    realv p = 1.3691488853904128881e-12;
    p = p * r + 2.5678435993488205142e-11;
    p = p * r + 4.4455382718708114976e-10;
    p = p * r + 7.0549116208011233299e-9;
    p = p * r + 1.0178086009239699728e-7;
    p = p * r + 1.3215486790144309488e-6;
    p = p * r + 1.5252733804059840280e-5;
    p = p * r + 1.5403530393381609954e-4;
    p = p * r + 1.3333558146428443423e-3;
    p = p * r + 9.6181291076284771620e-3;
    p = p * r + 5.5504108664821579953e-2;
    p = p * r + 2.4022650695910071233e-1;
    p = p * r + 6.9314718055994530942e-1;
    return p * r + 1.0;
#else
    realv p = 0.00015353362f;
    p = p * r + 0.00133988739f;
    p = p * r + 0.00961843692f;
    p = p * r + 0.0555033237f;
    p = p * r + 0.240226477f;
    p = p * r + 0.693147182f;
    return p * r + 1.0f;
#endif
}

inline realv exp2_lanes(realv x) {
    realv clamped = clamp(x, (realv)EXP2_LOWEST, (realv)EXP2_HIGHEST);
    realv shifted = clamped + (realv)EXP2_ROUNDER;
    integerv n = AS_INTEGERV(shifted) - AS_INTEGERV((realv)EXP2_ROUNDER);
    realv p = exp2_polynomial(clamped - (shifted - (realv)EXP2_ROUNDER));
    return AS_REALV(AS_INTEGERV(p) + (n << EXP2_MANTISSA_BITS));
}
