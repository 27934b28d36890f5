// Scaled complementary error function exp(x²) erfc(x) for vectors.
//
// (1 + 2x) erfcx(x) is a polynomial of t = (x − 3)/(x + 3), which brings [0, ∞) to [−1, 1).
//
//   error    double 5e-16, single 3e-7 relative (tests/kernels/test_library.py, mpmath)
//   domain   x ≥ 0
//   source   the form of Shepherd and Laframboise, Math. Comp. 36 (1981) 249, doi:10.1090/S0025-5718-1981-0595058-X;
//            coefficients by Chebyshev interpolation in 50 digits

inline realv erfcx_lanes(realv x) {
    const realv t = (x - (realv)3.0) / (x + (realv)3.0);
#ifdef REAL_IS_DOUBLE
    realv p = (realv)9.948881387345376e-10;
    p = p * t - 3.1695861117061016e-09;
    p = p * t - 1.3361983754343433e-08;
    p = p * t + 2.777903173485627e-08;
    p = p * t + 1.0195723965959923e-07;
    p = p * t - 1.2038707460075746e-07;
    p = p * t - 6.167710295061843e-07;
    p = p * t + 3.3649026104197536e-07;
    p = p * t + 3.4725203402294704e-06;
    p = p * t - 7.186148806224438e-07;
    p = p * t - 2.010062769322536e-05;
    p = p * t + 4.944031186617429e-06;
    p = p * t + 0.00012509937436795942;
    p = p * t - 0.00010515828084604045;
    p = p * t - 0.0007798322772759169;
    p = p * t + 0.0018886900908316603;
    p = p * t + 0.0025293918167998445;
    p = p * t - 0.023770514890662092;
    p = p * t + 0.06830802734392143;
    p = p * t - 0.11927366341681596;
    p = p * t + 0.12964515870276264;
    p = p * t - 0.04756229435341897;
    p = p * t - 0.1356211061245812;
    p = p * t + 1.2530080582697296;
#else
    realv p = (realv)-9.35106291e-05f;
    p = p * t - 0.000513159437f;
    p = p * t + 0.00187749462f;
    p = p * t + 0.00228495221f;
    p = p * t - 0.0237656925f;
    p = p * t + 0.0684107617f;
    p = p * t - 0.119274519f;
    p = p * t + 0.129627168f;
    p = p * t - 0.0475622527f;
    p = p * t - 0.135620207f;
    p = p * t + 1.25300801f;
#endif
    return p / ((realv)1.0 + (x + x));
}
