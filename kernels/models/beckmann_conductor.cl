// Written by 'make kernels' from clbrdf/models/library/beckmann_conductor.py.
// beckmann_conductor: Beckmann facets of a metal
// source: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293

typedef struct {
    realv scale;
    realv alpha;
    realv s1;
    realv s2;
    realv s3;
    realv k;
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
    realv s20;
    realv s21;
    realv s22;
    realv s23;
    realv s24;
    realv s25;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = (real)1.0 / (m.alpha * m.alpha);
    m.s3 = p[P_n] - (real)1.0;
    m.k = p[P_k];
    m.s4 = m.k * m.k;
    m.s5 = m.s3 * m.s3 + m.s4;
    m.s6 = p[P_n] + (real)1.0;
    m.s7 = m.s6 * m.s6 + m.s4;
    m.s8 = m.s5 * m.s7;
    m.s9 = m.s3 * m.s6;
    m.s10 = (real)2.0 * p[P_n];
    m.s11 = m.s10 * m.k;
    m.s12 = m.s11 * (real)0.5;
    m.s13 = m.s11 * m.s11;
    m.s14 = -(m.s1 * (real)1.4426950408889634);
    m.s15 = (real)1.0 / m.alpha;
    m.s16 = m.s1 * (real)0.5 * m.s8;
    m.s17 = m.scale * m.s16;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    const realv t1 = x.cot_i / m->alpha;
    const realv t2 = (t1 < (real)9.0 ? (realv)t1 : (realv)(real)9.0);
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = (real)0.5 * exp_lanes(-(t2 * t2)) * ((real)1.0 / (t2 * t3) - erfcx_lanes(t2));
    m->s2 = (real)1.0 + t4;
    m->s18 = x.cot_i * m->s15;
    m->s19 = (m->s18 < (real)9.0 ? (realv)m->s18 : (realv)(real)9.0);
    m->s20 = exp_lanes(-(m->s19 * m->s19));
    m->s21 = (real)0.5 * m->s20;
    m->s22 = (real)1.0 / (m->s19 * t3);
    const realv t5 = erfcx_lanes(m->s19);
    m->s23 = m->s22 - t5;
    m->s24 = (real)1.0 + m->s21 * m->s23;
    m->s25 = (real)2.0 * m->s19 * t5 - (real)1.1283791670955126;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = x.cos2_d + m->s9 - m->s4;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s13) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = m->s15 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = m->s2 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    const realv t8 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t9 = m->s12 / t8;
    const realv t10 = (t1 < (real)0.0 ? (realv)t9 : (realv)t8);
    const realv t11 = t10 + x.cos_d;
    const realv t12 = (t1 < (real)0.0 ? (realv)t8 : (realv)t9);
    const realv t13 = t12 * t12;
    const realv t14 = t11 * t11 + t13;
    const realv t15 = x.cos_d * t10;
    const realv t16 = t15 - x.sin2_d;
    const realv t17 = x.cos2_d * t13;
    const realv t18 = t15 + x.sin2_d;
    const realv t19 = t18 * t18 + t17;
    const realv t20 = x.front * exp2_falling(m->s14 * x.tan2_h) * t4 * t5 * (t19 + t16 * t16 + t17);
    return m->s17 * t20 / (t7 * (t14 * t14 + (real)1e-30) * t19);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = x.cos2_d + m->s9 - m->s4;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s13) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = m->s15 * x.cot_r;
    const realv t4 = (t3 < (real)9.0 ? (realv)t3 : (realv)(real)9.0);
    const realv t5 = (real)1.0 + t4 + t4;
    const realv t6 = (real)1.0 / sqrt_lanes((real)3.141592653589793) * t5 - t4 * erfcx_raised(t4);
    const realv t7 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t8 = m->s12 / t7;
    const realv t9 = (t1 < (real)0.0 ? (realv)t8 : (realv)t7);
    const realv t10 = t9 + x.cos_d;
    const realv t11 = (t1 < (real)0.0 ? (realv)t7 : (realv)t8);
    const realv t12 = t11 * t11;
    const realv t13 = t10 * t10 + t12;
    const realv t14 = x.cos_d * t9;
    const realv t15 = t14 - x.sin2_d;
    const realv t16 = x.cos2_d * t12;
    const realv t17 = t14 + x.sin2_d;
    const realv t18 = t17 * t17 + t16;
    const realv t19 = x.front * exp2_falling(m->s14 * x.tan2_h) * t4 * t5 * (t18 + t15 * t15 + t16);
    const realv t20 = m->s24 * t4 * t5 + (real)0.5 * exp2_falling((real)(-1.4426950408889634) * t4 * t4) * t6;
    term[0] = m->s16 * t19 / (t20 * (t13 * t13 + (real)1e-30) * t18);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 * x.front;
    const realv t2 = exp_lanes(-(x.tan2_h * m->s1));
    const realv t3 = sqrt_lanes((real)3.141592653589793);
    const realv t4 = x.cos2_d + m->s9 - m->s4;
    const realv t5 = sqrt_lanes(t4 * t4 + m->s13);
    const realv t6 = (t5 + (t4 < (real)0.0 ? (realv)-t4 : (realv)t4)) * (real)0.5 + (real)1e-30;
    const realv t7 = sqrt_lanes(t6);
    const realv t8 = x.cot_r * m->s15;
    const realv t9 = (t8 < (real)9.0 ? (realv)t8 : (realv)(real)9.0);
    const realv t10 = exp_lanes(-(t9 * t9));
    const realv t11 = (real)0.5 * t10;
    const realv t12 = (real)1.0 / (t9 * t3);
    const realv t13 = erfcx_lanes(t9);
    const realv t14 = t12 - t13;
    const realv t15 = (real)1.0 / (m->s24 + t11 * t14);
    const realv t16 = t1 * t2 * t15;
    const realv t17 = (real)1.0 / t7;
    const realv t18 = m->s12 * t17;
    const realv t19 = (t4 < (real)0.0 ? (realv)t18 : (realv)t7);
    const realv t20 = t19 + x.cos_d;
    const realv t21 = (t4 < (real)0.0 ? (realv)t7 : (realv)t18);
    const realv t22 = t21 * t21;
    const realv t23 = t20 * t20 + t22;
    const realv t24 = (real)1.0 / (t23 * t23 + (real)1e-30);
    const realv t25 = m->s8 * t24;
    const realv t26 = t19 * x.cos_d;
    const realv t27 = t26 - x.sin2_d;
    const realv t28 = t22 * x.cos2_d;
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
    const realv t42 = t41 * t25 * t23;
    const realv t43 = -t42 - t42;
    const realv t44 = ((-t37 + t39) * x.cos2_d + t43) * t21;
    const realv t45 = t44 + t44;
    const realv t46 = t43 * t20;
    const realv t47 = (-t38 - t38 + t40 + t40) * x.cos_d + t46 + t46;
    const realv t48 = (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t45) + (t4 < (real)0.0 ? (realv)t47 : (realv)(real)0.0);
    const realv t49 = (t4 < (real)0.0 ? (realv)t45 : (realv)(real)0.0) + (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t47);
    const realv t50 = t48 * t17;
    const realv t51 = (t49 - t50 * t18) * (real)0.5 * t17 * (real)0.5;
    const realv t52 = (t4 < (real)0.0 ? (realv)(real)0.0 : (realv)t51) - (t4 < (real)0.0 ? (realv)t51 : (realv)(real)0.0);
    const realv t53 = t51 * (real)0.5 / t5;
    const realv t54 = t53 * m->s11;
    const realv t55 = t53 * t4;
    const realv t56 = t52 + t55 + t55;
    const realv t57 = t54 + t54 + t50 * (real)0.5;
    const realv t58 = t41 * m->s7;
    const realv t59 = t41 * m->s5;
    const realv t60 = t59 * m->s6;
    const realv t61 = (-t56 + t59 + t58) * m->k;
    const realv t62 = t58 * m->s3;
    const realv t63 = t57 * m->k * (real)2.0 + t56 * m->s3 + t60 + t60 + t56 * m->s6 + t62 + t62;
    const realv t64 = m->scale * t34 * t15;
    const realv t65 = t64 * t16;
    const realv t66 = t65 * t11;
    const realv t67 = t66 * ((real)2.0 * t9 * t13 - (real)1.1283791670955126) + t66 * t12 * t12 * t3;
    const realv t68 = t65 * t14 * (real)0.5 * t10 * t9;
    const realv t69 = (t8 < (real)9.0 ? (realv)(t67 + t68 + t68) : (realv)(real)0.0) * m->s15;
    const realv t70 = t65 * m->s21;
    const realv t71 = t65 * m->s23 * (real)0.5 * m->s20 * m->s19;
    const realv t72 = (m->s18 < (real)9.0 ? (realv)(t70 * m->s25 + t70 * m->s22 * m->s22 * t3 + t71 + t71) : (realv)(real)0.0);
    const realv t73 = (-(t64 * t1 * t2 * x.tan2_h) + t64 * t2 * x.front) * m->s1 * m->s1 * m->alpha;
    tangent[0] = -(t69 * t8) - t72 * m->s15 * m->s18 - t73 - t73;
    tangent[1] = t63;
    tangent[2] = t57 * m->s10 + t61 + t61;
    tangent[3] = t16 * t33;
    return m->scale * t16 * t34;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = (realv)(real)0.5;
}
