// Written by 'make kernels' from clbrdf/models/library/rayleigh_rice.py.
// rayleigh_rice: Rayleigh–Rice scatter with a K-correlation spectrum
// source: Church and Takacs, Proc. SPIE 645 (1986) 107; Stover (2012), doi:10.1117/3.975276

typedef struct {
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
    realv A;
    realv s13;
    realv B;
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
    realv s26;
    realv s27;
    realv s28;
    realv s29;
    realv s30;
    realv s31;
    realv s32;
    realv s33;
    realv s34;
    realv s35;
    realv s36;
    realv s37;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    const realv t1 = (real)16.0 * (real)3.141592653589793 * (real)3.141592653589793;
    m.s1 = p[P_wavelength] * (real)0.001;
    m.s2 = m.s1 * m.s1;
    const realv t2 = m.s2 * m.s2;
    m.n = p[P_n];
    m.k = p[P_k];
    m.s3 = m.n * m.n - m.k * m.k;
    m.s4 = m.s3 - (real)1.0;
    m.s5 = (real)2.0 * m.n;
    m.s6 = m.s5 * m.k;
    m.s7 = m.s6 * m.s6;
    m.s8 = (real)0.5 * (m.s4 * m.s4 + m.s7);
    m.s10 = m.s6 * (real)0.5;
    m.A = p[P_A];
    m.s13 = (real)(-0.5) * p[P_C];
    m.B = p[P_B];
    m.s14 = m.B * m.B;
    m.s15 = t1 / t2 * m.s8;
    m.s16 = m.s15 * m.A;
    m.s17 = m.s16 * (real)(-0.5);
    m.s18 = (real)1.0 / m.s2;
    m.s19 = m.s14 * m.s18;
    m.s20 = m.s13 * (real)1.4426950408889634;
    m.s25 = (real)1.0 / t2;
    m.s26 = t1 * m.s25;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->s9 = m->s3 - x.sin2_i;
    const realv t1 = sqrt_lanes(m->s9 * m->s9 + m->s7);
    const realv t2 = (t1 + (m->s9 < (real)0.0 ? (realv)-m->s9 : (realv)m->s9)) * (real)0.5 + (real)1e-30;
    const realv t3 = sqrt_lanes(t2);
    const realv t4 = m->s10 / t3;
    m->s11 = (m->s9 < (real)0.0 ? (realv)t4 : (realv)t3);
    m->s12 = (m->s9 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t5 = m->s3 * x.cos_i;
    const realv t6 = t5 + m->s11;
    const realv t7 = m->s6 * x.cos_i;
    const realv t8 = t7 + m->s12;
    const realv t9 = t6 * t6 + t8 * t8;
    const realv t10 = m->s11 + x.cos_i;
    const realv t11 = m->s12 * m->s12;
    const realv t12 = m->s11 * m->s11 + t11;
    const realv t13 = (real)1.0 / t9;
    m->s21 = m->s16 * t13;
    m->s22 = m->s16 * (real)1.0 / (t10 * t10 + t11);
    m->s23 = m->s16 * t12 / t9;
    m->s24 = m->s16 * t12 * t13;
    m->s27 = (real)1.0 / t3;
    m->s28 = m->s10 * m->s27;
    m->s29 = (m->s9 < (real)0.0 ? (realv)m->s28 : (realv)t3);
    m->s30 = (m->s9 < (real)0.0 ? (realv)t3 : (realv)m->s28);
    m->s31 = t5 + m->s29;
    m->s32 = t7 + m->s30;
    m->s33 = m->s31 * m->s31 + m->s32 * m->s32;
    m->s34 = m->s29 + x.cos_i;
    const realv t14 = m->s30 * m->s30;
    m->s35 = m->s34 * m->s34 + t14;
    m->s36 = m->s29 * m->s29 + t14;
    m->s37 = (real)1.0 / t1;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s3 - x.sin2_r;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s7) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t4 = m->s10 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s3 * x.sines + x.cos_phi * (m->s11 * t5 - m->s12 * t6);
    const realv t8 = m->s6 * x.sines + x.cos_phi * (m->s11 * t6 + m->s12 * t5);
    const realv t9 = m->s3 * x.cos_r + t5;
    const realv t10 = m->s6 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = m->s21 * (t7 * t7 + t8 * t8) * t14 + m->s22 * x.cos2_phi * t11 + m->s23 * x.sin2_phi * t11;
    const realv t16 = x.cosines * exp2_lanes(m->s20 * log1p_lanes(m->s19 * x.x2)) * (t15 + m->s22 * x.sin2_phi * t14 * (t5 * t5 + t13));
    return t16 / (t11 * t14);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s3 - x.sin2_r;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s7) + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1);
    const realv t3 = sqrt_lanes((real)0.5 * t2 + (real)1e-30);
    const realv t4 = m->s10 / t3;
    const realv t5 = (t1 < (real)0.0 ? (realv)t4 : (realv)t3);
    const realv t6 = (t1 < (real)0.0 ? (realv)t3 : (realv)t4);
    const realv t7 = m->s3 * x.sines + x.cos_phi * (m->s11 * t5 - m->s12 * t6);
    const realv t8 = m->s6 * x.sines + x.cos_phi * (m->s11 * t6 + m->s12 * t5);
    const realv t9 = m->s3 * x.cos_r + t5;
    const realv t10 = m->s6 * x.cos_r + t6;
    const realv t11 = t9 * t9 + t10 * t10;
    const realv t12 = t5 + x.cos_r;
    const realv t13 = t6 * t6;
    const realv t14 = t12 * t12 + t13;
    const realv t15 = m->s21 * (t7 * t7 + t8 * t8) * t14 + m->s22 * x.cos2_phi * t11 + m->s24 * x.sin2_phi * t11;
    const realv t16 = x.cosines * exp2_lanes(m->s20 * log1p_lanes(m->s19 * x.x2)) * (t15 + m->s22 * x.sin2_phi * t14 * (t5 * t5 + t13));
    term[0] = t16 / (t11 * t14);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 6
constant int tangent_of[P] = {0, 1, 2, 3, 4, 5};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = m->s3 - x.sin2_r;
    const realv t2 = sqrt_lanes(t1 * t1 + m->s7);
    const realv t3 = (t2 + (t1 < (real)0.0 ? (realv)-t1 : (realv)t1)) * (real)0.5 + (real)1e-30;
    const realv t4 = sqrt_lanes(t3);
    const realv t5 = m->s26 * x.cosines;
    const realv t6 = (real)1.0 / t4;
    const realv t7 = m->s10 * t6;
    const realv t8 = (t1 < (real)0.0 ? (realv)t7 : (realv)t4);
    const realv t9 = (t1 < (real)0.0 ? (realv)t4 : (realv)t7);
    const realv t10 = m->s3 * x.sines + (m->s29 * t8 - m->s30 * t9) * x.cos_phi;
    const realv t11 = m->s6 * x.sines + (m->s29 * t9 + m->s30 * t8) * x.cos_phi;
    const realv t12 = m->s3 * x.cos_r + t8;
    const realv t13 = m->s6 * x.cos_r + t9;
    const realv t14 = t12 * t12 + t13 * t13;
    const realv t15 = (real)1.0 / (m->s33 * t14);
    const realv t16 = (t10 * t10 + t11 * t11) * t15;
    const realv t17 = t8 + x.cos_r;
    const realv t18 = t9 * t9;
    const realv t19 = t17 * t17 + t18;
    const realv t20 = (real)1.0 / (m->s35 * t19);
    const realv t21 = x.cos2_phi * t20;
    const realv t22 = (real)1.0 / (m->s33 * t19);
    const realv t23 = m->s36 * x.sin2_phi * t22;
    const realv t24 = (real)1.0 / (m->s35 * t14);
    const realv t25 = (t8 * t8 + t18) * x.sin2_phi * t24;
    const realv t26 = t16 + t21 + t23 + t25;
    const realv t27 = m->s8 * t26;
    const realv t28 = t5 * t27;
    const realv t29 = x.x2 * m->s18;
    const realv t30 = m->s14 * t29;
    const realv t31 = log1p_lanes(t30);
    const realv t32 = exp_lanes(m->s13 * t31);
    const realv t33 = m->A * t32;
    const realv t34 = t28 * m->A * t32 * m->s13 / ((real)1.0 + t30);
    const realv t35 = t34 * t29 * m->B;
    const realv t36 = t33 * t5;
    const realv t37 = t36 * m->s8;
    const realv t38 = t37 * t24;
    const realv t39 = t38 * t25;
    const realv t40 = t38 * x.sin2_phi;
    const realv t41 = t40 * t8;
    const realv t42 = t37 * t22;
    const realv t43 = t42 * t23;
    const realv t44 = t42 * x.sin2_phi;
    const realv t45 = t44 * m->s29;
    const realv t46 = t37 * t20 * t21;
    const realv t47 = -(t39 * t14) - t46 * t19;
    const realv t48 = -(t43 * m->s33) - t46 * m->s35;
    const realv t49 = (t40 + t48) * t9;
    const realv t50 = t48 * t17;
    const realv t51 = (t44 + t47) * m->s30;
    const realv t52 = t47 * m->s34;
    const realv t53 = t37 * t15;
    const realv t54 = t53 * t16;
    const realv t55 = -(t43 * t19) - t54 * t14;
    const realv t56 = -(t39 * m->s35) - t54 * m->s33;
    const realv t57 = t56 * t13;
    const realv t58 = t57 + t57;
    const realv t59 = t56 * t12;
    const realv t60 = t59 + t59;
    const realv t61 = t55 * m->s32;
    const realv t62 = t61 + t61;
    const realv t63 = t55 * m->s31;
    const realv t64 = t63 + t63;
    const realv t65 = t53 * t11;
    const realv t66 = t65 + t65;
    const realv t67 = t66 * x.cos_phi;
    const realv t68 = t53 * t10;
    const realv t69 = t68 + t68;
    const realv t70 = t69 * x.cos_phi;
    const realv t71 = t51 + t51 + t62 + t67 * t8 - t70 * t9;
    const realv t72 = t49 + t49 + t58 + t67 * m->s29 - t70 * m->s30;
    const realv t73 = t45 + t45 + t52 + t52 + t64 + t67 * t9 + t70 * t8;
    const realv t74 = t41 + t41 + t50 + t50 + t60 + t67 * m->s30 + t70 * m->s29;
    const realv t75 = (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t72) + (t1 < (real)0.0 ? (realv)t74 : (realv)(real)0.0);
    const realv t76 = (t1 < (real)0.0 ? (realv)t72 : (realv)(real)0.0) + (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t74);
    const realv t77 = t75 * t6;
    const realv t78 = (t76 - t77 * t7) * (real)0.5 * t6 * (real)0.5;
    const realv t79 = (t1 < (real)0.0 ? (realv)(real)0.0 : (realv)t78) - (t1 < (real)0.0 ? (realv)t78 : (realv)(real)0.0);
    const realv t80 = t78 * (real)0.5 / t2;
    const realv t81 = t80 * t1;
    const realv t82 = (m->s9 < (real)0.0 ? (realv)(real)0.0 : (realv)t71) + (m->s9 < (real)0.0 ? (realv)t73 : (realv)(real)0.0);
    const realv t83 = (m->s9 < (real)0.0 ? (realv)t71 : (realv)(real)0.0) + (m->s9 < (real)0.0 ? (realv)(real)0.0 : (realv)t73);
    const realv t84 = t82 * m->s27;
    const realv t85 = (t83 - t84 * m->s28) * (real)0.5 * m->s27 * (real)0.5;
    const realv t86 = (m->s9 < (real)0.0 ? (realv)(real)0.0 : (realv)t85) - (m->s9 < (real)0.0 ? (realv)t85 : (realv)(real)0.0);
    const realv t87 = t85 * (real)0.5 * m->s37;
    const realv t88 = t87 * m->s9;
    const realv t89 = t58 * x.cos_r + t62 * x.cos_i + t66 * x.sines + (t77 + t84) * (real)0.5;
    const realv t90 = t60 * x.cos_r + t64 * x.cos_i + t79 + t81 + t81 + t86 + t88 + t88 + t69 * x.sines;
    const realv t91 = t36 * t26 * (real)0.5;
    const realv t92 = (t80 + t87 + t91) * m->s6;
    const realv t93 = t89 + t92 + t92;
    const realv t94 = t91 * m->s4;
    const realv t95 = t90 + t94 + t94;
    const realv t96 = t95 * m->k;
    const realv t97 = t95 * m->n;
    const realv t98 = t33 * t27 * x.cosines * m->s25 * m->s26 * m->s2;
    const realv t99 = (-(t34 * m->s14 * m->s18 * t29) - t98 - t98) * m->s1;
    const realv t100 = x.cosines * t26;
    tangent[0] = t100 * t32;
    tangent[1] = t35 + t35;
    tangent[2] = t100 * t31 * t32;
    tangent[3] = t93 * m->k * (real)2.0 + t97 + t97;
    tangent[4] = t93 * m->s5 - t96 - t96;
    tangent[5] = t99 + t99;
    return t28 * t33;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = m->s15;
    factor[1] = (realv)(real)1.0;
    factor[2] = m->s17;
    factor[3] = (realv)(real)1.0;
    factor[4] = (realv)(real)1.0;
    factor[5] = (realv)(real)0.001;
}
