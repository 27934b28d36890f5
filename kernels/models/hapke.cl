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
    realv s6;
    realv s7;
    realv s8;
    realv s9;
    realv b;
    realv s10;
    realv c;
    realv s11;
    realv s12;
    realv s13;
    realv s14;
    realv B0;
    realv h;
    realv s15;
    realv s16;
    realv s17;
    realv s18;
    realv s19;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.w = p[P_w];
    m.s1 = m.w / ((real)4.0 * (real)3.141592653589793);
    m.s2 = tan(p[P_theta_bar] * (real)3.141592653589793 / (real)180.0);
    m.s3 = ((real)1e-12 < m.s2 ? (realv)m.s2 : (realv)(real)1e-12);
    m.s4 = (real)3.141592653589793 * m.s3 * m.s3;
    m.s5 = sqrt((real)1.0 + m.s4);
    m.s6 = (real)1.0 / m.s5;
    m.s7 = (real)1.0 / m.s4;
    m.s8 = (real)3.141592653589793 * m.s3;
    m.s9 = (real)2.0 / m.s8;
    m.b = p[P_b];
    m.s10 = (real)1.0 - m.b * m.b;
    m.c = p[P_c];
    m.s11 = (real)1.0 - m.c;
    m.s12 = (real)1.0 - m.b;
    m.s13 = m.s12 * m.s12;
    m.s14 = (real)4.0 * m.b;
    m.B0 = p[P_B0];
    m.h = p[P_h];
    m.s15 = m.B0 * m.h;
    m.s16 = sqrt((real)1.0 - m.w);
    m.s17 = (real)1.0 + m.s16;
    m.s18 = ((real)1.0 - m.s16) / m.s17;
    m.s19 = (real)0.005555555555555556 * ((real)1.0 + m.s2 * m.s2) * (real)3.141592653589793;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = x.sin_small * m->s3;
    const realv t2 = exp_lanes(-(m->s7 * x.cot2_large));
    const realv t3 = exp_lanes(-(m->s7 * x.cot2_small));
    const realv t4 = x.sin2_p * t3;
    const realv t5 = (real)2.0 - exp_lanes(-(m->s9 * x.cot_large));
    const realv t6 = exp_lanes(-(m->s9 * x.cot_small));
    const realv t7 = t5 - x.turn * t6;
    const realv t8 = m->s6 * (x.cos_small + t1 * (x.cos_phi * t2 + t4) / t7);
    const realv t9 = x.sin_large * m->s3;
    const realv t10 = m->s6 * (x.cos_large + t9 * (t2 - t4) / t7);
    const realv t11 = m->s6 * (x.cos_small + t1 * t3 / ((real)2.0 - t6));
    const realv t12 = (t8 + t10) * t11 * m->s6 * (x.cos_large + t9 * t2 / t5) * (x.less_azimuth + x.azimuth * m->s6 * x.cos_small / t11);
    const realv t13 = m->s13 + m->s14 * x.cos2_d;
    const realv t14 = m->s13 + m->s14 * x.sin2_d;
    const realv t15 = m->s10 * (m->s11 / (t13 * sqrt(t13)) + m->c / (t14 * sqrt(t14))) * ((real)1.0 + m->s15 / (m->h + x.tan_d));
    const realv t16 = m->w * t8 * (m->s18 + ((real)0.5 - m->s18 * t8) * log1p_lanes((real)1.0 / t8));
    const realv t17 = m->w * t10 * (m->s18 + ((real)0.5 - m->s18 * t10) * log1p_lanes((real)1.0 / t10));
    const realv t18 = (real)1.0 / ((real)1.0 - t16) * (real)1.0 / ((real)1.0 - t17) - (real)1.0;
    return m->s1 * t8 * t10 * m->s6 / t12 * (t15 + t18);
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 6
constant int tangent_of[P] = {0, 1, 2, 3, 4, 5};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = x.sin_small * m->s3;
    const realv t2 = exp_lanes(-(m->s7 * x.cot2_large));
    const realv t3 = exp_lanes(-(m->s7 * x.cot2_small));
    const realv t4 = x.sin2_p * t3;
    const realv t5 = x.cos_phi * t2 + t4;
    const realv t6 = exp_lanes(-(m->s9 * x.cot_large));
    const realv t7 = (real)2.0 - t6;
    const realv t8 = exp_lanes(-(m->s9 * x.cot_small));
    const realv t9 = t7 - x.turn * t8;
    const realv t10 = t1 * t5 / t9;
    const realv t11 = x.cos_small + t10;
    const realv t12 = m->s6 * t11;
    const realv t13 = x.sin_large * m->s3;
    const realv t14 = t2 - t4;
    const realv t15 = t13 * t14 / t9;
    const realv t16 = x.cos_large + t15;
    const realv t17 = m->s6 * t16;
    const realv t18 = t12 * t17;
    const realv t19 = t12 + t17;
    const realv t20 = (real)2.0 - t8;
    const realv t21 = t1 * t3 / t20;
    const realv t22 = x.cos_small + t21;
    const realv t23 = m->s6 * t22;
    const realv t24 = t19 * t23;
    const realv t25 = t13 * t2 / t7;
    const realv t26 = x.cos_large + t25;
    const realv t27 = m->s6 * t26;
    const realv t28 = t24 * t27;
    const realv t29 = x.azimuth * m->s6 * x.cos_small / t23;
    const realv t30 = x.less_azimuth + t29;
    const realv t31 = t28 * t30;
    const realv t32 = t18 * m->s6 / t31;
    const realv t33 = m->s1 * t32;
    const realv t34 = m->s13 + m->s14 * x.cos2_d;
    const realv t35 = sqrt(t34);
    const realv t36 = t34 * t35;
    const realv t37 = m->s11 / t36;
    const realv t38 = m->s13 + m->s14 * x.sin2_d;
    const realv t39 = sqrt(t38);
    const realv t40 = t38 * t39;
    const realv t41 = m->c / t40;
    const realv t42 = t37 + t41;
    const realv t43 = m->s10 * t42;
    const realv t44 = m->h + x.tan_d;
    const realv t45 = m->s15 / t44;
    const realv t46 = (real)1.0 + t45;
    const realv t47 = m->w * t12;
    const realv t48 = (real)0.5 - m->s18 * t12;
    const realv t49 = (real)1.0 / t12;
    const realv t50 = log1p_lanes(t49);
    const realv t51 = m->s18 + t48 * t50;
    const realv t52 = (real)1.0 - t47 * t51;
    const realv t53 = (real)1.0 / t52;
    const realv t54 = m->w * t17;
    const realv t55 = (real)0.5 - m->s18 * t17;
    const realv t56 = (real)1.0 / t17;
    const realv t57 = log1p_lanes(t56);
    const realv t58 = m->s18 + t55 * t57;
    const realv t59 = (real)1.0 - t54 * t58;
    const realv t60 = (real)1.0 / t59;
    const realv t61 = t43 * t46 + t53 * t60 - (real)1.0;
    const realv t62 = t33 * t53 / t59 * t60;
    const realv t63 = t62 * t58;
    const realv t64 = t62 * t54;
    const realv t65 = t64 * t57;
    const realv t66 = -(t64 * t55 / ((real)1.0 + t56) / t17 * t56) - t65 * m->s18 + t63 * m->w;
    const realv t67 = t33 * t60 / t52 * t53;
    const realv t68 = t67 * t51;
    const realv t69 = t67 * t47;
    const realv t70 = t69 * t50;
    const realv t71 = (t64 - t65 * t17 + t69 - t70 * t12) / m->s17;
    const realv t72 = -(t69 * t48 / ((real)1.0 + t49) / t12 * t49) - t70 * m->s18 + t68 * m->w;
    const realv t73 = t33 * t46;
    const realv t74 = t33 * t43 / t44;
    const realv t75 = t73 * m->s10;
    const realv t76 = t75 / t40;
    const realv t77 = t76 * t41;
    const realv t78 = -(t77 * t39) - t77 * t38 * (real)0.5 / t39;
    const realv t79 = t75 / t36;
    const realv t80 = t79 * t37;
    const realv t81 = -(t80 * t35) - t80 * t34 * (real)0.5 / t35;
    const realv t82 = (t78 + t81) * m->s12;
    const realv t83 = t73 * t42 * m->b;
    const realv t84 = (t78 * x.sin2_d + t81 * x.cos2_d) * (real)4.0 - (t82 + t82) - t83 - t83;
    const realv t85 = t61 * m->s1 / t31;
    const realv t86 = t85 * t32;
    const realv t87 = t86 * t30;
    const realv t88 = t86 * t28 / t23;
    const realv t89 = t87 * t27;
    const realv t90 = t87 * t24;
    const realv t91 = t90 * m->s6 / t7;
    const realv t92 = t89 * t23;
    const realv t93 = t88 * t29 - t89 * t19;
    const realv t94 = t93 * m->s6 / t20;
    const realv t95 = t85 * m->s6;
    const realv t96 = t72 - t92 + t95 * t17;
    const realv t97 = t66 - t92 + t95 * t12;
    const realv t98 = -(t88 * x.cos_small * x.azimuth) - t90 * t26 + t93 * t22 + t85 * t18 + t97 * t16;
    const realv t99 = t97 * m->s6 / t9;
    const realv t100 = t99 * t13;
    const realv t101 = t96 * m->s6 / t9;
    const realv t102 = -(t99 * t15) - t101 * t10;
    const realv t103 = -((t94 * t21 - t102 * x.turn) * t8 * x.cot_small) + (t91 * t25 + t102) * t6 * x.cot_large;
    const realv t104 = (-(t91 * t2) + t99 * t14) * x.sin_large - t103 / m->s8 * m->s9 * (real)3.141592653589793;
    const realv t105 = t101 * t1;
    const realv t106 = -((t94 * t1 + (-t100 + t105) * x.sin2_p) * t3 * x.cot2_small) - (-(t91 * t13) + t100 + t105 * x.cos_phi) * t2 * x.cot2_large;
    const realv t107 = -(t106 / m->s4 * m->s7) - (t98 + t96 * t11) / m->s5 * m->s6 * (real)0.5 / m->s5;
    const realv t108 = t107 * (real)3.141592653589793 * m->s3;
    const realv t109 = ((real)1e-12 < m->s2 ? (realv)(t104 + (t94 * t3 + t101 * t5) * x.sin_small + t108 + t108) : (realv)(real)0.0);
    const realv t110 = t63 * t17 - (-(t71 * m->s18) - t71) * (real)0.5 / m->s16 + t68 * t12 + t61 * t32 / ((real)4.0 * (real)3.141592653589793);
    tangent[0] = t110;
    tangent[1] = t84;
    tangent[2] = t76 - t79;
    tangent[3] = t109;
    tangent[4] = -(t74 * t45) + t74 * m->B0;
    tangent[5] = t74;
    return t33 * t61;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (realv)(real)1.0;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
    factor[3] = m->s19;
    factor[4] = (realv)(real)1.0;
    factor[5] = m->h;
}
