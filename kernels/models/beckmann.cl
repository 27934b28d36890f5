// Written by 'make kernels' from clbrdf/models/library/beckmann.py.
// beckmann: Beckmann facets, Schlick's Fresnel reflectance
// source: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293

typedef struct {
    realv alpha;
    realv s1;
    realv s2;
    realv F0;
    realv F90;
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
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.alpha = p[P_alpha];
    m.s1 = (real)1.0 / (m.alpha * m.alpha);
    m.F0 = p[P_F0];
    m.F90 = p[P_F90];
    m.s3 = -(m.s1 * (real)1.4426950408889634);
    m.s4 = (real)1.0 / m.alpha;
    m.s5 = m.s1 * m.F0;
    m.s6 = m.s1 * m.F90;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    const realv t1 = x.cot_i / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * t3) - erfcx_lanes(t2));
    m->s2 = (real)1.0 + t4;
    m->s7 = x.cot_i * m->s4;
    m->s8 = (m->s7 < (real)9.0 ? (realv)m->s7 : (realv)(real)9.0);
    m->s9 = exp_lanes(-(m->s8 * m->s8));
    m->s10 = (real)0.5 * m->s9;
    m->s11 = (real)1.0 / (m->s8 * t3);
    const realv t5 = erfcx_lanes(m->s8);
    m->s12 = m->s11 - t5;
    m->s13 = (real)1.0 + m->s10 * m->s12;
    m->s14 = (real)2.0 * m->s8 * t5 - (real)1.1283791670955126;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s4 * x.cot_r;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = (real)1.0 + t2 + t2;
    const realv t4 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t3 - t2 * erfcx_raised(t2);
    const realv t5 = m->s2 * t2 * t3 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t2 * t2) * t4;
    const realv t6 = x.front * exp2_falling(m->s3 * x.tan2_h) * t2 * t3 * (m->s5 * x.less_schlick + m->s6 * x.schlick);
    return t6 / t5;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s4 * x.cot_r;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = (real)1.0 + t2 + t2;
    const realv t4 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t3 - t2 * erfcx_raised(t2);
    const realv t5 = m->s13 * t2 * t3 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t2 * t2) * t4;
    const realv t6 = x.front * exp2_falling(m->s3 * x.tan2_h) * t2 * t3 / t5;
    term[0] = m->s1 * x.less_schlick * t6;
    term[1] = m->s1 * x.schlick * t6;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 * x.front;
    const realv t2 = exp_lanes(-(x.tan2_h * m->s1));
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = m->F0 * x.less_schlick + m->F90 * x.schlick;
    const realv t5 = x.cot_r * m->s4;
    const realv t6 = (t5 < (real)9.0 ? (realv)t5 : (realv)(real)9.0);
    const realv t7 = exp_lanes(-(t6 * t6));
    const realv t8 = (real)0.5 * t7;
    const realv t9 = (real)1.0 / (t6 * t3);
    const realv t10 = erfcx_lanes(t6);
    const realv t11 = t9 - t10;
    const realv t12 = (real)1.0 / (m->s13 + t8 * t11);
    const realv t13 = t1 * t2 * t12;
    const realv t14 = t4 * t12;
    const realv t15 = t14 * t13;
    const realv t16 = t15 * t8;
    const realv t17 = t16 * ((real)2.0 * t6 * t10 - (real)1.1283791670955126) + t16 * t9 * t9 * t3;
    const realv t18 = t15 * t11 * (real)0.5 * t7 * t6;
    const realv t19 = (t5 < (real)9.0 ? (realv)(t17 + t18 + t18) : (realv)(real)0.0) * m->s4 * t5;
    const realv t20 = t15 * m->s10;
    const realv t21 = t15 * m->s12 * (real)0.5 * m->s9 * m->s8;
    const realv t22 = (m->s7 < (real)9.0 ? (realv)(t20 * m->s14 + t20 * m->s11 * m->s11 * t3 + t21 + t21) : (realv)(real)0.0);
    const realv t23 = (-(t14 * t1 * t2 * x.tan2_h) + t14 * t2 * x.front) * m->s1 * m->s1 * m->alpha;
    tangent[0] = -t19 - t22 * m->s4 * m->s7 - t23 - t23;
    tangent[1] = t13 * x.less_schlick;
    tangent[2] = t13 * x.schlick;
    return t13 * t4;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
}
