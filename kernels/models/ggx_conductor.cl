// Written by 'make kernels' from clbrdf/models/library/ggx_conductor.py.
// ggx_conductor: GGX facets of a metal
// source: Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206

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
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
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
    m.s14 = m.s1 * (real)0.5 * m.s8;
    m.s15 = m.scale * m.s14;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s2 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_i);
    m->s16 = (real)1.0 / m->s2;
}

// f = what is returned / under; neighbouring directions share a division.
#define MODEL_DIVIDES
inline realv model_fraction(const model_state *m, const geometry x, realv *under) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = x.cos2_d + m->s9 - m->s4;
    const realv t3 = sqrt_lanes(t2 * t2 + m->s13) + (t2 < (real)0.0 ? (realv)-t2 : (realv)t2);
    const realv t4 = sqrt_lanes((real)0.5 * t3 + (real)1e-30);
    const realv t5 = m->s12 / t4;
    const realv t6 = (t2 < (real)0.0 ? (realv)t5 : (realv)t4);
    const realv t7 = t6 + x.cos_d;
    const realv t8 = (t2 < (real)0.0 ? (realv)t4 : (realv)t5);
    const realv t9 = t8 * t8;
    const realv t10 = t7 * t7 + t9;
    const realv t11 = x.cos_d * t6;
    const realv t12 = t11 - x.sin2_d;
    const realv t13 = x.cos2_d * t9;
    const realv t14 = t11 + x.sin2_d;
    const realv t15 = t14 * t14 + t13;
    const realv t16 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * (t10 * t10 + (real)1e-30);
    *under = t16 * t15;
    return m->s15 * x.front * (t15 + t12 * t12 + t13);
}

inline realv model_brdf(const model_state *m, const geometry x) {
    realv under;
    const realv over = model_fraction(m, x, &under);
    return over / under;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = x.cos2_d + m->s9 - m->s4;
    const realv t3 = sqrt_lanes(t2 * t2 + m->s13) + (t2 < (real)0.0 ? (realv)-t2 : (realv)t2);
    const realv t4 = sqrt_lanes((real)0.5 * t3 + (real)1e-30);
    const realv t5 = m->s12 / t4;
    const realv t6 = (t2 < (real)0.0 ? (realv)t5 : (realv)t4);
    const realv t7 = t6 + x.cos_d;
    const realv t8 = (t2 < (real)0.0 ? (realv)t4 : (realv)t5);
    const realv t9 = t8 * t8;
    const realv t10 = t7 * t7 + t9;
    const realv t11 = x.cos_d * t6;
    const realv t12 = t11 - x.sin2_d;
    const realv t13 = x.cos2_d * t9;
    const realv t14 = t11 + x.sin2_d;
    const realv t15 = t14 * t14 + t13;
    const realv t16 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * (t10 * t10 + (real)1e-30);
    term[0] = m->s14 * x.front * (t15 + t12 * t12 + t13) / (t16 * t15);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = t1 * t1;
    const realv t3 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_r);
    const realv t4 = m->s2 + t3;
    const realv t5 = x.cos2_d + m->s9 - m->s4;
    const realv t6 = sqrt_lanes(t5 * t5 + m->s13);
    const realv t7 = (t6 + (t5 < (real)0.0 ? (realv)-t5 : (realv)t5)) * (real)0.5 + (real)1e-30;
    const realv t8 = sqrt_lanes(t7);
    const realv t9 = (real)1.0 / (t2 * t4);
    const realv t10 = m->s1 * x.front * t9;
    const realv t11 = (real)1.0 / t8;
    const realv t12 = m->s12 * t11;
    const realv t13 = (t5 < (real)0.0 ? (realv)t12 : (realv)t8);
    const realv t14 = t13 + x.cos_d;
    const realv t15 = (t5 < (real)0.0 ? (realv)t8 : (realv)t12);
    const realv t16 = t15 * t15;
    const realv t17 = t14 * t14 + t16;
    const realv t18 = (real)1.0 / (t17 * t17 + (real)1e-30);
    const realv t19 = m->s8 * t18;
    const realv t20 = t13 * x.cos_d;
    const realv t21 = t20 - x.sin2_d;
    const realv t22 = t16 * x.cos2_d;
    const realv t23 = t21 * t21 + t22;
    const realv t24 = t20 + x.sin2_d;
    const realv t25 = (real)1.0 / (t24 * t24 + t22);
    const realv t26 = t19 * t23 * t25;
    const realv t27 = t19 + t26;
    const realv t28 = (real)0.5 * t27;
    const realv t29 = m->scale * t10 * (real)0.5;
    const realv t30 = t29 * t25;
    const realv t31 = t30 * t26;
    const realv t32 = t31 * t24;
    const realv t33 = t30 * t19;
    const realv t34 = t33 * t21;
    const realv t35 = (t29 + t30 * t23) * t18;
    const realv t36 = t35 * t19 * t17;
    const realv t37 = -t36 - t36;
    const realv t38 = ((-t31 + t33) * x.cos2_d + t37) * t15;
    const realv t39 = t38 + t38;
    const realv t40 = t37 * t14;
    const realv t41 = (-t32 - t32 + t34 + t34) * x.cos_d + t40 + t40;
    const realv t42 = (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t39) + (t5 < (real)0.0 ? (realv)t41 : (realv)(real)0.0);
    const realv t43 = (t5 < (real)0.0 ? (realv)t39 : (realv)(real)0.0) + (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t41);
    const realv t44 = t42 * t11;
    const realv t45 = (t43 - t44 * t12) * (real)0.5 * t11 * (real)0.5;
    const realv t46 = (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t45) - (t5 < (real)0.0 ? (realv)t45 : (realv)(real)0.0);
    const realv t47 = t45 * (real)0.5 / t6;
    const realv t48 = t47 * m->s11;
    const realv t49 = t47 * t5;
    const realv t50 = t46 + t49 + t49;
    const realv t51 = t48 + t48 + t44 * (real)0.5;
    const realv t52 = t35 * m->s7;
    const realv t53 = t35 * m->s5;
    const realv t54 = t53 * m->s6;
    const realv t55 = (-t50 + t53 + t52) * m->k;
    const realv t56 = t52 * m->s3;
    const realv t57 = t51 * m->k * (real)2.0 + t50 * m->s3 + t54 + t54 + t50 * m->s6 + t56 + t56;
    const realv t58 = m->scale * t28 * t9;
    const realv t59 = t58 * t10;
    const realv t60 = t59 * t2 * (real)0.5;
    const realv t61 = t59 * t4 * t1;
    const realv t62 = -(t60 / t3 * x.tan2_r) - t60 * m->s16 * x.tan2_i + -t61 - t61 + t58 * x.front;
    const realv t63 = t62 * m->alpha;
    tangent[0] = t63 + t63;
    tangent[1] = t57;
    tangent[2] = t51 * m->s10 + t55 + t55;
    tangent[3] = t10 * t27;
    return m->scale * t10 * t28;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = (realv)(real)0.5;
}
