// Written by 'make kernels' from clbrdf/models/library/kcorr.py.
// kcorr: K-correlation scatter
// source: Dittman, Proc. SPIE 6291 (2006) 62910R, doi:10.1117/12.678320

typedef struct {
    realv b0;
    realv s1;
    realv l;
    realv s2;
    realv s3;
    realv s4;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.b0 = p[P_b0];
    m.s1 = (real)(-0.5) * p[P_C];
    m.l = p[P_l];
    m.s2 = m.b0 * (real)(-0.5);
    m.s3 = (real)1.0 / (m.l * m.l);
    m.s4 = m.s1 * (real)1.4426950408889634;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->b0 * exp2_lanes(m->s4 * log1p_lanes(m->s3 * x.x2));
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 2

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = m->b0 * exp2_lanes(m->s4 * log1p_lanes(m->s3 * x.x2));
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = x.x2 * m->s3;
    const realv t2 = log1p_lanes(t1);
    const realv t3 = exp_lanes(m->s1 * t2);
    const realv t4 = m->b0 * t3;
    const realv t5 = t4 * m->s1 / ((real)1.0 + t1) * m->s3 * t1 * m->l;
    tangent[0] = t3;
    tangent[1] = -t5 - t5;
    tangent[2] = t2 * t3;
    return t4;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = m->s2;
}
