// Written by 'make kernels' from clbrdf/models/library/rayleigh_rice.py.
// rayleigh_rice: Rayleigh–Rice scatter with a K-correlation spectrum
// source: Church and Takacs, Proc. SPIE 645 (1986) 107; Stover (2012), doi:10.1117/3.975276

typedef struct {
    realv s1;
    realv s2;
    realv s3;
    realv n;
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
    realv A;
    realv s17;
    realv B;
    realv s18;
    realv s19;
    realv s20;
    realv s21;
    realv s22;
    realv s23;
    realv s24;
    realv s25;
    realv s26;
    realv s27;
    realv s28;
    realv s29;
    realv s30;
    realv s31;
    realv s32;
    realv s33;
    realv s34;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    const realv t1 = (real)16.0 * (real)3.141592653589793 * (real)3.141592653589793;
    m.s1 = p[P_wavelength] * (real)0.001;
    m.s2 = m.s1 * m.s1;
    const realv t2 = m.s2 * m.s2;
    m.s3 = t1 / t2;
    m.n = p[P_n];
    m.k = p[P_k];
    m.s4 = m.n * m.n - m.k * m.k;
    m.s5 = m.s4 - (real)1.0;
    m.s6 = (real)2.0 * m.n;
    m.s7 = m.s6 * m.k;
    m.s8 = m.s7 * m.s7;
    m.s9 = (real)0.5 * (m.s5 * m.s5 + m.s8);
    m.s11 = m.s7 * (real)0.5;
    m.A = p[P_A];
    m.s17 = (real)(-0.5) * p[P_C];
    m.B = p[P_B];
    m.s18 = m.B * m.B;
    m.s19 = m.s3 * m.s9;
    m.s20 = m.s19 * m.A * (real)(-0.5);
    m.s21 = (real)1.0 / m.s2;
    m.s22 = (real)1.0 / t2;
    m.s23 = t1 * m.s22;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s10 = m->s4 - x.sin2_i;
    const realv t1 = sqrt(m->s10 * m->s10 + m->s8);
    const realv t2 = (t1 + (m->s10 < (real)0.0 ? (realv)-m->s10 : (realv)m->s10)) * (real)0.5;
    const realv t3 = sqrt(t2 + (real)1e-30);
    const realv t4 = m->s11 / t3;
    m->s12 = (m->s10 < (real)0.0 ? (realv)t4 : (realv)t3);
    m->s13 = (m->s10 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t5 = m->s4 * x.cos_i;
    const realv t6 = t5 + m->s12;
    const realv t7 = m->s7 * x.cos_i;
    const realv t8 = t7 + m->s13;
    m->s14 = t6 * t6 + t8 * t8;
    const realv t9 = m->s12 + x.cos_i;
    const realv t10 = m->s13 * m->s13;
    m->s15 = t9 * t9 + t10;
    m->s16 = m->s12 * m->s12 + t10;
    m->s24 = (real)1.0 / t3;
    m->s25 = m->s11 * m->s24;
    m->s26 = (m->s10 < (real)0.0 ? (realv)m->s25 : (realv)t3);
    m->s27 = (m->s10 < (real)0.0 ? (realv)t3 : (realv)m->s25);
    m->s28 = t5 + m->s26;
    m->s29 = t7 + m->s27;
    m->s30 = m->s28 * m->s28 + m->s29 * m->s29;
    m->s31 = m->s26 + x.cos_i;
    const realv t11 = m->s27 * m->s27;
    m->s32 = m->s31 * m->s31 + t11;
    m->s33 = m->s26 * m->s26 + t11;
    m->s34 = (real)1.0 / t1;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s4 - x.sin2_r;
    const realv t2 = (sqrt(t1 * t1 + m->s8) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5;
    const realv t3 = sqrt(t2 + (real)1e-30);
    const realv t4 = m->s11 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s4 * x.sines + (m->s12 * t5 - m->s13 * t6) * x.cos_phi;
    const realv t8 = m->s7 * x.sines + (m->s12 * t6 + m->s13 * t5) * x.cos_phi;
    const realv t9 = m->s4 * x.cos_r + t5;
    const realv t10 = m->s7 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = (t7 * t7 + t8 * t8) / (m->s14 * t11) + x.cos2_phi / (m->s15 * t14) + m->s16 * x.sin2_phi / (m->s14 * t14);
    const realv t16 = m->s3 * x.cosines * m->s9 * (t15 + (t5 * t5 + t13) * x.sin2_phi / (m->s15 * t11));
    return t16 * m->A * exp_lanes(m->s17 * log1p_lanes(m->s18 * x.x2 * m->s21));
}

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s4 - x.sin2_r;
    const realv t2 = (sqrt(t1 * t1 + m->s8) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5;
    const realv t3 = sqrt(t2 + (real)1e-30);
    const realv t4 = m->s11 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s4 * x.sines + (m->s12 * t5 - m->s13 * t6) * x.cos_phi;
    const realv t8 = m->s7 * x.sines + (m->s12 * t6 + m->s13 * t5) * x.cos_phi;
    const realv t9 = m->s4 * x.cos_r + t5;
    const realv t10 = m->s7 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = (t7 * t7 + t8 * t8) / (m->s14 * t11) + x.cos2_phi / (m->s15 * t14) + m->s16 * x.sin2_phi / (m->s14 * t14);
    const realv t16 = m->s3 * x.cosines * m->s9 * (t15 + (t5 * t5 + t13) * x.sin2_phi / (m->s15 * t11));
    term[0] = t16 * exp_lanes(m->s17 * log1p_lanes(m->s18 * x.x2 * m->s21)) * m->A;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 6
constant int tangent_of[P] = {0, 1, 2, 3, 4, 5};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s4 - x.sin2_r;
    const realv t2 = sqrt(t1 * t1 + m->s8);
    const realv t3 = (t2 + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5 + (real)1e-30;
    const realv t4 = sqrt(t3);
    const realv t5 = x.x2 * m->s21;
    const realv t6 = m->s18 * t5;
    const realv t7 = log1p_lanes(t6);
    const realv t8 = exp_lanes(m->s17 * t7);
    const realv t9 = m->A * t8;
    const realv t10 = m->s23 * x.cosines;
    const realv t11 = (real)1.0 / t4;
    const realv t12 = m->s11 * t11;
    const realv t13 = (t1 < (real)0.0 ? (realv)t12 : (realv)t4);
    const realv t14 = (t1 < (real)0.0 ? (realv)t4 : (realv)t12);
    const realv t15 = m->s4 * x.sines + (m->s26 * t13 - m->s27 * t14) * x.cos_phi;
    const realv t16 = m->s7 * x.sines + (m->s26 * t14 + m->s27 * t13) * x.cos_phi;
    const realv t17 = m->s4 * x.cos_r + t13;
    const realv t18 = m->s7 * x.cos_r + t14;
    const realv t19 = t17 * t17 + t18 * t18;
    const realv t20 = (real)1.0 / (m->s30 * t19);
    const realv t21 = (t15 * t15 + t16 * t16) * t20;
    const realv t22 = t13 + x.cos_r;
    const realv t23 = t14 * t14;
    const realv t24 = t22 * t22 + t23;
    const realv t25 = (real)1.0 / (m->s32 * t24);
    const realv t26 = x.cos2_phi * t25;
    const realv t27 = (real)1.0 / (m->s30 * t24);
    const realv t28 = m->s33 * x.sin2_phi * t27;
    const realv t29 = (real)1.0 / (m->s32 * t19);
    const realv t30 = (t13 * t13 + t23) * x.sin2_phi * t29;
    const realv t31 = t21 + t26 + t28 + t30;
    const realv t32 = m->s9 * t31;
    const realv t33 = t10 * t32;
    const realv t34 = t33 * m->A * t8 * m->s17 / ((real)1.0 + t6);
    const realv t35 = t34 * t5 * m->B;
    const realv t36 = t9 * t10;
    const realv t37 = t36 * m->s9;
    const realv t38 = t37 * t29;
    const realv t39 = t38 * t30;
    const realv t40 = t38 * x.sin2_phi;
    const realv t41 = t40 * t13;
    const realv t42 = t37 * t27;
    const realv t43 = t42 * t28;
    const realv t44 = t42 * x.sin2_phi;
    const realv t45 = t44 * m->s26;
    const realv t46 = t37 * t25 * t26;
    const realv t47 = -(t39 * t19) - t46 * t24;
    const realv t48 = -(t43 * m->s30) - t46 * m->s32;
    const realv t49 = (t40 + t48) * t14;
    const realv t50 = t48 * t22;
    const realv t51 = (t44 + t47) * m->s27;
    const realv t52 = t47 * m->s31;
    const realv t53 = t37 * t20;
    const realv t54 = t53 * t21;
    const realv t55 = -(t43 * t24) - t54 * t19;
    const realv t56 = -(t39 * m->s32) - t54 * m->s30;
    const realv t57 = t56 * t18;
    const realv t58 = t57 + t57;
    const realv t59 = t56 * t17;
    const realv t60 = t59 + t59;
    const realv t61 = t55 * m->s29;
    const realv t62 = t61 + t61;
    const realv t63 = t55 * m->s28;
    const realv t64 = t63 + t63;
    const realv t65 = t53 * t16;
    const realv t66 = t65 + t65;
    const realv t67 = t66 * x.cos_phi;
    const realv t68 = t53 * t15;
    const realv t69 = t68 + t68;
    const realv t70 = t69 * x.cos_phi;
    const realv t71 = t51 + t51 + t62 + t67 * t13 - t70 * t14;
    const realv t72 = t49 + t49 + t58 + t67 * m->s26 - t70 * m->s27;
    const realv t73 = t45 + t45 + t52 + t52 + t64 + t67 * t14 + t70 * t13;
    const realv t74 = t41 + t41 + t50 + t50 + t60 + t67 * m->s27 + t70 * m->s26;
    const realv t75 = (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t72) + (t1 < (real)0.0 ? (realv)t74 : (realv)(real)0.0);
    const realv t76 = (t1 < (real)0.0 ? (realv)t72 : (realv)(real)0.0) + (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t74);
    const realv t77 = t75 * t11;
    const realv t78 = (t76 - t77 * t12) * (real)0.5 * t11 * (real)0.5;
    const realv t79 = (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t78) - (t1 < (real)0.0 ? (realv)t78 : (realv)(real)0.0);
    const realv t80 = t78 * (real)0.5 / t2;
    const realv t81 = t80 * t1;
    const realv t82 = (m->s10 < (real)0.0 ? (realv)(real)0.0 : (realv)t71) + (m->s10 < (real)0.0 ? (realv)t73 : (realv)(real)0.0);
    const realv t83 = (m->s10 < (real)0.0 ? (realv)t71 : (realv)(real)0.0) + (m->s10 < (real)0.0 ? (realv)(real)0.0 : (realv)t73);
    const realv t84 = t82 * m->s24;
    const realv t85 = (t83 - t84 * m->s25) * (real)0.5 * m->s24 * (real)0.5;
    const realv t86 = (m->s10 < (real)0.0 ? (realv)(real)0.0 : (realv)t85) - (m->s10 < (real)0.0 ? (realv)t85 : (realv)(real)0.0);
    const realv t87 = t85 * (real)0.5 * m->s34;
    const realv t88 = t87 * m->s10;
    const realv t89 = t58 * x.cos_r + t62 * x.cos_i + t66 * x.sines + (t77 + t84) * (real)0.5;
    const realv t90 = t60 * x.cos_r + t64 * x.cos_i + t79 + t81 + t81 + t86 + t88 + t88 + t69 * x.sines;
    const realv t91 = t36 * t31 * (real)0.5;
    const realv t92 = (t80 + t87 + t91) * m->s7;
    const realv t93 = t89 + t92 + t92;
    const realv t94 = t91 * m->s5;
    const realv t95 = t90 + t94 + t94;
    const realv t96 = t95 * m->k;
    const realv t97 = t95 * m->n;
    const realv t98 = t9 * t32 * x.cosines * m->s22 * m->s23 * m->s2;
    const realv t99 = (-(t34 * m->s18 * m->s21 * t5) - t98 - t98) * m->s1;
    const realv t100 = x.cosines * t31;
    tangent[0] = t100 * t8;
    tangent[1] = t35 + t35;
    tangent[2] = t100 * t7 * t8;
    tangent[3] = t93 * m->k * (real)2.0 + t97 + t97;
    tangent[4] = t93 * m->s6 - t96 - t96;
    tangent[5] = t99 + t99;
    return t33 * t9;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = m->s19;
    factor[1] = (realv)(real)1.0;
    factor[2] = m->s20;
    factor[3] = (realv)(real)1.0;
    factor[4] = (realv)(real)1.0;
    factor[5] = (realv)(real)0.001;
}
