// Written by 'make kernels' from clbrdf/models/library/ggx_anisotropic.py.
// ggx_anisotropic: GGX facets, anisotropic, Schlick's Fresnel reflectance
// source: Heitz, J. Comput. Graph. Tech. 3(2) (2014) 48

typedef struct {
    realv alpha_x;
    realv alpha_y;
    realv s1;
    realv s2;
    realv s3;
    realv s4;
    realv F0;
    realv F90;
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
    m.alpha_x = p[P_alpha_x];
    m.alpha_y = p[P_alpha_y];
    m.s1 = m.alpha_x * m.alpha_y;
    m.s2 = m.alpha_x * m.alpha_x;
    m.s3 = m.alpha_y * m.alpha_y;
    m.F0 = p[P_F0];
    m.F90 = p[P_F90];
    m.s5 = (real)1.0 / m.s2;
    m.s6 = (real)1.0 / m.s3;
    m.s7 = (real)1.0 / m.s1;
    m.s8 = m.s7 * m.F0;
    m.s9 = m.s7 * m.F90;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s4 = sqrt_lanes((real)1.0 + m->s2 * x.tan2_x_i + m->s3 * x.tan2_y_i);
    m->s10 = (real)1.0 / m->s4;
}

// f = what is returned / under; neighbouring directions share a division.
#define MODEL_DIVIDES
inline realv model_fraction(const model_state *m, const geometry x, realv *under) {
    const realv t1 = m->s4 + sqrt_lanes((real)1.0 + m->s2 * x.tan2_x_r + m->s3 * x.tan2_y_r);
    const realv t2 = (real)1.0 + m->s5 * x.along2 + m->s6 * x.across2;
    *under = t1 * t2 * t2;
    return x.front * (m->s8 * x.less_schlick + m->s9 * x.schlick);
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
    const realv t1 = m->s4 + sqrt_lanes((real)1.0 + m->s2 * x.tan2_x_r + m->s3 * x.tan2_y_r);
    const realv t2 = (real)1.0 + m->s5 * x.along2 + m->s6 * x.across2;
    const realv t3 = x.front / (t1 * t2 * t2);
    term[0] = m->s7 * x.less_schlick * t3;
    term[1] = m->s7 * x.schlick * t3;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = sqrt_lanes((real)1.0 + m->s2 * x.tan2_x_r + m->s3 * x.tan2_y_r);
    const realv t2 = m->s4 + t1;
    const realv t3 = m->F0 * x.less_schlick + m->F90 * x.schlick;
    const realv t4 = x.along2 * m->s5;
    const realv t5 = x.across2 * m->s6;
    const realv t6 = (real)1.0 + t4 + t5;
    const realv t7 = t6 * t6;
    const realv t8 = m->s1 * t7;
    const realv t9 = (real)1.0 / (t8 * t2);
    const realv t10 = x.front * t9;
    const realv t11 = t3 * t9 * t10;
    const realv t12 = t11 * t2;
    const realv t13 = t11 * t8 * (real)0.5;
    const realv t14 = t13 / t1;
    const realv t15 = t13 * m->s10;
    const realv t16 = t12 * t7;
    const realv t17 = t12 * m->s1 * t6;
    const realv t18 = -t17 - t17;
    const realv t19 = (-(t14 * x.tan2_y_r) - t15 * x.tan2_y_i - t18 * m->s6 * t5) * m->alpha_y;
    const realv t20 = (-(t14 * x.tan2_x_r) - t15 * x.tan2_x_i - t18 * m->s5 * t4) * m->alpha_x;
    tangent[0] = t20 + t20 - t16 * m->alpha_y;
    tangent[1] = t19 + t19 - t16 * m->alpha_x;
    tangent[2] = t10 * x.less_schlick;
    tangent[3] = t10 * x.schlick;
    return t10 * t3;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = (realv)(real)1.0;
}
