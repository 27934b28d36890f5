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
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
    m.n = p[P_n];
    m.s3 = m.n * m.n - (real)1.0;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s2 = sqrt((real)1.0 + m->s1 * x.tan2_i);
    m->s4 = (real)1.0 / m->s2;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = m->s1 * x.front / (t1 * t1 * (m->s2 + sqrt((real)1.0 + m->s1 * x.tan2_r)));
    const realv t3 = sqrt(m->s3 + x.cos2_d) + x.cos_d;
    const realv t4 = (real)1.0 / t3;
    const realv t5 = m->s3 * t4;
    const realv t6 = t5 * t4;
    const realv t7 = (x.cos_d * t3 - (real)1.0) / (x.cos_d * t5 + (real)1.0);
    return m->scale * t2 * (real)0.5 * t6 * t6 * ((real)1.0 + t7 * t7);
}

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = m->s1 * x.front / (t1 * t1 * (m->s2 + sqrt((real)1.0 + m->s1 * x.tan2_r)));
    const realv t3 = sqrt(m->s3 + x.cos2_d) + x.cos_d;
    const realv t4 = (real)1.0 / t3;
    const realv t5 = m->s3 * t4;
    const realv t6 = t5 * t4;
    const realv t7 = (x.cos_d * t3 - (real)1.0) / (x.cos_d * t5 + (real)1.0);
    term[0] = t2 * (real)0.5 * t6 * t6 * ((real)1.0 + t7 * t7);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = t1 * t1;
    const realv t3 = sqrt((real)1.0 + m->s1 * x.tan2_r);
    const realv t4 = m->s2 + t3;
    const realv t5 = sqrt(m->s3 + x.cos2_d);
    const realv t6 = t5 + x.cos_d;
    const realv t7 = (real)1.0 / t6;
    const realv t8 = m->s3 * t7;
    const realv t9 = t8 * t7;
    const realv t10 = (real)0.5 * t9 * t9;
    const realv t11 = (real)1.0 / (t2 * t4);
    const realv t12 = m->s1 * x.front * t11;
    const realv t13 = (real)1.0 / (x.cos_d * t8 + (real)1.0);
    const realv t14 = (x.cos_d * t6 - (real)1.0) * t13;
    const realv t15 = (real)1.0 + t14 * t14;
    const realv t16 = t10 * t15;
    const realv t17 = m->scale * t12;
    const realv t18 = t17 * t10 * t14;
    const realv t19 = (t18 + t18) * t13;
    const realv t20 = t17 * t15 * (real)0.5 * t9;
    const realv t21 = (t20 + t20) * t7;
    const realv t22 = (-(t19 * t14 * x.cos_d) + t21) * t7;
    const realv t23 = (t22 + (t19 * x.cos_d - t21 * t9 - t22 * t8) * (real)0.5 / t5) * m->n;
    const realv t24 = m->scale * t16 * t11;
    const realv t25 = t24 * t12;
    const realv t26 = t25 * t2 * (real)0.5;
    const realv t27 = t25 * t4 * t1;
    const realv t28 = -(t26 / t3 * x.tan2_r) - t26 * m->s4 * x.tan2_i + -t27 - t27 + t24 * x.front;
    const realv t29 = t28 * m->alpha;
    tangent[0] = t29 + t29;
    tangent[1] = t23 + t23;
    tangent[2] = t12 * t9 * t9 * t15;
    return m->scale * t12 * t16;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)0.5;
}
