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
    realv s15;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.rho = p[P_rho];
    m.r = p[P_r];
    const realv t1 = (real)1.0 + ((real)0.5 - (real)2.0 / ((real)3.0 * (real)3.141592653589793)) * m.r;
    m.s1 = (real)1.0 / t1;
    const realv t2 = m.rho / (real)3.141592653589793 * m.s1;
    m.s2 = (real)1.0 - m.r;
    m.s3 = m.rho * m.rho;
    const realv t3 = (real)0.6666666666666666 - (real)28.0 / ((real)15.0 * (real)3.141592653589793);
    m.s4 = (real)1.0 + t3 * m.r;
    m.s5 = m.s1 * m.s4;
    const realv t4 = m.s3 * m.s5;
    m.s6 = (real)1.0 - m.s5;
    const realv t5 = (real)1.0 - m.rho * m.s6;
    m.s7 = t4 / t5 * m.s1 * m.r;
    m.s8 = t2 * m.s2;
    m.s9 = t2 * m.r;
    m.s10 = m.rho * (real)1.0 / (real)3.141592653589793;
    m.s11 = m.s10 * m.s1;
    m.s12 = (real)1.0 / t5;
    m.s13 = t4 * m.s12;
    m.s14 = m.s13 * m.s1;
    m.s15 = m.s14 * m.r;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s8 + m->s9 * x.single + m->s7 * x.multiple;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 2
constant int tangent_of[P] = {0, 1};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s2 + m->r * x.single;
    const realv t2 = (real)0.6666666666666666 - (real)28.0 / ((real)15.0 * (real)3.141592653589793);
    const realv t3 = x.multiple * m->r;
    const realv t4 = t3 * m->s1 * m->s12;
    const realv t5 = t4 * m->s13;
    const realv t6 = -(t5 * m->rho) + t4 * m->s3;
    const realv t7 = t4 * m->s5 * m->rho;
    const realv t8 = (t3 * m->s13 + t6 * m->s4 + t1 * m->s10) * m->s1 * m->s1 * ((real)0.5 - (real)2.0 / ((real)3.0 * (real)3.141592653589793));
    const realv t9 = x.multiple * m->s14 + t6 * m->s1 * t2 + m->s11 * x.single - m->s11 - t8;
    const realv t10 = t5 * m->s6 + t7 + t7 + t1 * m->s1 * (real)1.0 / (real)3.141592653589793;
    tangent[0] = t10;
    tangent[1] = t9;
    return m->s11 * t1 + m->s15 * x.multiple;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
}
