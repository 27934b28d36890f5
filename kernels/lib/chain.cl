// A Markov chain a lane, moving in the searched coordinates one after the other (Metropolis steps).
//
// The energy is log2 E, so that a temperature (in units of ln E) means the same for a bright and a dark sample
// and for a good and a bad fit. What the search solves itself, energy_at writes into p.
//
// Limits of the coordinates belong to a wavelength, (W, P): a parameter that is given has both at its value.
//
// State, per wavelength w and group g of WIDTH chains, in vectors of WIDTH:
//   q, best, step   (W, G, P)      energy, best_energy, temperature   (W, G)
//   counts          (W, G, 2)      moves taken, and proposals whose E was not finite (refused)
//
// Source of steps and sweeps: Corana, Marchesi, Martini, Ridella, ACM TOMS 13 (1987) 262,
// doi:10.1145/29380.29864.

#define STREAM_START 0u
#define STREAM_MOVES 1u
#define STREAM_EXCHANGE 2u

#define DATA_ARGUMENTS                                                                             \
    global const real *restrict rows, global const uint *restrict starts, const uint incident_groups, \
        const uint n_directions, global const real *restrict target, global const real *restrict scale, \
        global const real *restrict lower_all, global const real *restrict upper_all, const ulong seed, \
        global const uint *restrict wavelength_keys

#define STATE_ARGUMENTS                                                                            \
    global real *restrict q_all, global real *restrict best_all, global real *restrict step_all,   \
        global real *restrict energy_all, global real *restrict best_energy_all,                   \
        global real *restrict temperature_all, global uint *restrict counts

typedef struct {
    realv q[P], p[P], best[P], step[P], taken[P];
    realv energy, best_energy;
    realv not_finite;
    realv sum, sum_of_squares;  // of the energy about its value at the start, against cancellation
} chain;

inline chain load_chain(size_t place, global const real *q_all, global const real *best_all,
                        global const real *step_all, global const real *energy_all,
                        global const real *best_energy_all) {
    chain c;
    for (int j = 0; j < P; ++j) {
        c.q[j] = LOAD(place * P + j, q_all);
        c.p[j] = value_of(j, c.q[j]);
        c.best[j] = LOAD(place * P + j, best_all);
        c.step[j] = LOAD(place * P + j, step_all);
        c.taken[j] = (realv)0.0;
    }
    c.energy = LOAD(place, energy_all);
    c.best_energy = LOAD(place, best_energy_all);
    c.not_finite = c.sum = c.sum_of_squares = (realv)0.0;
    return c;
}

// A start drawn evenly within the limits of the coordinates.
inline void start_chain(size_t place, uint first_chain, uint key, ulong seed, global const real *restrict rows,
                        global const uint *restrict starts, uint incident_groups,
                        global const real *restrict target, global const real *restrict scale,
                        global const real *restrict lower, global const real *restrict upper, STATE_ARGUMENTS) {
    realv q[P], p[P];
    for (int j = 0; j < P; ++j) {
        realv u, unused;
        uniform_lanes(seed, STREAM_START, key, first_chain, j, &u, &unused);
        q[j] = (realv)lower[j] + u * (realv)(upper[j] - lower[j]);
        p[j] = value_of(j, q[j]);
        STORE((realv)(upper[j] - lower[j]), place * P + j, step_all);
    }
    const realv energy = energy_at(p, rows, starts, incident_groups, target, scale, lower, upper);
    for (int i = 0; i < SOLVED; ++i) q[linear_place[i]] = coordinate_of(linear_place[i], p[linear_place[i]]);
    for (int j = 0; j < P; ++j) {
        STORE(q[j], place * P + j, q_all);
        STORE(q[j], place * P + j, best_all);
    }
    STORE(energy, place, energy_all);
    STORE(energy, place, best_energy_all);
    for (uint k = 0; k < 2 * WIDTH; ++k) counts[place * 2 * WIDTH + k] = 0;
}

// `sweeps` steps in each searched coordinate at a temperature.
inline void run_chain(chain *c, realv temperature, uint first_chain, uint first_sweep, uint sweeps, uint key,
                      ulong seed, global const real *restrict rows, global const uint *restrict starts,
                      uint incident_groups, global const real *restrict target,
                      global const real *restrict scale, global const real *restrict lower,
                      global const real *restrict upper) {
    const realv origin = c->energy < (realv)INFINITY ? c->energy : (realv)0.0;
    for (uint sweep = 0; sweep < sweeps; ++sweep) {
        for (int k = 0; k < SEARCHED; ++k) {
            const int j = searched(k);
            realv u, v;
            uniform_lanes(seed, STREAM_MOVES, key, first_chain, (first_sweep + sweep) * SEARCHED + k, &u, &v);
            const realv low = (realv)lower[j], high = (realv)upper[j];
            realv moved = c->q[j] + c->step[j] * ((realv)2.0 * u - (realv)1.0);
            moved = low + fabs(moved - low);     // reflected at the limits: symmetric, and a step is
            moved = high - fabs(high - moved);   // never longer than the range
            realv trial[P];
            for (int i = 0; i < P; ++i) trial[i] = c->p[i];
            const realv q = clamp(moved, low, high);
            trial[j] = value_of(j, q);
            const realv proposed = energy_at(trial, rows, starts, incident_groups, target, scale, lower, upper);
            // False for NaN and for +∞ against +∞: such proposals are refused.
            const integerv accept = (proposed - c->energy) <= -temperature * log2(v);
            c->not_finite += proposed < (realv)INFINITY ? (realv)0.0 : (realv)1.0;
            c->q[j] = accept ? q : c->q[j];
            for (int i = 0; i < SOLVED; ++i) {
                const int place = linear_place[i];
                c->q[place] = accept ? coordinate_of(place, trial[place]) : c->q[place];
            }
            for (int i = 0; i < P; ++i) c->p[i] = accept ? trial[i] : c->p[i];
            c->energy = accept ? proposed : c->energy;
            c->taken[j] += accept ? (realv)1.0 : (realv)0.0;
            const integerv improved = c->energy < c->best_energy;
            c->best_energy = improved ? c->energy : c->best_energy;
            for (int i = 0; i < P; ++i) c->best[i] = improved ? c->q[i] : c->best[i];
            const realv deviation = c->energy < (realv)INFINITY ? c->energy - origin : (realv)0.0;
            c->sum += deviation;
            c->sum_of_squares += deviation * deviation;
        }
    }
}

// Steps for the next sweeps, wider or narrower towards equal numbers of moves taken and refused.
inline realv next_step(const chain *c, int j, uint sweeps, real range) {
    const realv rate = c->taken[j] / (realv)sweeps;
    const realv wider = c->step[j] * ((realv)1.0 + (realv)5.0 * (rate - (realv)0.6));
    const realv narrower = c->step[j] / ((realv)1.0 + (realv)5.0 * ((realv)0.4 - rate));
    const realv next = rate > (realv)0.6 ? wider : (rate < (realv)0.4 ? narrower : c->step[j]);
    return clamp(next, (realv)range * (realv)1e-6, (realv)range);
}

inline void count_moves(const chain *c, size_t place, global uint *restrict counts) {
    realv all_taken = (realv)0.0;
    for (int k = 0; k < SEARCHED; ++k) all_taken += c->taken[searched(k)];
    real tally[2 * WIDTH];
    STORE(all_taken, 0, tally);
    STORE(c->not_finite, 1, tally);
    for (uint k = 0; k < 2 * WIDTH; ++k) counts[place * 2 * WIDTH + k] += (uint)tally[k];
}
