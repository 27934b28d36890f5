// Written by 'make kernels' from clbrdf/models/library/lambert.py.
// lambert: Lambert's cosine law
// source: Lambert, Photometria (1760)

typedef struct {
    realv s1;
} model_state;

// What follows from the parameters alone.
inline model_state model_prepare(const realv *p) {
    model_state m;
    m.s1 = p[P_rho] / (real)3.141592653589793;
    return m;
}

// What follows from the incident direction, once for all view directions that share it.
inline void model_incident(model_state *m, const geometry x) {
    (void)m;
    (void)x;
}

inline realv model_brdf(const model_state *m, const geometry x) {
    return m->s1;
}

// Directions that a sum takes side by side.
#define MODEL_SIDE_BY_SIDE 4

// What the linear parameters multiply; for those on a log scale, the product.
inline void model_terms(const model_state *m, const geometry x, realv *term) {
    term[0] = (real)1.0 / (real)3.141592653589793;
}

// f, and ∂f/∂p_j = factor[j] · tangent[tangent_of[j]]; factors do not depend on the view.
#define TANGENTS 1
constant int tangent_of[P] = {0};

inline realv model_tangents(const model_state *m, const geometry x, realv *tangent) {
    tangent[0] = (realv)(real)1.0;
    return m->s1;
}

inline void model_factors(const model_state *m, realv *factor) {
    factor[0] = (real)1.0 / (real)3.141592653589793;
}
