// Written by 'make kernels' from clbrdf/models/library/ross_li.py.
// ross_li: Ross-thick, Li-sparse kernels
// source: Lucht, Schaaf and Strahler, IEEE TGRS 38 (2000) 977, doi:10.1109/36.841980

typedef struct {
    realv s1;
    realv f_vol;
    realv f_geo;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.s1 = p[P_f_iso] / (real)3.141592653589793;
    m.f_vol = p[P_f_vol];
    m.f_geo = p[P_f_geo];
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s1 + m->f_vol * x.volume + m->f_geo * x.crowns;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = (real)1.0 / (real)3.141592653589793;
    term[1] = x.volume;
    term[2] = x.crowns;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 3
constant int tangent_of[P] = {0, 1, 2};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    tangent[0] = (realv)(real)1.0;
    tangent[1] = x.volume;
    tangent[2] = x.crowns;
    return m->s1 + m->f_vol * x.volume + m->f_geo * x.crowns;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (real)1.0 / (real)3.141592653589793;
    factor[1] = (realv)(real)1.0;
    factor[2] = (realv)(real)1.0;
}
