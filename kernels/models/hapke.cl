// Written by 'make kernels' from clbrdf/models/library/hapke.py.
// hapke: Hapke 2012
// source: Hapke, Theory of Reflectance and Emittance Spectroscopy (2012), doi:10.1017/CBO9781139025683

typedef struct {
    realv w;
    realv s1;
    realv s2;
    realv s3;
    realv s4;
    realv s5;
    realv b;
    realv s6;
    realv c;
    realv s7;
    realv s8;
    realv s9;
    realv s10;
    realv B0;
    realv h;
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
    realv s26;
    realv s27;
    realv s28;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.w = p[P_w];
    const realv t1 = (real)4.0 * (real)3.141592653589793;
    m.s1 = m.w / t1;
    m.s2 = tan(p[P_theta_bar] * (real)3.141592653589793 / (real)180.0);
    m.s3 = ((real)1e-12 < m.s2 ? (realv)m.s2 : (realv)(real)1e-12);
    const realv t2 = (real)3.141592653589793 * m.s3 * m.s3;
    m.s4 = (real)1.0 / sqrt_lanes((real)1.0 + t2);
    m.s5 = (real)1.0 / t2;
    const realv t3 = (real)3.141592653589793 * m.s3;
    m.b = p[P_b];
    m.s6 = (real)1.0 - m.b * m.b;
    m.c = p[P_c];
    m.s7 = (real)1.0 - m.c;
    m.s8 = (real)1.0 - m.b;
    m.s9 = m.s8 * m.s8;
    m.s10 = (real)4.0 * m.b;
    m.B0 = p[P_B0];
    m.h = p[P_h];
    m.s11 = m.B0 * m.h;
    const realv t4 = sqrt_lanes((real)1.0 - m.w);
    const realv t5 = (real)1.0 - t4;
    const realv t6 = (real)1.0 + t4;
    m.s12 = t5 / t6;
    m.s13 = (real)0.005555555555555556 * ((real)1.0 + m.s2 * m.s2) * (real)3.141592653589793;
    m.s14 = -(m.s5 * (real)1.4426950408889634);
    m.s15 = -((real)2.0 / t3 * (real)1.4426950408889634);
    m.s16 = m.s7 * m.s9;
    m.s17 = m.s7 * m.s10;
    m.s18 = m.c * m.s9;
    m.s19 = m.c * m.s10;
    m.s20 = m.w * m.s4;
    m.s21 = m.s12 * m.s4;
    m.s22 = (real)1.0 / m.s4;
    m.s23 = m.w * (real)1.0 / t1;
    m.s24 = (real)1.0 / t3;
    m.s25 = (real)2.0 * m.s24;
    m.s26 = (real)1.0 / t6;
    m.s27 = t5 * m.s26;
    m.s28 = (real)1.0 / t4;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s9 + m->s10 * x.cos2_d;
    const realv t2 = sqrt_lanes(t1);
    const realv t3 = m->s9 + m->s10 * x.sin2_d;
    const realv t4 = sqrt_lanes(t3);
    const realv t5 = m->h + x.tan_d;
    const realv t6 = exp2_falling(m->s14 * x.cot2_large);
    const realv t7 = exp2_falling(m->s14 * x.cot2_small);
    const realv t8 = x.sin2_p * t7;
    const realv t9 = (real)2.0 - exp2_falling(m->s15 * x.cot_large);
    const realv t10 = exp2_falling(m->s15 * x.cot_small);
    const realv t11 = t9 - x.turn * t10;
    const realv t12 = x.cos_small * t11 + m->s3 * x.sin_small * (x.cos_phi * t6 + t8);
    const realv t13 = x.cos_large * t11 + m->s3 * x.sin_large * (t6 - t8);
    const realv t14 = (real)2.0 - t10;
    const realv t15 = x.less_azimuth * (x.cos_small * t14 + m->s3 * x.sin_small * t7) + x.cos_small * x.azimuth * t14;
    const realv t16 = (real)0.5 * t11;
    const realv t17 = m->s22 * t11;
    const realv t18 = m->s12 * t11;
    const realv t19 = t11 * t11;
    const realv t20 = t19 - m->s20 * t12 * (t18 + (t16 - m->s21 * t12) * log1p_lanes(t17 / t12));
    const realv t21 = t19 - m->s20 * t13 * (t18 + (t16 - m->s21 * t13) * log1p_lanes(t17 / t13));
    const realv t22 = (t4 * (m->s16 + m->s17 * x.sin2_d) + t2 * (m->s18 + m->s19 * x.cos2_d)) * (t5 + m->s11);
    const realv t23 = t1 * t2 * t3 * t4 * t5;
    const realv t24 = t23 * t11 * (t12 + t13) * (x.cos_large * t9 + m->s3 * x.sin_large * t6);
    const realv t25 = t9 * t12 * t13 * t14 * (m->s6 * t22 * t20 * t21 + t23 * (t19 * t19 - t20 * t21));
    return m->s1 * t25 / (t24 * t15 * t20 * t21);
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 1

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 6
constant int tangent_of[P] = {0, 1, 2, 3, 4, 5};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = x.sin_small * m->s3;
    const realv t2 = exp_lanes(-(m->s5 * x.cot2_large));
    const realv t3 = exp_lanes(-(m->s5 * x.cot2_small));
    const realv t4 = x.sin2_p * t3;
    const realv t5 = x.cos_phi * t2 + t4;
    const realv t6 = x.sin_large * m->s3;
    const realv t7 = t2 - t4;
    const realv t8 = m->s9 + m->s10 * x.cos2_d;
    const realv t9 = sqrt_lanes(t8);
    const realv t10 = m->s9 + m->s10 * x.sin2_d;
    const realv t11 = sqrt_lanes(t10);
    const realv t12 = exp_lanes(-(m->s25 * x.cot_large));
    const realv t13 = (real)2.0 - t12;
    const realv t14 = exp_lanes(-(m->s25 * x.cot_small));
    const realv t15 = (real)1.0 / (t13 - x.turn * t14);
    const realv t16 = t1 * t5 * t15;
    const realv t17 = x.cos_small + t16;
    const realv t18 = m->s4 * t17;
    const realv t19 = t6 * t7 * t15;
    const realv t20 = x.cos_large + t19;
    const realv t21 = m->s4 * t20;
    const realv t22 = t18 * t21;
    const realv t23 = t18 + t21;
    const realv t24 = (real)1.0 / ((real)2.0 - t14);
    const realv t25 = t1 * t3 * t24;
    const realv t26 = x.cos_small + t25;
    const realv t27 = m->s4 * t26;
    const realv t28 = t23 * t27;
    const realv t29 = (real)1.0 / t13;
    const realv t30 = t6 * t2 * t29;
    const realv t31 = x.cos_large + t30;
    const realv t32 = m->s4 * t31;
    const realv t33 = t28 * t32;
    const realv t34 = (real)1.0 / t27;
    const realv t35 = x.azimuth * m->s4 * x.cos_small * t34;
    const realv t36 = x.less_azimuth + t35;
    const realv t37 = (real)1.0 / (t33 * t36);
    const realv t38 = t22 * m->s4 * t37;
    const realv t39 = m->s23 * t38;
    const realv t40 = (real)1.0 / (t8 * t9);
    const realv t41 = m->s7 * t40;
    const realv t42 = (real)1.0 / (t10 * t11);
    const realv t43 = m->c * t42;
    const realv t44 = t41 + t43;
    const realv t45 = m->s6 * t44;
    const realv t46 = (real)1.0 / (m->h + x.tan_d);
    const realv t47 = m->s11 * t46;
    const realv t48 = (real)1.0 + t47;
    const realv t49 = m->w * t18;
    const realv t50 = (real)0.5 - m->s27 * t18;
    const realv t51 = (real)1.0 / t18;
    const realv t52 = log1p_lanes(t51);
    const realv t53 = m->s27 + t50 * t52;
    const realv t54 = (real)1.0 / ((real)1.0 - t49 * t53);
    const realv t55 = m->w * t21;
    const realv t56 = (real)0.5 - m->s27 * t21;
    const realv t57 = (real)1.0 / t21;
    const realv t58 = log1p_lanes(t57);
    const realv t59 = m->s27 + t56 * t58;
    const realv t60 = (real)1.0 / ((real)1.0 - t55 * t59);
    const realv t61 = t45 * t48 + t54 * t60 - (real)1.0;
    const realv t62 = t39 * t54 * t60 * t60;
    const realv t63 = t62 * t59;
    const realv t64 = t62 * t55;
    const realv t65 = t64 * t58;
    const realv t66 = -(t64 * t56 / ((real)1.0 + t57) * t57 * t57) - t65 * m->s27 + t63 * m->w;
    const realv t67 = t39 * t60 * t54 * t54;
    const realv t68 = t67 * t53;
    const realv t69 = t67 * t49;
    const realv t70 = t69 * t52;
    const realv t71 = (t64 - t65 * t21 + t69 - t70 * t18) * m->s26;
    const realv t72 = -(t69 * t50 / ((real)1.0 + t51) * t51 * t51) - t70 * m->s27 + t68 * m->w;
    const realv t73 = t39 * t48;
    const realv t74 = t39 * t45 * t46;
    const realv t75 = t73 * m->s6;
    const realv t76 = t75 * t42;
    const realv t77 = t76 * t43;
    const realv t78 = -(t77 * t11) - t77 * t10 * (real)0.5 / t11;
    const realv t79 = t75 * t40;
    const realv t80 = t79 * t41;
    const realv t81 = -(t80 * t9) - t80 * t8 * (real)0.5 / t9;
    const realv t82 = (t78 + t81) * m->s8;
    const realv t83 = t73 * t44 * m->b;
    const realv t84 = (t78 * x.sin2_d + t81 * x.cos2_d) * (real)4.0 - (t82 + t82) - t83 - t83;
    const realv t85 = t61 * m->s23 * t37;
    const realv t86 = t85 * t38;
    const realv t87 = t86 * t36;
    const realv t88 = t86 * t33 * t34;
    const realv t89 = t87 * t32;
    const realv t90 = t87 * t28;
    const realv t91 = t90 * m->s4 * t29;
    const realv t92 = t89 * t27;
    const realv t93 = t88 * t35 - t89 * t23;
    const realv t94 = t93 * m->s4 * t24;
    const realv t95 = t85 * m->s4;
    const realv t96 = t72 - t92 + t95 * t21;
    const realv t97 = t66 - t92 + t95 * t18;
    const realv t98 = -(t88 * x.cos_small * x.azimuth) - t90 * t31 + t93 * t26 + t85 * t22 + t97 * t20;
    const realv t99 = t97 * m->s4 * t15;
    const realv t100 = t99 * t6;
    const realv t101 = t96 * m->s4 * t15;
    const realv t102 = -(t99 * t19) - t101 * t16;
    const realv t103 = -((t94 * t25 - t102 * x.turn) * t14 * x.cot_small) + (t91 * t30 + t102) * t12 * x.cot_large;
    const realv t104 = (-(t91 * t2) + t99 * t7) * x.sin_large - t103 * m->s24 * m->s25 * (real)3.141592653589793;
    const realv t105 = t101 * t1;
    const realv t106 = -((t94 * t1 + (-t100 + t105) * x.sin2_p) * t3 * x.cot2_small) - (-(t91 * t6) + t100 + t105 * x.cos_phi) * t2 * x.cot2_large;
    const realv t107 = -(t106 * m->s5 * m->s5) - (t98 + t96 * t17) * m->s4 * m->s4 * (real)0.5 * m->s4;
    const realv t108 = t107 * (real)3.141592653589793 * m->s3;
    const realv t109 = ((real)1e-12 < m->s2 ? (realv)(t104 + (t94 * t3 + t101 * t5) * x.sin_small + t108 + t108) : (realv)(real)0.0);
    const realv t110 = t63 * t21 - (-(t71 * m->s27) - t71) * (real)0.5 * m->s28 + t68 * t18 + t61 * t38 * (real)1.0 / ((real)4.0 * (real)3.141592653589793);
    tangent[0] = t110;
    tangent[1] = t84;
    tangent[2] = t76 - t79;
    tangent[3] = t109;
    tangent[4] = -(t74 * t47) + t74 * m->B0;
    tangent[5] = t74;
    return t39 * t61;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = m->s13;
    factor[4] = (realv)(real)1.0;
    factor[5] = m->h;
}
