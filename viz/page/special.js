// Functions that models use and the language lacks.

// Logarithm of 0 is about -7e5, whose exponential is 0: no 0 times infinity can arise.
const LOG_OF_ZERO = -1e6 * Math.LN2;

function ln(x) {
  return x > 0 ? Math.log(x) : LOG_OF_ZERO;
}

// Scaled complementary error function exp(x^2) erfc(x), x >= 0: (1 + 2x) erfcx(x) as a polynomial of
// t = (x - 3)/(x + 3), after Shepherd and Laframboise, Math. Comp. 36 (1981) 249.
const ERFCX = [
  9.948881387345376e-10, -3.1695861117061016e-9, -1.3361983754343433e-8, 2.777903173485627e-8,
  1.0195723965959923e-7, -1.2038707460075746e-7, -6.167710295061843e-7, 3.3649026104197536e-7,
  3.4725203402294704e-6, -7.186148806224438e-7, -2.010062769322536e-5, 4.944031186617429e-6,
  0.00012509937436795942, -0.00010515828084604045, -0.0007798322772759169, 0.0018886900908316603,
  0.0025293918167998445, -0.023770514890662092, 0.06830802734392143, -0.11927366341681596,
  0.12964515870276264, -0.04756229435341897, -0.1356211061245812, 1.2530080582697296,
];

function erfcx(x) {
  const t = (x - 3) / (x + 3);
  let sum = 0;
  for (const c of ERFCX) sum = sum * t + c;
  return sum / (1 + 2 * x);
}
