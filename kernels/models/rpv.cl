// Written by 'make kernels' from clbrdf/models/library/rpv.py.
// rpv: Rahman, Pinty and Verstraete 1993
// source: Rahman, Pinty and Verstraete, J. Geophys. Res. 98 (1993) 20791, doi:10.1029/93JD02072

typedef struct {
    realv rho0;
    realv Theta;
    realv s1;
    realv s2;
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
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.rho0 = p[P_rho0];
    m.Theta = p[P_Theta];
    m.s1 = (real)1.0 - m.Theta * m.Theta;
    m.s2 = m.rho0 * m.s1;
    m.s3 = p[P_k] - (real)1.0;
    m.s4 = (real)1.0 - p[P_rho_c];
    const realv t1 = (m.Theta < (real)0.0 ? (realv)-m.Theta : (realv)m.Theta);
    m.s5 = (real)1.0 - t1;
    m.s6 = m.s5 * m.s5;
    m.s7 = (real)4.0 * t1;
    m.s8 = -m.s2;
    m.s9 = m.s3 * (real)1.4426950408889634;
    m.s10 = m.s2 / (real)3.141592653589793;
    m.s11 = m.s10 * m.s4;
    m.s12 = (real)1.0 / (real)3.141592653589793 * m.s1;
    m.s13 = m.s12 * m.s4;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    const realv t1 = m->s6 + m->s7 * (m->Theta < (real)0.0 ? (realv)x.sin2_d : (realv)x.cos2_d);
    const realv t2 = exp2_lanes(m->s9 * x.log_bowl) * (m->s10 + m->s11 * x.near) / (t1 * sqrt_lanes(t1));
    return t2;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    const realv t1 = m->s6 + m->s7 * (m->Theta < (real)0.0 ? (realv)x.sin2_d : (realv)x.cos2_d);
    const realv t2 = exp2_lanes(m->s9 * x.log_bowl) * (m->s12 + m->s13 * x.near) / (t1 * sqrt_lanes(t1));
    term[0] = t2;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 4
constant int tangent_of[P] = {0, 1, 2, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    const realv t1 = exp_lanes(m->s3 * x.log_bowl);
    const realv t2 = (real)1.0 + m->s4 * x.near;
    const realv t3 = (m->Theta < (real)0.0 ? (realv)x.sin2_d : (realv)x.cos2_d);
    const realv t4 = m->s6 + m->s7 * t3;
    const realv t5 = (real)3.141592653589793 * t4;
    const realv t6 = sqrt_lanes(t4);
    const realv t7 = (real)1.0 / (t5 * t6);
    const realv t8 = t7 * t2 * t1 * m->rho0 * m->Theta;
    const realv t9 = m->s2 * t1 * t2 * t7;
    const realv t10 = t7 * t9;
    const realv t11 = -(t10 * t5 * (real)0.5 / t6) - t10 * t6 * (real)3.141592653589793;
    const realv t12 = t11 * m->s5;
    const realv t13 = t11 * t3 * (real)4.0 - (t12 + t12);
    const realv t14 = (m->Theta < (real)0.0 ? (realv)(real)0.0 : (realv)t13) - (m->Theta < (real)0.0 ? (realv)t13 : (realv)(real)0.0);
    tangent[0] = t1 * t2 * t7;
    tangent[1] = x.log_bowl * t1 * t2 * t7;
    tangent[2] = t14 - t8 - t8;
    tangent[3] = t1 * x.near * t7;
    return t9;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = m->s1;
    factor[1] = m->s2;
    factor[2] = (realv)(real)1.0;
    factor[3] = m->s8;
}
