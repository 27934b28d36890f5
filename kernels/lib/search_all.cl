// A search in all coordinates that are free: the energy is log2 of the objective where the chain stands.

#define SEARCHED FREE
#define SOLVED 0

inline int searched(int k) { return free_place[k]; }

inline realv energy_at(realv *p, global const real *restrict rows, global const uint *restrict starts,
                       const uint groups, global const real *restrict target,
                       global const real *restrict scale, global const real *restrict lower,
                       global const real *restrict upper) {
    return log2_of_objective(objective_of(p, rows, starts, groups, target, scale));
}
