// Wang, Zhang and Dong 2013, equations (8)-(12), written by hand; the physics is told in
// clbrdf/models/library/wang2013.py, and tests/models holds this file to it.
//
//   f = exp2(log2 e · (c v^d + a (b − cosθi)²) + log2(G / (π cosθi cosθr)) + log2 ks) + kd / π
//
//   error    double: 1e-12 relative wherever f > 1e-30 (tests/models/test_wang2013.py, mpmath)
//   domain   the bounds of the parameter table; features of clbrdf/models/tuned/wang2013.py, finite

typedef struct {
    // a and c times log2 e, kd / π; b − cosθi and log2 (ks F), set by model_incident
    realv a, b, away;
    realv c, d, log2_ks, level;
    realv diffuse;
    realv a_twice, inverse_ks;  // used by the gradient only
} model_state;

inline model_state model_prepare(const realv *p) {
    const real log2_e = (real)1.4426950408889634;
    model_state m;
    m.a = p[P_a] * log2_e;
    m.b = p[P_b];
    m.c = p[P_c] * log2_e;
    m.d = p[P_d];
    m.log2_ks = p[P_ks] > (realv)0.0 ? log2(p[P_ks]) : (realv)LOG2_OF_ZERO;
    m.diffuse = p[P_kd] * (real)0.31830988618379067;
    m.a_twice = (real)2.0 * p[P_a];
    m.inverse_ks = (real)1.0 / p[P_ks];
    return m;
}

// What follows from the incident direction alone, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    m->away = m->b - x.cos_i;
    m->level = m->a * m->away * m->away + m->log2_ks;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    // v ≤ 1
    realv power = exp2_falling(m->d * x.log2_v);
    return exp2_lanes(m->c * power + (m->level + x.log2_s)) + m->diffuse;
}

// The same for UNROLL view directions side by side, stage by stage: their long chains of dependent operations
// overlap.
#define MODEL_UNROLLED
inline void model_brdf_unrolled(const model_state *m, const geometry *x, realv *f) {
    for (int k = 0; k < UNROLL; ++k) f[k] = exp2_falling(m->d * x[k].log2_v);
    for (int k = 0; k < UNROLL; ++k) f[k] = exp2_lanes(m->c * f[k] + (m->level + x[k].log2_s));
    for (int k = 0; k < UNROLL; ++k) f[k] += m->diffuse;
}

// What ks and kd multiply, times them: both are on a log scale.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    realv power = exp2_falling(m->d * x.log2_v);
    term[0] = exp2_lanes(m->c * power + (m->level + x.log2_s));
    term[1] = m->diffuse;
}

// ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]: tangents change from one view direction to the next, factors
// (∂f/∂p for a tangent of 1) only with the incident direction. Both need ks > 0.
#define TANGENTS 4
constant int tangent_of[P] = {0, 0, 1, 2, 0, 3};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    realv power = exp2_falling(m->d * x.log2_v);
    realv drop = m->c * power;
    realv lobe = exp2_lanes(drop + (m->level + x.log2_s));
    tangent[0] = lobe;
    tangent[1] = lobe * power;
    tangent[2] = lobe * drop * x.log2_v;
    tangent[3] = (realv)1.0;
    return lobe + m->diffuse;
}

inline void model_factors(const model_state *m, realv *factor) {
    const real ln_2 = (real)0.6931471805599453;
    factor[P_a] = m->away * m->away;
    factor[P_b] = m->a_twice * m->away;
    factor[P_c] = (realv)1.0;
    factor[P_d] = (realv)(ln_2 * ln_2);
    factor[P_ks] = m->inverse_ks;
    factor[P_kd] = (realv)0.31830988618379067;
}

#ifdef FEATURES_ON_DEVICE
// Features of a direction on the device, for meshes that follow a slider.
inline geometry geometry_of_direction(const direction v) {
    const realv floor_of_log = (realv)LOG2_OF_ZERO;
    const realv cosines = v.cos_i * v.cos_r;
    const realv one_minus_cos_gamma = v.sin2_gamma / ((realv)1 + sqrt((realv)1 - v.sin2_gamma));
    geometry x;
    x.cos_i = v.cos_i;
    x.log2_v = max(log2(one_minus_cos_gamma), floor_of_log);
    x.log2_s = max(log2(v.attenuation * (real)0.31830988618379067 / (cosines * cosines)), floor_of_log);
    return x;
}
#endif

#ifdef CAREFUL
// The same with the exponent in pairs; p holds a log2 e, b, c log2 e, d, log2 ks, kd / π.
inline realv model_brdf_careful(const pair *p, const geometry x, const geometry rest) {
    const pair minus_cos_i = {-x.cos_i, -rest.cos_i};
    const pair log2_v = {x.log2_v, rest.log2_v}, log2_s = {x.log2_s, rest.log2_s};
    const pair away = pair_sum(p[P_b], minus_cos_i);
    pair level = pair_sum(p[P_ks], log2_s);
    level = pair_sum(pair_product(p[P_a], pair_product(away, away)), level);
    const pair drop = pair_product(p[P_c], exp2_pair(pair_product(p[P_d], log2_v)));
    return exp2_of_pair(pair_sum(drop, level)) + p[P_kd].hi;
}
#endif
