// A fit moves in coordinates q: the parameter itself, or log2 |p| for those on a log scale.

inline realv value_of(int j, realv q) {
    return on_log_scale[j] ? (realv)sign_of[j] * exp2_lanes(q) : q;
}

inline realv coordinate_of(int j, realv p) {
    return on_log_scale[j] ? log2((realv)sign_of[j] * p) : p;
}

// dp/dq at a value p.
inline realv slope_of(int j, realv p) {
    return on_log_scale[j] ? p * (realv)0.6931471805599453 : (realv)1.0;
}

// The smaller (0) or the larger (1) limit of a value, from those of its coordinate.
inline realv bound_of(int j, real lower, real upper, int larger) {
    const int turned = on_log_scale[j] && sign_of[j] < 0;
    return value_of(j, (realv)(larger != turned ? upper : lower));
}
