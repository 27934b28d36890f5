// 2^x for vectors, faster than the built-in where that is not inlined.
//
// n = round(x) by adding 1.5·2^(mantissa bits), which leaves n in the low bits; 2^r for r = x − n in
// [−1/2, 1/2] by a polynomial of EXP2_DEGREE, even and odd powers apart for shorter chains; n is shifted
// into the exponent field, and the constant of the rounding out of it. Never build with
// -cl-fast-relaxed-math: it deletes the rounding. Limits are set by comparison: max() and clamp() of PoCL
// are calls, and each call spills every vector register.
//
//   error    relative, by degree (measured by tests/kernels/test_library.py):
//            single 3: 1.1e-4, 4: 3.1e-6, 5: 2.2e-7, 6: 1.6e-7;  double 8: 3.8e-15
//   domain   all finite x. Above 128 (1024) the result is +∞; below −127 (−1023) it is 0; in the last
//            octave of normal numbers, [−127, −126) ([−1023, −1022)), it lies between 0 and the
//            smallest normal number.
//   source   minimax of the relative error by Lawson's iteration, 2^0 = 1 exactly; for double of 2^(r/2), in 40
//            digits, whose square is taken. Muller, Elementary Functions (3rd ed., 2016), chapters 3 and 11.

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
#if EXP2_DEGREE == 3
    const realv q = r * r;
    realv even = 0.242210954f;
    even = even * q + 1.0f;
    realv odd = 0.0550089329f;
    odd = odd * q + 0.693282902f;
    return odd * r + even;
#elif EXP2_DEGREE == 4
    const realv q = r * r;
    realv even = 0.00958285294f;
    even = even * q + 0.240240991f;
    even = even * q + 1.0f;
    realv odd = 0.0559064262f;
    odd = odd * q + 0.693124175f;
    return odd * r + even;
#elif EXP2_DEGREE == 5
    const realv q = r * r;
    realv even = 0.00967151299f;
    even = even * q + 0.240222424f;
    even = even * q + 1.0f;
    realv odd = 0.00132647273f;
    odd = odd * q + 0.0555073358f;
    odd = odd * q + 0.693147004f;
    return odd * r + even;
#elif EXP2_DEGREE == 6
    const realv q = r * r;
    realv even = 0.00015353362f;
    even = even * q + 0.00961843692f;
    even = even * q + 0.240226477f;
    even = even * q + 1.0f;
    realv odd = 0.00133988739f;
    odd = odd * q + 0.0555033237f;
    odd = odd * q + 0.693147182f;
    return odd * r + even;
#elif EXP2_DEGREE == 8
    // The square of 2^(r/2): two powers of the polynomial less, for one multiplication.
    const realv q = r * r;
    realv even = 5.158916159494399e-09;
    even = even * q + 2.406804427798536e-06;
    even = even * q + 0.0006011330687551969;
    even = even * q + 0.06005662673979654;
    even = even * q + 1.0;
    realv odd = 1.192730562608176e-07;
    odd = odd * q + 4.166734860293005e-05;
    odd = odd * q + 0.006938013584506907;
    odd = odd * q + 0.34657359027994744;
    const realv root = odd * r + even;
    return root * root;
#endif
}

// 2^x for x that cannot exceed EXP2_HIGHEST.
inline realv exp2_falling(realv x) {
    const realv bounded = x > (realv)EXP2_LOWEST ? x : (realv)EXP2_LOWEST;
    const realv shifted = bounded + (realv)EXP2_ROUNDER;
    const realv p = exp2_polynomial(bounded - (shifted - (realv)EXP2_ROUNDER));
    return AS_REALV(AS_INTEGERV(p) + (AS_INTEGERV(shifted) << EXP2_MANTISSA_BITS));
}

inline realv exp2_lanes(realv x) {
    return exp2_falling(x < (realv)EXP2_HIGHEST ? x : (realv)EXP2_HIGHEST);
}

// e^x, with the error of exp2_lanes and |x| ulp of the product.
inline realv exp_lanes(realv x) {
    return exp2_lanes(x * (real)1.4426950408889634);
}
