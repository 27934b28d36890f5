// Written by 'make kernels' from clbrdf/models/library/rayleigh_rice.py.
// rayleigh_rice: Rayleigh–Rice scatter with a K-correlation spectrum
// source: Church and Takacs, Proc. SPIE 645 (1986) 107; Stover (2012), doi:10.1117/3.975276

typedef struct {
    realv s1;
    realv s2;
    realv s3;
    realv s4;
    realv n;
    realv k;
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
    realv A;
    realv s24;
    realv B;
    realv s25;
    realv s26;
    realv s27;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.s1 = p[P_wavelength] * (real)0.001;
    m.s2 = m.s1 * m.s1;
    m.s3 = m.s2 * m.s2;
    m.s4 = (real)16.0 * (real)3.141592653589793 * (real)3.141592653589793 / m.s3;
    m.n = p[P_n];
    m.k = p[P_k];
    m.s5 = m.n * m.n - m.k * m.k;
    m.s6 = m.s5 - (real)1.0;
    m.s7 = (real)2.0 * m.n;
    m.s8 = m.s7 * m.k;
    m.s9 = m.s8 * m.s8;
    m.s10 = (real)0.5 * (m.s6 * m.s6 + m.s9);
    m.s12 = m.s8 * (real)0.5;
    m.A = p[P_A];
    m.s24 = (real)(-0.5) * p[P_C];
    m.B = p[P_B];
    m.s25 = m.B * m.B;
    m.s26 = m.s4 * m.s10;
    m.s27 = m.s26 * m.A * (real)(-0.5);
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s11 = m->s5 - x.sin2_i;
    m->s13 = sqrt(m->s11 * m->s11 + m->s9);
    const realv t1 = (m->s13 + (m->s11 < (real)0.0 ? (realv)-m->s11 : (realv)m->s11)) * (real)0.5;
    m->s14 = sqrt(t1 + (real)1e-30);
    m->s15 = m->s12 / m->s14;
    m->s16 = (m->s11 < (real)0.0 ? (realv)m->s15 : (realv)m->s14);
    m->s17 = (m->s11 < (real)0.0 ? (realv)m->s14 : (realv)m->s15);
    m->s18 = m->s5 * x.cos_i + m->s16;
    m->s19 = m->s8 * x.cos_i + m->s17;
    m->s20 = m->s18 * m->s18 + m->s19 * m->s19;
    m->s21 = m->s16 + x.cos_i;
    const realv t2 = m->s17 * m->s17;
    m->s22 = m->s21 * m->s21 + t2;
    m->s23 = m->s16 * m->s16 + t2;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s5 - x.sin2_r;
    const realv t2 = (sqrt(t1 * t1 + m->s9) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5;
    const realv t3 = sqrt(t2 + (real)1e-30);
    const realv t4 = m->s12 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s5 * x.sines + (m->s16 * t5 - m->s17 * t6) * x.cos_phi;
    const realv t8 = m->s8 * x.sines + (m->s16 * t6 + m->s17 * t5) * x.cos_phi;
    const realv t9 = m->s5 * x.cos_r + t5;
    const realv t10 = m->s8 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = (t7 * t7 + t8 * t8) / (m->s20 * t11) + x.cos2_phi / (m->s22 * t14) + m->s23 * x.sin2_phi / (m->s20 * t14);
    const realv t16 = m->s4 * x.cosines * m->s10 * (t15 + (t5 * t5 + t13) * x.sin2_phi / (m->s22 * t11));
    return t16 * m->A * exp_lanes(m->s24 * log1p_lanes(m->s25 * x.x2 / m->s2));
}

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s5 - x.sin2_r;
    const realv t2 = (sqrt(t1 * t1 + m->s9) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5;
    const realv t3 = sqrt(t2 + (real)1e-30);
    const realv t4 = m->s12 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s5 * x.sines + (m->s16 * t5 - m->s17 * t6) * x.cos_phi;
    const realv t8 = m->s8 * x.sines + (m->s16 * t6 + m->s17 * t5) * x.cos_phi;
    const realv t9 = m->s5 * x.cos_r + t5;
    const realv t10 = m->s8 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = (t7 * t7 + t8 * t8) / (m->s20 * t11) + x.cos2_phi / (m->s22 * t14) + m->s23 * x.sin2_phi / (m->s20 * t14);
    const realv t16 = m->s4 * x.cosines * m->s10 * (t15 + (t5 * t5 + t13) * x.sin2_phi / (m->s22 * t11));
    term[0] = t16 * exp_lanes(m->s24 * log1p_lanes(m->s25 * x.x2 / m->s2)) * m->A;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 6
constant int tangent_of[P] = {0, 1, 2, 3, 4, 5};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s4 * x.cosines;
    const realv t2 = m->s5 - x.sin2_r;
    const realv t3 = sqrt(t2 * t2 + m->s9);
    const realv t4 = (t3 + (t2 < (real)0.0 ? (realv)-t2 : (realv)t2)) * (real)0.5 + (real)1e-30;
    const realv t5 = sqrt(t4);
    const realv t6 = m->s12 / t5;
    const realv t7 = (t2 < (real)0.0 ? (realv)t6 : (realv)t5);
    const realv t8 = (t2 < (real)0.0 ? (realv)t5 : (realv)t6);
    const realv t9 = m->s5 * x.sines + (m->s16 * t7 - m->s17 * t8) * x.cos_phi;
    const realv t10 = m->s8 * x.sines + (m->s16 * t8 + m->s17 * t7) * x.cos_phi;
    const realv t11 = m->s5 * x.cos_r + t7;
    const realv t12 = m->s8 * x.cos_r + t8;
    const realv t13 = t11 * t11 + t12 * t12;
    const realv t14 = m->s20 * t13;
    const realv t15 = (t9 * t9 + t10 * t10) / t14;
    const realv t16 = t7 + x.cos_r;
    const realv t17 = t8 * t8;
    const realv t18 = t16 * t16 + t17;
    const realv t19 = m->s22 * t18;
    const realv t20 = x.cos2_phi / t19;
    const realv t21 = m->s20 * t18;
    const realv t22 = m->s23 * x.sin2_phi / t21;
    const realv t23 = m->s22 * t13;
    const realv t24 = (t7 * t7 + t17) * x.sin2_phi / t23;
    const realv t25 = t15 + t20 + t22 + t24;
    const realv t26 = m->s10 * t25;
    const realv t27 = t1 * t26;
    const realv t28 = x.x2 / m->s2;
    const realv t29 = m->s25 * t28;
    const realv t30 = log1p_lanes(t29);
    const realv t31 = exp_lanes(m->s24 * t30);
    const realv t32 = m->A * t31;
    const realv t33 = t27 * m->A * t31 * m->s24 / ((real)1.0 + t29);
    const realv t34 = t33 * t28 * m->B;
    const realv t35 = t32 * t1;
    const realv t36 = t35 * m->s10;
    const realv t37 = t36 / t23;
    const realv t38 = t37 * t24;
    const realv t39 = t37 * x.sin2_phi;
    const realv t40 = t39 * t7;
    const realv t41 = t36 / t21;
    const realv t42 = t41 * t22;
    const realv t43 = t41 * x.sin2_phi;
    const realv t44 = t43 * m->s16;
    const realv t45 = t36 / t19 * t20;
    const realv t46 = -(t38 * t13) - t45 * t18;
    const realv t47 = -(t42 * m->s20) - t45 * m->s22;
    const realv t48 = (t39 + t47) * t8;
    const realv t49 = t47 * t16;
    const realv t50 = (t43 + t46) * m->s17;
    const realv t51 = t46 * m->s21;
    const realv t52 = t36 / t14;
    const realv t53 = t52 * t15;
    const realv t54 = -(t42 * t18) - t53 * t13;
    const realv t55 = -(t38 * m->s22) - t53 * m->s20;
    const realv t56 = t55 * t12;
    const realv t57 = t56 + t56;
    const realv t58 = t55 * t11;
    const realv t59 = t58 + t58;
    const realv t60 = t54 * m->s19;
    const realv t61 = t60 + t60;
    const realv t62 = t54 * m->s18;
    const realv t63 = t62 + t62;
    const realv t64 = t52 * t10;
    const realv t65 = t64 + t64;
    const realv t66 = t65 * x.cos_phi;
    const realv t67 = t52 * t9;
    const realv t68 = t67 + t67;
    const realv t69 = t68 * x.cos_phi;
    const realv t70 = t50 + t50 + t61 + t66 * t7 - t69 * t8;
    const realv t71 = t48 + t48 + t57 + t66 * m->s16 - t69 * m->s17;
    const realv t72 = t44 + t44 + t51 + t51 + t63 + t66 * t8 + t69 * t7;
    const realv t73 = t40 + t40 + t49 + t49 + t59 + t66 * m->s17 + t69 * m->s16;
    const realv t74 = (t2 < (real)0.0 ? (realv)(real)0.0 : (realv)t71) + (t2 < (real)0.0 ? (realv)t73 : (realv)(real)0.0);
    const realv t75 = (t2 < (real)0.0 ? (realv)t71 : (realv)(real)0.0) + (t2 < (real)0.0 ? (realv)(real)0.0 : (realv)t73);
    const realv t76 = t74 / t5;
    const realv t77 = (t75 - t76 * t6) * (real)0.5 / t5 * (real)0.5;
    const realv t78 = (t2 < (real)0.0 ? (realv)(real)0.0 : (realv)t77) - (t2 < (real)0.0 ? (realv)t77 : (realv)(real)0.0);
    const realv t79 = t77 * (real)0.5 / t3;
    const realv t80 = t79 * t2;
    const realv t81 = (m->s11 < (real)0.0 ? (realv)(real)0.0 : (realv)t70) + (m->s11 < (real)0.0 ? (realv)t72 : (realv)(real)0.0);
    const realv t82 = (m->s11 < (real)0.0 ? (realv)t70 : (realv)(real)0.0) + (m->s11 < (real)0.0 ? (realv)(real)0.0 : (realv)t72);
    const realv t83 = t81 / m->s14;
    const realv t84 = (t82 - t83 * m->s15) * (real)0.5 / m->s14 * (real)0.5;
    const realv t85 = (m->s11 < (real)0.0 ? (realv)(real)0.0 : (realv)t84) - (m->s11 < (real)0.0 ? (realv)t84 : (realv)(real)0.0);
    const realv t86 = t84 * (real)0.5 / m->s13;
    const realv t87 = t86 * m->s11;
    const realv t88 = t57 * x.cos_r + t61 * x.cos_i + t65 * x.sines + (t76 + t83) * (real)0.5;
    const realv t89 = t59 * x.cos_r + t63 * x.cos_i + t78 + t80 + t80 + t85 + t87 + t87 + t68 * x.sines;
    const realv t90 = t35 * t25 * (real)0.5;
    const realv t91 = (t79 + t86 + t90) * m->s8;
    const realv t92 = t88 + t91 + t91;
    const realv t93 = t90 * m->s6;
    const realv t94 = t89 + t93 + t93;
    const realv t95 = t94 * m->k;
    const realv t96 = t94 * m->n;
    const realv t97 = t32 * t26 * x.cosines / m->s3 * m->s4 * m->s2;
    const realv t98 = (-(t33 * m->s25 / m->s2 * t28) - t97 - t97) * m->s1;
    const realv t99 = x.cosines * t25;
    tangent[0] = t99 * t31;
    tangent[1] = t34 + t34;
    tangent[2] = t99 * t30 * t31;
    tangent[3] = t92 * m->k * (real)2.0 + t96 + t96;
    tangent[4] = t92 * m->s7 - t95 - t95;
    tangent[5] = t98 + t98;
    return t27 * t32;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = m->s26;
    factor[1] = (realv)(real)1.0;
    factor[2] = m->s27;
    factor[3] = (realv)(real)1.0;
    factor[4] = (realv)(real)1.0;
    factor[5] = (realv)(real)0.001;
}
