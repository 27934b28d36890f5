// Scaled complementary error function exp(x²) erfc(x) for vectors.
//
// (1 + 2x) erfcx(x) is a polynomial of t = (x − 3)/(x + 3), which brings [0, ∞) to [−1, 1); even and odd powers
// apart for shorter chains.
//
//   error    double 8e-16, single 6e-7 relative (tests/kernels/test_library.py, mpmath)
//   domain   x ≥ 0
//   source   the form of Shepherd and Laframboise, Math. Comp. 36 (1981) 249, doi:10.1090/S0025-5718-1981-0595058-X;
//            coefficients by Chebyshev interpolation in 50 digits

// (1 + 2x) erfcx(x), for those that divide later.
inline realv erfcx_raised(realv x) {
    const realv t = (x - (realv)3.0) / (x + (realv)3.0), q = t * t;
#ifdef REAL_IS_DOUBLE
    realv even = (realv)-3.1695861117061016e-09;
    even = even * q + 2.777903173485627e-08;
    even = even * q - 1.2038707460075746e-07;
    even = even * q + 3.3649026104197536e-07;
    even = even * q - 7.186148806224438e-07;
    even = even * q + 4.944031186617429e-06;
    even = even * q - 0.00010515828084604045;
    even = even * q + 0.0018886900908316603;
    even = even * q - 0.023770514890662092;
    even = even * q - 0.11927366341681596;
    even = even * q - 0.04756229435341897;
    even = even * q + 1.2530080582697296;
    realv odd = (realv)9.948881387345376e-10;
    odd = odd * q - 1.3361983754343433e-08;
    odd = odd * q + 1.0195723965959923e-07;
    odd = odd * q - 6.167710295061843e-07;
    odd = odd * q + 3.4725203402294704e-06;
    odd = odd * q - 2.010062769322536e-05;
    odd = odd * q + 0.00012509937436795942;
    odd = odd * q - 0.0007798322772759169;
    odd = odd * q + 0.0025293918167998445;
    odd = odd * q + 0.06830802734392143;
    odd = odd * q + 0.12964515870276264;
    odd = odd * q - 0.1356211061245812;
#else
    realv even = (realv)-9.35106291e-05f;
    even = even * q + 0.00187749462f;
    even = even * q - 0.0237656925f;
    even = even * q - 0.119274519f;
    even = even * q - 0.0475622527f;
    even = even * q + 1.25300801f;
    realv odd = (realv)-0.000513159437f;
    odd = odd * q + 0.00228495221f;
    odd = odd * q + 0.0684107617f;
    odd = odd * q + 0.129627168f;
    odd = odd * q - 0.135620207f;
#endif
    return odd * t + even;
}

inline realv erfcx_lanes(realv x) { return erfcx_raised(x) / ((realv)1.0 + (x + x)); }
