// Written by 'make kernels' from clbrdf/models/library/beckmann_conductor.py.
// beckmann_conductor: Beckmann facets of a metal
// source: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293

typedef struct {
    realv scale;
    realv alpha;
    realv s1;
    realv s2;
    realv n;
    realv k;
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
    realv s16;
    realv s17;
    realv s18;
    realv s19;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = (real)1.0 / (m.alpha * m.alpha);
    m.n = p[P_n];
    m.k = p[P_k];
    m.s3 = m.n * m.n - m.k * m.k;
    m.s4 = (real)2.0 * m.n;
    m.s5 = m.s4 * m.k;
    m.s6 = m.s5 * (real)0.5;
    m.s7 = m.s5 * m.s5;
    m.s8 = -(m.s1 * (real)1.4426950408889634);
    m.s9 = (real)1.0 / m.alpha;
    m.s10 = m.s1 * (real)0.5;
    m.s11 = m.scale * m.s10;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    const realv t1 = x.cot_i / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * t3) - erfcx_lanes(t2));
    m->s2 = (real)1.0 + t4;
    m->s12 = x.cot_i * m->s9;
    m->s13 = (m->s12 < (real)9.0 ? (realv)m->s12 : (realv)(real)9.0);
    m->s14 = exp_lanes(-(m->s13 * m->s13));
    m->s15 = (real)0.5 * m->s14;
    m->s16 = (real)1.0 / (m->s13 * t3);
    const realv t5 = erfcx_lanes(m->s13);
    m->s17 = m->s16 - t5;
    m->s18 = (real)1.0 + m->s15 * m->s17;
    m->s19 = (real)2.0 * m->s13 * t5 - (real)1.1283791670955126;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s3 - x.sin2_d;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s7) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = m->s9 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = m->s2 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    const realv t8 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t9 = m->s6 / t8;
    const realv t10 = (t1 < (real)0.0 ? (realv)t9 : (realv)t8);
    const realv t11 = (t1 < (real)0.0 ? (realv)t8 : (realv)t9);
    const realv t12 = t11 * t11;
    const realv t13 = t10 * t10 + t12 + x.cos2_d;
    const realv t14 = x.cos_d * t10;
    const realv t15 = (real)2.0 * t14;
    const realv t16 = t13 - t15;
    const realv t17 = t14 - x.sin2_d;
    const realv t18 = x.cos2_d * t12;
    const realv t19 = t14 + x.sin2_d;
    const realv t20 = t19 * t19 + t18;
    const realv t21 = x.front * exp2_falling(m->s8 * x.tan2_h) * t4 * t5 * (t16 * t20 + t16 * (t17 * t17 + t18));
    return m->s11 * t21 / (t7 * (t13 + t15) * t20);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s3 - x.sin2_d;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s7) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = m->s9 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t8 = m->s6 / t7;
    const realv t9 = (t1 < (real)0.0 ? (realv)t8 : (realv)t7);
    const realv t10 = (t1 < (real)0.0 ? (realv)t7 : (realv)t8);
    const realv t11 = t10 * t10;
    const realv t12 = t9 * t9 + t11 + x.cos2_d;
    const realv t13 = x.cos_d * t9;
    const realv t14 = (real)2.0 * t13;
    const realv t15 = t12 - t14;
    const realv t16 = t13 - x.sin2_d;
    const realv t17 = x.cos2_d * t11;
    const realv t18 = t13 + x.sin2_d;
    const realv t19 = t18 * t18 + t17;
    const realv t20 = x.front * exp2_falling(m->s8 * x.tan2_h) * t4 * t5 * (t15 * t19 + t15 * (t16 * t16 + t17));
    const realv t21 = m->s18 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    term[0] = m->s10 * t20 / (t21 * (t12 + t14) * t19);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 * x.front;
    const realv t2 = exp_lanes(-(x.tan2_h * m->s1));
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = m->s3 - x.sin2_d;
    const realv t5 = sqrt_lanes(t4 * t4 + m->s7);
    const realv t6 = (t5 + (t4 < (real)0.0 ? (realv)-t4 : (realv)t4)) * (real)0.5 + (real)1e-30;
    const realv t7 = sqrt_lanes(t6);
    const realv t8 = x.cot_r * m->s9;
    const realv t9 = (t8 < (real)9.0 ? (realv)t8 : (realv)(real)9.0);
    const realv t10 = exp_lanes(-(t9 * t9));
    const realv t11 = (real)0.5 * t10;
    const realv t12 = (real)1.0 / (t9 * t3);
    const realv t13 = erfcx_lanes(t9);
    const realv t14 = t12 - t13;
    const realv t15 = (real)1.0 / (m->s18 + t11 * t14);
    const realv t16 = t1 * t2 * t15;
    const realv t17 = (real)1.0 / t7;
    const realv t18 = m->s6 * t17;
    const realv t19 = (t4 < (real)0.0 ? (realv)t18 : (realv)t7);
    const realv t20 = (t4 < (real)0.0 ? (realv)t7 : (realv)t18);
    const realv t21 = t20 * t20;
    const realv t22 = t19 * t19 + t21 + x.cos2_d;
    const realv t23 = (real)2.0 * t19 * x.cos_d;
    const realv t24 = (real)1.0 / (t22 + t23);
    const realv t25 = (t22 - t23) * t24;
    const realv t26 = t19 * x.cos_d;
    const realv t27 = t26 - x.sin2_d;
    const realv t28 = t21 * x.cos2_d;
    const realv t29 = t27 * t27 + t28;
    const realv t30 = t26 + x.sin2_d;
    const realv t31 = (real)1.0 / (t30 * t30 + t28);
    const realv t32 = t25 * t29 * t31;
    const realv t33 = t25 + t32;
    const realv t34 = (real)0.5 * t33;
    const realv t35 = m->scale * t16 * (real)0.5;
    const realv t36 = t35 * t31;
    const realv t37 = t36 * t32;
    const realv t38 = t37 * t30;
    const realv t39 = t36 * t25;
    const realv t40 = t39 * t27;
    const realv t41 = (t35 + t36 * t29) * t24;
    const realv t42 = -(t41 * t25);
    const realv t43 = t42 + t41;
    const realv t44 = ((-t37 + t39) * x.cos2_d + t43) * t20;
    const realv t45 = t44 + t44;
    const realv t46 = t43 * t19;
    const realv t47 = (-t38 - t38 + t40 + t40) * x.cos_d + (t42 - t41) * x.cos_d * (real)2.0 + t46;
    const realv t48 = t47 + t46;
    const realv t49 = (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t45) + (t4 < (real)0.0 ? (realv)t48 : (realv)(real)0.0);
    const realv t50 = (t4 < (real)0.0 ? (realv)t45 : (realv)(real)0.0) + (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t48);
    const realv t51 = t49 * t17;
    const realv t52 = (t50 - t51 * t18) * (real)0.5 * t17 * (real)0.5;
    const realv t53 = (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t52) - (t4 < (real)0.0 ? (realv)t52 : (realv)(real)0.0);
    const realv t54 = t52 * (real)0.5 / t5;
    const realv t55 = t54 * m->s5;
    const realv t56 = t54 * t4;
    const realv t57 = t53 + t56 + t56;
    const realv t58 = t55 + t55 + t51 * (real)0.5;
    const realv t59 = t57 * m->k;
    const realv t60 = t57 * m->n;
    const realv t61 = m->scale * t34 * t15;
    const realv t62 = t61 * t16;
    const realv t63 = t62 * t11;
    const realv t64 = t63 * ((real)2.0 * t9 * t13 - (real)1.1283791670955126) + t63 * t12 * t12 * t3;
    const realv t65 = t62 * t14 * (real)0.5 * t10 * t9;
    const realv t66 = (t8 < (real)9.0 ? (realv)(t64 + t65 + t65) : (realv)(real)0.0) * m->s9 * t8;
    const realv t67 = t62 * m->s15;
    const realv t68 = t62 * m->s17 * (real)0.5 * m->s14 * m->s13;
    const realv t69 = (m->s12 < (real)9.0 ? (realv)(t67 * m->s19 + t67 * m->s16 * m->s16 * t3 + t68 + t68) : (realv)(real)0.0);
    const realv t70 = (-(t61 * t1 * t2 * x.tan2_h) + t61 * t2 * x.front) * m->s1 * m->s1 * m->alpha;
    tangent[0] = -t66 - t69 * m->s9 * m->s12 - t70 - t70;
    tangent[1] = t58 * m->k * (real)2.0 + t60 + t60;
    tangent[2] = t58 * m->s4 - t59 - t59;
    tangent[3] = t16 * t33;
    return m->scale * t16 * t34;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = (realv)(real)0.5;
}
