// What the detector sees of a measured direction: the weighted sum over nodes that share its incident direction.
//
//   rows     (K, F)   of the nodes
//   first    (N + 1)  where the nodes of each measured direction begin
//   weight   (K)
//
// The same functions as in seen_point.cl.

typedef struct {
    global const real *rows;
    global const uint *first;
    global const real *weight;
} observation;

#define OBSERVATION \
    global const real *restrict rows, global const uint *restrict first, global const real *restrict weight
#define OBSERVED \
    { rows, first, weight }

inline void seen_incident(model_state *m, const observation *o, const uint n) {
    model_incident(m, geometry_of(o->rows, o->first[n]));
}

inline realv seen_brdf(model_state *m, const observation *o, const uint n) {
    realv f = (realv)0.0;
    for (uint k = o->first[n]; k < o->first[n + 1]; ++k)
        f += (realv)o->weight[k] * model_brdf(m, geometry_of(o->rows, k));
    return f;
}

#define SEEN_TANGENTS TANGENTS

inline int seen_tangent(const int j) { return tangent_of[j]; }

inline realv seen_tangents(model_state *m, const observation *o, const uint n, realv *tangent) {
    realv f = (realv)0.0;
    for (int i = 0; i < TANGENTS; ++i) tangent[i] = (realv)0.0;
    for (uint k = o->first[n]; k < o->first[n + 1]; ++k) {
        const realv w = (realv)o->weight[k];
        realv part[TANGENTS];
        f += w * model_tangents(m, geometry_of(o->rows, k), part);
        for (int i = 0; i < TANGENTS; ++i) tangent[i] += w * part[i];
    }
    return f;
}

inline void seen_factors(const model_state *m, realv *factor) { model_factors(m, factor); }
