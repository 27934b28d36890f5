// What the detector sees of a measured direction: the direction itself.
//
// One of three files with the same functions: of a point, of nodes that share its incident direction
// (seen_nodes.cl), of nodes with incident directions of their own (seen_beams.cl).

typedef struct {
    global const real *rows;
} observation;

#define OBSERVATION global const real *restrict rows
#define OBSERVED \
    { rows }

// What follows from the incident direction of measured direction n, once for all that share it.
inline void seen_incident(model_state *m, const observation *o, const uint n) {
    model_incident(m, geometry_of(o->rows, n));
}

inline realv seen_brdf(model_state *m, const observation *o, const uint n) {
    return model_brdf(m, geometry_of(o->rows, n));
}

// f, and ∂f/∂p_j = factor[j] · tangent[seen_tangent(j)]; factors do not depend on the view.
#define SEEN_TANGENTS TANGENTS

inline int seen_tangent(const int j) { return tangent_of[j]; }

inline realv seen_tangents(model_state *m, const observation *o, const uint n, realv *tangent) {
    return model_tangents(m, geometry_of(o->rows, n), tangent);
}

inline void seen_factors(const model_state *m, realv *factor) { model_factors(m, factor); }
