// Written by 'make kernels' from clbrdf/models/library/ggx_conductor.py.
// ggx_conductor: GGX facets of a metal
// source: Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206

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
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.scale = p[P_scale];
    m.alpha = p[P_alpha];
    m.s1 = m.alpha * m.alpha;
    m.n = p[P_n];
    m.k = p[P_k];
    m.s3 = m.n * m.n - m.k * m.k;
    m.s4 = (real)2.0 * m.n;
    m.s5 = m.s4 * m.k;
    m.s6 = m.s5 * (real)0.5;
    m.s7 = m.s5 * m.s5;
    m.s8 = m.s1 * (real)0.5;
    m.s9 = m.scale * m.s8;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s2 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_i);
    m->s10 = (real)1.0 / m->s2;
}

// f = what is returned / under; neighbouring directions share a division.
#define MODEL_DIVIDES
inline realv model_fraction(const model_state *m, const geometry x, realv *under) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = m->s3 - x.sin2_d;
    const realv t3 = sqrt_lanes(t2 * t2 + m->s7) + (t2 < (real)0.0 ? (realv)-t2 : (realv)t2);
    const realv t4 = sqrt_lanes((real)0.5 * t3 + (real)1e-30);
    const realv t5 = m->s6 / t4;
    const realv t6 = (t2 < (real)0.0 ? (realv)t5 : (realv)t4);
    const realv t7 = (t2 < (real)0.0 ? (realv)t4 : (realv)t5);
    const realv t8 = t7 * t7;
    const realv t9 = t6 * t6 + t8 + x.cos2_d;
    const realv t10 = x.cos_d * t6;
    const realv t11 = (real)2.0 * t10;
    const realv t12 = t9 - t11;
    const realv t13 = t10 - x.sin2_d;
    const realv t14 = x.cos2_d * t8;
    const realv t15 = t10 + x.sin2_d;
    const realv t16 = t15 * t15 + t14;
    const realv t17 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * (t9 + t11);
    *under = t17 * t16;
    return m->s9 * x.front * (t12 * t16 + t12 * (t13 * t13 + t14));
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
    const realv t2 = m->s3 - x.sin2_d;
    const realv t3 = sqrt_lanes(t2 * t2 + m->s7) + (t2 < (real)0.0 ? (realv)-t2 : (realv)t2);
    const realv t4 = sqrt_lanes((real)0.5 * t3 + (real)1e-30);
    const realv t5 = m->s6 / t4;
    const realv t6 = (t2 < (real)0.0 ? (realv)t5 : (realv)t4);
    const realv t7 = (t2 < (real)0.0 ? (realv)t4 : (realv)t5);
    const realv t8 = t7 * t7;
    const realv t9 = t6 * t6 + t8 + x.cos2_d;
    const realv t10 = x.cos_d * t6;
    const realv t11 = (real)2.0 * t10;
    const realv t12 = t9 - t11;
    const realv t13 = t10 - x.sin2_d;
    const realv t14 = x.cos2_d * t8;
    const realv t15 = t10 + x.sin2_d;
    const realv t16 = t15 * t15 + t14;
    const realv t17 = t1 * t1 * (m->s2 + sqrt_lanes((real)1.0 + m->s1 * x.tan2_r)) * (t9 + t11);
    term[0] = m->s8 * x.front * (t12 * t16 + t12 * (t13 * t13 + t14)) / (t17 * t16);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s1 + x.tan2_h;
    const realv t2 = t1 * t1;
    const realv t3 = sqrt_lanes((real)1.0 + m->s1 * x.tan2_r);
    const realv t4 = m->s2 + t3;
    const realv t5 = m->s3 - x.sin2_d;
    const realv t6 = sqrt_lanes(t5 * t5 + m->s7);
    const realv t7 = (t6 + (t5 < (real)0.0 ? (realv)-t5 : (realv)t5)) * (real)0.5 + (real)1e-30;
    const realv t8 = sqrt_lanes(t7);
    const realv t9 = (real)1.0 / (t2 * t4);
    const realv t10 = m->s1 * x.front * t9;
    const realv t11 = (real)1.0 / t8;
    const realv t12 = m->s6 * t11;
    const realv t13 = (t5 < (real)0.0 ? (realv)t12 : (realv)t8);
    const realv t14 = (t5 < (real)0.0 ? (realv)t8 : (realv)t12);
    const realv t15 = t14 * t14;
    const realv t16 = t13 * t13 + t15 + x.cos2_d;
    const realv t17 = (real)2.0 * t13 * x.cos_d;
    const realv t18 = (real)1.0 / (t16 + t17);
    const realv t19 = (t16 - t17) * t18;
    const realv t20 = t13 * x.cos_d;
    const realv t21 = t20 - x.sin2_d;
    const realv t22 = t15 * x.cos2_d;
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
    const realv t36 = -(t35 * t19);
    const realv t37 = t36 + t35;
    const realv t38 = ((-t31 + t33) * x.cos2_d + t37) * t14;
    const realv t39 = t38 + t38;
    const realv t40 = t37 * t13;
    const realv t41 = (-t32 - t32 + t34 + t34) * x.cos_d + (t36 - t35) * x.cos_d * (real)2.0 + t40;
    const realv t42 = t41 + t40;
    const realv t43 = (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t39) + (t5 < (real)0.0 ? (realv)t42 : (realv)(real)0.0);
    const realv t44 = (t5 < (real)0.0 ? (realv)t39 : (realv)(real)0.0) + (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t42);
    const realv t45 = t43 * t11;
    const realv t46 = (t44 - t45 * t12) * (real)0.5 * t11 * (real)0.5;
    const realv t47 = (t5 < (real)0.0 ? (realv)(real)0.0 : (realv)t46) - (t5 < (real)0.0 ? (realv)t46 : (realv)(real)0.0);
    const realv t48 = t46 * (real)0.5 / t6;
    const realv t49 = t48 * m->s5;
    const realv t50 = t48 * t5;
    const realv t51 = t47 + t50 + t50;
    const realv t52 = t49 + t49 + t45 * (real)0.5;
    const realv t53 = t51 * m->k;
    const realv t54 = t51 * m->n;
    const realv t55 = m->scale * t28 * t9;
    const realv t56 = t55 * t10;
    const realv t57 = t56 * t2 * (real)0.5;
    const realv t58 = t56 * t4 * t1;
    const realv t59 = -(t57 / t3 * x.tan2_r) - t57 * m->s10 * x.tan2_i + -t58 - t58 + t55 * x.front;
    const realv t60 = t59 * m->alpha;
    tangent[0] = t60 + t60;
    tangent[1] = t52 * m->k * (real)2.0 + t54 + t54;
    tangent[2] = t52 * m->s4 - t53 - t53;
    tangent[3] = t10 * t27;
    return m->scale * t10 * t28;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = (realv)(real)0.5;
}
