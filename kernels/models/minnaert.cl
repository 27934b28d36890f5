// Written by 'make kernels' from clbrdf/models/library/minnaert.py.
// minnaert: Minnaert's law
// source: Minnaert, Astrophys. J. 93 (1941) 403, doi:10.1086/144279

typedef struct {
    realv rho;
    realv s1;
    realv s2;
    realv s3;
    realv s4;
    realv s5;
    realv s6;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.rho = p[P_rho];
    const realv t1 = p[P_k] + (real)1.0;
    m.s1 = m.rho * t1;
    m.s2 = p[P_k] - (real)1.0;
    const realv t2 = (real)2.0 * (real)3.141592653589793;
    const realv t3 = (real)1.0 / t2;
    m.s3 = t3 * m.s1;
    m.s4 = t3 * t1;
    m.s5 = m.s2 * (real)1.4426950408889634;
    m.s6 = m.s1 / t2;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s6 * exp2_lanes(m->s5 * x.log_cosines);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = m->s4 * exp2_lanes(m->s5 * x.log_cosines);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 2
constant int tangent_of[P] = {0, 1};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = exp_lanes(m->s2 * x.log_cosines);
    const realv t2 = (real)1.0 / ((real)2.0 * (real)3.141592653589793);
    tangent[0] = t1;
    tangent[1] = m->s3 * t1 * x.log_cosines + t2 * t1 * m->rho;
    return m->s1 * t1 * t2;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = m->s4;
    factor[1] = (realv)(real)1.0;
}
