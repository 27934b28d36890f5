// What the detector sees of a measured direction: the weighted sum over nodes, which come in groups of one incident
// direction each.
//
//   rows     (K, F)   of the nodes
//   first    (N + 1)  where the groups of each measured direction begin
//   node     (B + 1)  where the nodes of each group begin
//   weight   (K)
//
// The same functions as in seen_point.cl. Factors differ from node to node: tangents are the derivatives by the
// parameters themselves.

typedef struct {
    global const real *rows;
    global const uint *first;
    global const uint *node;
    global const real *weight;
} observation;

#define OBSERVATION                                                                                        \
    global const real *restrict rows, global const uint *restrict first, global const uint *restrict node, \
        global const real *restrict weight
#define OBSERVED \
    { rows, first, node, weight }

inline void seen_incident(model_state *m, const observation *o, const uint n) {
    (void)m;
    (void)o;
    (void)n;
}

inline realv seen_brdf(model_state *m, const observation *o, const uint n) {
    realv f = (realv)0.0;
    for (uint b = o->first[n]; b < o->first[n + 1]; ++b) {
        model_incident(m, geometry_of(o->rows, o->node[b]));
        for (uint k = o->node[b]; k < o->node[b + 1]; ++k)
            f += (realv)o->weight[k] * model_brdf(m, geometry_of(o->rows, k));
    }
    return f;
}

#define SEEN_TANGENTS P

inline int seen_tangent(const int j) { return j; }

inline realv seen_tangents(model_state *m, const observation *o, const uint n, realv *tangent) {
    realv f = (realv)0.0;
    for (int j = 0; j < P; ++j) tangent[j] = (realv)0.0;
    for (uint b = o->first[n]; b < o->first[n + 1]; ++b) {
        realv sum[TANGENTS], factor[P];
        for (int i = 0; i < TANGENTS; ++i) sum[i] = (realv)0.0;
        model_incident(m, geometry_of(o->rows, o->node[b]));
        for (uint k = o->node[b]; k < o->node[b + 1]; ++k) {
            const realv w = (realv)o->weight[k];
            realv part[TANGENTS];
            f += w * model_tangents(m, geometry_of(o->rows, k), part);
            for (int i = 0; i < TANGENTS; ++i) sum[i] += w * part[i];
        }
        model_factors(m, factor);
        for (int j = 0; j < P; ++j) tangent[j] += factor[j] * sum[tangent_of[j]];
    }
    return f;
}

inline void seen_factors(const model_state *m, realv *factor) {
    (void)m;
    for (int j = 0; j < P; ++j) factor[j] = (realv)1.0;
}
