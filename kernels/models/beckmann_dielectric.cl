// Written by 'make kernels' from clbrdf/models/library/beckmann_dielectric.py.
// beckmann_dielectric: Beckmann facets of a dielectric
// source: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293

typedef struct {
    realv scale;
    realv alpha;
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
    realv n;
    realv s11;
    realv s12;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
    m.s2 = (real)1.0 / m.s1;
    m.n = p[P_n];
    m.s11 = m.n * m.n - (real)1.0;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s3 = x.cot_i / m->alpha;
    m->s4 = (m->s3 < (real)9.0 ? (realv)m->s3 : (realv)(real)9.0);
    m->s5 = exp_lanes(-(m->s4 * m->s4));
    m->s6 = (real)0.5 * m->s5;
    m->s7 = m->s4 * sqrt((real)3.141592653589793);
    m->s8 = (real)1.0 / m->s7;
    const realv t1 = erfcx_lanes(m->s4);
    m->s9 = m->s8 - t1;
    m->s10 = (real)1.0 + m->s6 * m->s9;
    m->s12 = (real)2.0 * m->s4 * t1 - (real)1.1283791670955126;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = x.cot_r / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * sqrt((real)3.141592653589793)) - erfcx_lanes(t2));
    const realv t4 = sqrt(m->s11 + x.cos2_d) + x.cos_d;
    const realv t5 = m->s11 / t4;
    const realv t6 = t5 / t4;
    const realv t7 = (x.cos_d * t4 - (real)1.0) / (x.cos_d * t5 + (real)1.0);
    const realv t8 = m->s2 * x.front * exp_lanes(-(x.tan2_h * m->s2)) / (m->s10 + t3) * (real)0.5 * t6 * t6 * ((real)1.0 + t7 * t7);
    return m->scale * t8;
}

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = x.cot_r / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * sqrt((real)3.141592653589793)) - erfcx_lanes(t2));
    const realv t4 = sqrt(m->s11 + x.cos2_d) + x.cos_d;
    const realv t5 = m->s11 / t4;
    const realv t6 = t5 / t4;
    const realv t7 = (x.cos_d * t4 - (real)1.0) / (x.cos_d * t5 + (real)1.0);
    const realv t8 = m->s2 * x.front * exp_lanes(-(x.tan2_h * m->s2)) / (m->s10 + t3) * (real)0.5 * t6 * t6 * ((real)1.0 + t7 * t7);
    term[0] = t8;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s2 * x.front;
    const realv t2 = exp_lanes(-(x.tan2_h * m->s2));
    const realv t3 = sqrt((real)3.141592653589793);
    const realv t4 = x.cot_r / m->alpha;
    const realv t5 = (t4 < (real)9.0 ? (realv)t4 : (realv)(real)9.0);
    const realv t6 = exp_lanes(-(t5 * t5));
    const realv t7 = (real)0.5 * t6;
    const realv t8 = t5 * t3;
    const realv t9 = (real)1.0 / t8;
    const realv t10 = erfcx_lanes(t5);
    const realv t11 = t9 - t10;
    const realv t12 = m->s10 + t7 * t11;
    const realv t13 = t1 * t2 / t12;
    const realv t14 = sqrt(m->s11 + x.cos2_d);
    const realv t15 = t14 + x.cos_d;
    const realv t16 = m->s11 / t15;
    const realv t17 = t16 / t15;
    const realv t18 = (real)0.5 * t17 * t17;
    const realv t19 = x.cos_d * t16 + (real)1.0;
    const realv t20 = (x.cos_d * t15 - (real)1.0) / t19;
    const realv t21 = (real)1.0 + t20 * t20;
    const realv t22 = t18 * t21;
    const realv t23 = m->scale * t13;
    const realv t24 = t23 * t18 * t20;
    const realv t25 = (t24 + t24) / t19;
    const realv t26 = t23 * t21 * (real)0.5 * t17;
    const realv t27 = (t26 + t26) / t15;
    const realv t28 = (-(t25 * t20 * x.cos_d) + t27) / t15;
    const realv t29 = (t28 + (t25 * x.cos_d - t27 * t17 - t28 * t16) * (real)0.5 / t14) * m->n;
    const realv t30 = m->scale * t22 / t12;
    const realv t31 = t30 * t13;
    const realv t32 = t31 * t7;
    const realv t33 = t32 * ((real)2.0 * t5 * t10 - (real)1.1283791670955126) + t32 / t8 * t9 * t3;
    const realv t34 = t31 * t11 * (real)0.5 * t6 * t5;
    const realv t35 = (t4 < (real)9.0 ? (realv)(t33 + t34 + t34) : (realv)(real)0.0) / m->alpha;
    const realv t36 = t31 * m->s6;
    const realv t37 = t31 * m->s9 * (real)0.5 * m->s5 * m->s4;
    const realv t38 = (m->s3 < (real)9.0 ? (realv)(t36 * m->s12 + t36 / m->s7 * m->s8 * t3 + t37 + t37) : (realv)(real)0.0);
    const realv t39 = (-(t30 * t1 * t2 * x.tan2_h) + t30 * t2 * x.front) / m->s1 * m->s2 * m->alpha;
    tangent[0] = -(t35 * t4) - t38 / m->alpha * m->s3 - t39 - t39;
    tangent[1] = t29 + t29;
    tangent[2] = t13 * t17 * t17 * t21;
    return m->scale * t13 * t22;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)0.5;
}
