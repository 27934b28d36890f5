// A fit moves in coordinates q: the parameter itself, or log2 |p| for those on a log scale.

inline realv value_of(int j, realv q) {
    return on_log_scale[j] ? (realv)sign_of[j] * exp2_lanes(q) : q;
}

// dp/dq at a value p.
inline realv slope_of(int j, realv p) {
    return on_log_scale[j] ? p * (realv)0.6931471805599453 : (realv)1.0;
}
