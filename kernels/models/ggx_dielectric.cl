// Written by 'make kernels' from clbrdf/models/library/ggx_dielectric.py.
// ggx_dielectric: GGX facets of a dielectric
// source: Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206

typedef struct {
    realv scale;
    realv alpha;
    realv s1;
    realv s2;
    realv n;
    realv s3;
    realv s4;
    realv s5;
    realv s6;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
    m.n = p[P_n];
    m.s3 = m.n * m.n - (real)1.0;
    m.s4 = m.s1 * (real)0.5 * m.s3 * m.s3;
    m.s5 = m.scale * m.s4;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s2 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_i);
    m->s6 = (real)1.0 / m->s2;
}

// f = what is returned / under; neighbouring directions share a division.
#define MODEL_DIVIDES
inline realv model_fraction(const model_state *m, const geometry x, realv *under) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = sqrt_lanes(m->s3 + x.cos2_d) + x.cos_d;
    const realv t3 = x.cos_d * t2 - (real)1.0;
    const realv t4 = m->s3 * x.cos_d + t2;
    const realv t5 = t4 * t4;
    const realv t6 = t2 * t2;
    const realv t7 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * t6 * t6 * t5;
    *under = t7;
    return m->s5 * x.front * (t5 + t6 * t3 * t3);
}

inline realv model_brdf(const model_state *m, const geometry x) {
    realv under;
    const realv over = model_fraction(m, x, &under);
    return over / under;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 2

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = sqrt_lanes(m->s3 + x.cos2_d) + x.cos_d;
    const realv t3 = x.cos_d * t2 - (real)1.0;
    const realv t4 = m->s3 * x.cos_d + t2;
    const realv t5 = t4 * t4;
    const realv t6 = t2 * t2;
    const realv t7 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * t6 * t6 * t5;
    term[0] = m->s4 * x.front * (t5 + t6 * t3 * t3) / t7;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = t1 * t1;
    const realv t3 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_r);
    const realv t4 = m->s2 + t3;
    const realv t5 = sqrt_lanes(m->s3 + x.cos2_d);
    const realv t6 = t5 + x.cos_d;
    const realv t7 = (real)1.0 / t6;
    const realv t8 = (real)1.0 / (t2 * t4);
    const realv t9 = m->s1 * x.front * t8;
    const realv t10 = m->s3 * t7;
    const realv t11 = t10 * t7;
    const realv t12 = (real)0.5 * t11 * t11;
    const realv t13 = (real)1.0 / (x.cos_d * t10 + (real)1.0);
    const realv t14 = (x.cos_d * t6 - (real)1.0) * t13;
    const realv t15 = (real)1.0 + t14 * t14;
    const realv t16 = t12 * t15;
    const realv t17 = m->scale * t9;
    const realv t18 = t17 * t12 * t14;
    const realv t19 = (t18 + t18) * t13;
    const realv t20 = t17 * t15 * (real)0.5 * t11;
    const realv t21 = (t20 + t20) * t7;
    const realv t22 = (-(t19 * t14 * x.cos_d) + t21) * t7;
    const realv t23 = (t22 + (t19 * x.cos_d - t21 * t11 - t22 * t10) * (real)0.5 / t5) * m->n;
    const realv t24 = m->scale * t16 * t8;
    const realv t25 = t24 * t9;
    const realv t26 = t25 * t2 * (real)0.5;
    const realv t27 = t25 * t4 * t1;
    const realv t28 = -(t26 / t3 * x.tan2_r) - t26 * m->s6 * x.tan2_i + -t27 - t27 + t24 * x.front;
    const realv t29 = t28 * m->alpha;
    tangent[0] = t29 + t29;
    tangent[1] = t23 + t23;
    tangent[2] = t9 * t11 * t11 * t15;
    return m->scale * t9 * t16;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)0.5;
}
