// Written by 'make kernels' from clbrdf/models/library/ggx.py.
// ggx: GGX facets, Schlick's Fresnel reflectance
// source: Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206

typedef struct {
    realv alpha;
    realv s1;
    realv s2;
    realv F0;
    realv F90;
    realv s3;
    realv s4;
    realv s5;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
    m.F0 = p[P_F0];
    m.F90 = p[P_F90];
    m.s3 = m.s1 * m.F0;
    m.s4 = m.s1 * m.F90;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s2 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_i);
    m->s5 = (real)1.0 / m->s2;
}

// f = what is returned / under; neighbouring directions share a division.
#define MODEL_DIVIDES
inline realv model_fraction(const model_state *m, const geometry x, realv *under) {
    const realv t1 = m->s1 + x.tan2_h;
    *under = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r));
    return x.front * (m->s3 * x.less_schlick + m->s4 * x.schlick);
}

inline realv model_brdf(const model_state *m, const geometry x) {
    realv under;
    const realv over = model_fraction(m, x, &under);
    return over / under;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = x.front / (t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)));
    term[0] = m->s1 * x.less_schlick * t2;
    term[1] = m->s1 * x.schlick * t2;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = t1 * t1;
    const realv t3 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_r);
    const realv t4 = m->s2 + t3;
    const realv t5 = m->F0 * x.less_schlick + m->F90 * x.schlick;
    const realv t6 = (real)1.0 / (t2 * t4);
    const realv t7 = m->s1 * x.front * t6;
    const realv t8 = t5 * t6;
    const realv t9 = t8 * t7;
    const realv t10 = t9 * t2 * (real)0.5;
    const realv t11 = t9 * t4 * t1;
    const realv t12 = -(t10 / t3 * x.tan2_r) - t10 * m->s5 * x.tan2_i + -t11 - t11 + t8 * x.front;
    const realv t13 = t12 * m->alpha;
    tangent[0] = t13 + t13;
    tangent[1] = t7 * x.less_schlick;
    tangent[2] = t7 * x.schlick;
    return t7 * t5;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
}
