// Written by 'make kernels' from clbrdf/models/library/oren_nayar.py.
// oren_nayar: Oren and Nayar 1994, qualitative
// source: Oren and Nayar, SIGGRAPH 1994, 239, doi:10.1145/192161.192213

typedef struct {
    realv s1;
    realv sigma;
    realv s2;
    realv s3;
    realv s4;
    realv s5;
    realv s6;
    realv s7;
    realv s8;
    realv s9;
    realv s10;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.s1 = p[P_rho] / (real)3.141592653589793;
    m.sigma = p[P_sigma];
    const realv t1 = m.sigma * m.sigma;
    const realv t2 = (real)0.5 * t1;
    const realv t3 = t1 + (real)0.33;
    const realv t4 = (real)1.0 - t2 / t3;
    const realv t5 = (real)0.45 * t1;
    const realv t6 = t1 + (real)0.09;
    const realv t7 = t5 / t6;
    const realv t8 = (real)1.0 / (real)3.141592653589793;
    m.s2 = m.s1 * t4;
    m.s3 = m.s1 * t7;
    m.s4 = t8 * t4;
    m.s5 = t8 * t7;
    const realv t9 = (real)1.0 / t3;
    const realv t10 = t2 * t9;
    m.s6 = (real)1.0 - t10;
    m.s7 = (real)1.0 / t6;
    m.s8 = t5 * m.s7;
    const realv t11 = m.s1 * t9;
    m.s9 = t11 * t10;
    m.s10 = t11 * (real)0.5;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s2 + m->s3 * x.backward;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = m->s4 + m->s5 * x.backward;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 2
constant int tangent_of[P] = {0, 1};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s6 + m->s8 * x.backward;
    const realv t2 = m->s1 * x.backward * m->s7;
    const realv t3 = (-(t2 * m->s8) + t2 * (real)0.45 + m->s9 - m->s10) * m->sigma;
    tangent[0] = t1;
    tangent[1] = t3 + t3;
    return m->s1 * t1;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (real)1.0 / (real)3.141592653589793;
    factor[1] = (realv)(real)1.0;
}
