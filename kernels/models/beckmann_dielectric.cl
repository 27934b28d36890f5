// Written by 'make kernels' from clbrdf/models/library/beckmann_dielectric.py.
// beckmann_dielectric: Beckmann facets of a dielectric
// source: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293

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
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = (real)1.0 / (m.alpha * m.alpha);
    m.n = p[P_n];
    m.s3 = m.n * m.n - (real)1.0;
    m.s4 = -(m.s1 * (real)1.4426950408889634);
    m.s5 = (real)1.0 / m.alpha;
    m.s6 = m.s1 * (real)0.5 * m.s3 * m.s3;
    m.s7 = m.scale * m.s6;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    const realv t1 = x.cot_i / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * t3) - erfcx_lanes(t2));
    m->s2 = (real)1.0 + t4;
    m->s8 = x.cot_i * m->s5;
    m->s9 = (m->s8 < (real)9.0 ? (realv)m->s8 : (realv)(real)9.0);
    m->s10 = exp_lanes(-(m->s9 * m->s9));
    m->s11 = (real)0.5 * m->s10;
    m->s12 = (real)1.0 / (m->s9 * t3);
    const realv t5 = erfcx_lanes(m->s9);
    m->s13 = m->s12 - t5;
    m->s14 = (real)1.0 + m->s11 * m->s13;
    m->s15 = (real)2.0 * m->s9 * t5 - (real)1.1283791670955126;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = sqrt_lanes(m->s3 + x.cos2_d) + x.cos_d;
    const realv t2 = x.cos_d * t1 - (real)1.0;
    const realv t3 = m->s5 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = m->s2 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    const realv t8 = m->s3 * x.cos_d + t1;
    const realv t9 = t8 * t8;
    const realv t10 = t1 * t1;
    const realv t11 = x.front * exp2_falling(m->s4 * x.tan2_h) * t4 * t5 * (t9 + t10 * t2 * t2);
    return m->s7 * t11 / (t10 * t10 * t7 * t9);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = sqrt_lanes(m->s3 + x.cos2_d) + x.cos_d;
    const realv t2 = x.cos_d * t1 - (real)1.0;
    const realv t3 = m->s5 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = m->s3 * x.cos_d + t1;
    const realv t8 = t7 * t7;
    const realv t9 = t1 * t1;
    const realv t10 = x.front * exp2_falling(m->s4 * x.tan2_h) * t4 * t5 * (t8 + t9 * t2 * t2);
    const realv t11 = m->s14 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    term[0] = m->s6 * t10 / (t9 * t9 * t11 * t8);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 * x.front;
    const realv t2 = exp_lanes(-(x.tan2_h * m->s1));
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = sqrt_lanes(m->s3 + x.cos2_d);
    const realv t5 = t4 + x.cos_d;
    const realv t6 = (real)1.0 / t5;
    const realv t7 = x.cot_r * m->s5;
    const realv t8 = (t7 < (real)9.0 ? (realv)t7 : (realv)(real)9.0);
    const realv t9 = exp_lanes(-(t8 * t8));
    const realv t10 = (real)0.5 * t9;
    const realv t11 = (real)1.0 / (t8 * t3);
    const realv t12 = erfcx_lanes(t8);
    const realv t13 = t11 - t12;
    const realv t14 = (real)1.0 / (m->s14 + t10 * t13);
    const realv t15 = t1 * t2 * t14;
    const realv t16 = m->s3 * t6;
    const realv t17 = t16 * t6;
    const realv t18 = (real)0.5 * t17 * t17;
    const realv t19 = (real)1.0 / (x.cos_d * t16 + (real)1.0);
    const realv t20 = (x.cos_d * t5 - (real)1.0) * t19;
    const realv t21 = (real)1.0 + t20 * t20;
    const realv t22 = t18 * t21;
    const realv t23 = m->scale * t15;
    const realv t24 = t23 * t18 * t20;
    const realv t25 = (t24 + t24) * t19;
    const realv t26 = t23 * t21 * (real)0.5 * t17;
    const realv t27 = (t26 + t26) * t6;
    const realv t28 = (-(t25 * t20 * x.cos_d) + t27) * t6;
    const realv t29 = (t28 + (t25 * x.cos_d - t27 * t17 - t28 * t16) * (real)0.5 / t4) * m->n;
    const realv t30 = m->scale * t22 * t14;
    const realv t31 = t30 * t15;
    const realv t32 = t31 * t10;
    const realv t33 = t32 * ((real)2.0 * t8 * t12 - (real)1.1283791670955126) + t32 * t11 * t11 * t3;
    const realv t34 = t31 * t13 * (real)0.5 * t9 * t8;
    const realv t35 = (t7 < (real)9.0 ? (realv)(t33 + t34 + t34) : (realv)(real)0.0) * m->s5 * t7;
    const realv t36 = t31 * m->s11;
    const realv t37 = t31 * m->s13 * (real)0.5 * m->s10 * m->s9;
    const realv t38 = (m->s8 < (real)9.0 ? (realv)(t36 * m->s15 + t36 * m->s12 * m->s12 * t3 + t37 + t37) : (realv)(real)0.0);
    const realv t39 = (-(t30 * t1 * t2 * x.tan2_h) + t30 * t2 * x.front) * m->s1 * m->s1 * m->alpha;
    tangent[0] = -t35 - t38 * m->s5 * m->s8 - t39 - t39;
    tangent[1] = t29 + t29;
    tangent[2] = t15 * t17 * t17 * t21;
    return m->scale * t15 * t22;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)0.5;
}
