// Written by 'make kernels' from clbrdf/models/library/eon.py.
// eon: EON, energy-preserving Oren–Nayar
// source: Portsmouth, Kutz and Hill, EON (2024), arXiv:2410.18026

typedef struct {
    realv rho;
    realv r;
    realv s1;
    realv s2;
    realv s3;
    realv s4;
    realv s5;
    realv s6;
    realv s7;
    realv s8;
    realv s9;
    realv s10;
    realv s11;
    realv s12;
    realv s13;
    realv s14;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.rho = p[P_rho];
    m.r = p[P_r];
    const realv t1 = (real)1.0 + ((real)0.5 - (real)2.0 / ((real)3.0 * (real)3.141592653589793)) * m.r;
    m.s1 = (real)1.0 / t1;
    m.s2 = m.rho / (real)3.141592653589793 * m.s1;
    m.s3 = (real)1.0 - m.r;
    m.s4 = m.rho * m.rho;
    const realv t2 = (real)0.6666666666666666 - (real)28.0 / ((real)15.0 * (real)3.141592653589793);
    m.s5 = (real)1.0 + t2 * m.r;
    m.s6 = m.s1 * m.s5;
    const realv t3 = m.s4 * m.s6;
    m.s7 = (real)1.0 - m.s6;
    const realv t4 = (real)1.0 - m.rho * m.s7;
    m.s8 = t3 / t4 * m.s1 * m.r;
    m.s9 = m.rho * (real)1.0 / (real)3.141592653589793;
    m.s10 = m.s9 * m.s1;
    m.s11 = (real)1.0 / t4;
    m.s12 = t3 * m.s11;
    m.s13 = m.s12 * m.s1;
    m.s14 = m.s13 * m.r;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s2 * (m->s3 + m->r * x.single) + m->s8 * x.multiple;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 2
constant int tangent_of[P] = {0, 1};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s3 + m->r * x.single;
    const realv t2 = (real)0.6666666666666666 - (real)28.0 / ((real)15.0 * (real)3.141592653589793);
    const realv t3 = x.multiple * m->r;
    const realv t4 = t3 * m->s1 * m->s11;
    const realv t5 = t4 * m->s12;
    const realv t6 = -(t5 * m->rho) + t4 * m->s4;
    const realv t7 = t4 * m->s6 * m->rho;
    const realv t8 = (t3 * m->s12 + t6 * m->s5 + t1 * m->s9) * m->s1 * m->s1 * ((real)0.5 - (real)2.0 / ((real)3.0 * (real)3.141592653589793));
    const realv t9 = x.multiple * m->s13 + t6 * m->s1 * t2 + m->s10 * x.single - m->s10 - t8;
    const realv t10 = t5 * m->s7 + t7 + t7 + t1 * m->s1 * (real)1.0 / (real)3.141592653589793;
    tangent[0] = t10;
    tangent[1] = t9;
    return m->s10 * t1 + m->s14 * x.multiple;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
}
