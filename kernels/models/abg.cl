// Written by 'make kernels' from clbrdf/models/library/abg.py.
// abg: ABg scatter
// source: Harvey, PhD thesis, University of Arizona (1976)

typedef struct {
    realv b0;
    realv g;
    realv s1;
    realv s2;
    realv s3;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.b0 = p[P_b0];
    m.g = p[P_g];
    m.s1 = log_lanes(p[P_x_k]);
    m.s2 = (real)1.0 / p[P_x_k] * m.g;
    m.s3 = m.g * (real)1.4426950408889634;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->b0 / ((real)1.0 + exp2_lanes(m->s3 * (x.log_x - m->s1)));
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = m->b0 / ((real)1.0 + exp2_lanes(m->s3 * (x.log_x - m->s1)));
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = x.log_x - m->s1;
    const realv t2 = exp_lanes(m->g * t1);
    const realv t3 = (real)1.0 / ((real)1.0 + t2);
    const realv t4 = m->b0 * t3;
    tangent[0] = t3;
    tangent[1] = t2 * t4 * t3;
    tangent[2] = t1 * t2 * t4 * t3;
    return t4;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = m->s2;
    factor[2] = (realv)(real)(-1.0);
}
