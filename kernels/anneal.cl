// Simulated annealing of many chains at many wavelengths, one chain a lane.
//
// One launch runs one temperature level of every chain: `sweeps` times a Metropolis step in each
// coordinate in turn. The energy is ln E, so that a temperature means the same for a bright and a dark
// sample and for a good and a bad fit. At the end of a level each chain on its own
//   - widens or narrows its step in each coordinate towards equal numbers of moves taken and refused,
//   - cools: T ← T · clamp(exp(−λ T / σ), slowest, fastest), σ the standard deviation of ln E in this
//     level: slowly where the energy still fluctuates (a transition), quickly where it has settled,
//   - returns to its best state.
//
// State, per wavelength w and group g of WIDTH chains, in vectors of WIDTH:
//   q, best, step   (W, G, P)      energy, best_energy, temperature   (W, G)      log2 E in energies
//   counts          (W, G, 2)      moves taken, and proposals whose E was not finite (refused)
//
// Sources: Corana, Marchesi, Martini, Ridella, ACM TOMS 13 (1987) 262, doi:10.1145/29380.29864 (steps,
// sweeps, return to the best); Huang, Romeo, Sangiovanni-Vincentelli, ICCAD (1986) 381 (cooling).

#define STREAM_START 0u
#define STREAM_MOVES 1u

// log2 E of a chain; E is floored where a perfect fit would make it −∞.
inline realv energy_of(realv objective) {
    return log2(objective > (realv)1e-37 ? objective : (realv)1e-37);
}

kernel void anneal_start(global const real *restrict rows,
                         global const uint *restrict starts, const uint incident_groups,
                         const uint n_directions,
                         global const real *restrict target, global const real *restrict scale,
                         global const real *restrict lower, global const real *restrict upper,
                         const ulong seed, global const uint *restrict wavelength_keys,
                         const real temperature_start,
                         global real *restrict q, global real *restrict best, global real *restrict step,
                         global real *restrict energy, global real *restrict best_energy,
                         global real *restrict temperature, global uint *restrict counts) {
    const size_t g = get_global_id(0), groups = get_global_size(0), w = get_global_id(1);
    const size_t place = w * groups + g;
    realv p[P];
    for (int j = 0; j < P; ++j) {
        realv u, unused;
        uniform_lanes(seed, STREAM_START, wavelength_keys[w], g * WIDTH, j, &u, &unused);
        realv start = (realv)lower[j] + u * (realv)(upper[j] - lower[j]);
        p[j] = value_of(j, start);
        STORE(start, place * P + j, q);
        STORE(start, place * P + j, best);
        STORE((realv)(upper[j] - lower[j]), place * P + j, step);
    }
    realv start_energy = energy_of(
        objective_of(p, rows, starts, incident_groups, target + w * n_directions, scale + w * n_directions));
    STORE(start_energy, place, energy);
    STORE(start_energy, place, best_energy);
    STORE((realv)temperature_start, place, temperature);
    for (uint k = 0; k < 2 * WIDTH; ++k) counts[place * 2 * WIDTH + k] = 0;
}

kernel void anneal_level(global const real *restrict rows,
                         global const uint *restrict starts, const uint incident_groups,
                         const uint n_directions,
                         global const real *restrict target, global const real *restrict scale,
                         global const real *restrict lower, global const real *restrict upper,
                         const ulong seed, global const uint *restrict wavelength_keys,
                         const uint level, const uint sweeps,
                         const real cooling, const real slowest, const real fastest,
                         global real *restrict q_all, global real *restrict best_all,
                         global real *restrict step_all, global real *restrict energy_all,
                         global real *restrict best_energy_all, global real *restrict temperature_all,
                         global uint *restrict counts) {
    const size_t g = get_global_id(0), groups = get_global_size(0), w = get_global_id(1);
    const size_t place = w * groups + g;
    target += w * n_directions;
    scale += w * n_directions;

    realv q[P], p[P], best[P], step[P], taken[P];
    for (int j = 0; j < P; ++j) {
        q[j] = LOAD(place * P + j, q_all);
        p[j] = value_of(j, q[j]);
        best[j] = LOAD(place * P + j, best_all);
        step[j] = LOAD(place * P + j, step_all);
        taken[j] = (realv)0.0;
    }
    realv energy = LOAD(place, energy_all), best_energy = LOAD(place, best_energy_all);
    realv temperature = LOAD(place, temperature_all);
    // The spread of the energy is summed about its value at the start, against cancellation.
    realv origin = energy < (realv)INFINITY ? energy : (realv)0.0;
    realv sum = (realv)0.0, sum_of_squares = (realv)0.0, not_finite = (realv)0.0;

    for (uint sweep = 0; sweep < sweeps; ++sweep) {
        for (int j = 0; j < P; ++j) {
            realv u, v;
            uniform_lanes(seed, STREAM_MOVES, wavelength_keys[w], g * WIDTH, (level * sweeps + sweep) * P + j,
                          &u, &v);
            const realv old_q = q[j], old_p = p[j], low = (realv)lower[j], high = (realv)upper[j];
            realv moved = old_q + step[j] * ((realv)2.0 * u - (realv)1.0);
            moved = low + fabs(moved - low);     // reflected at the limits: symmetric, and a step is
            moved = high - fabs(high - moved);   // never longer than the range
            q[j] = clamp(moved, low, high);
            p[j] = value_of(j, q[j]);
            realv proposed = energy_of(objective_of(p, rows, starts, incident_groups, target, scale));
            // False for NaN and for +∞ against +∞: such proposals are refused.
            const integerv accept = (proposed - energy) <= -temperature * log2(v);
            not_finite += proposed < (realv)INFINITY ? (realv)0.0 : (realv)1.0;
            q[j] = accept ? q[j] : old_q;
            p[j] = accept ? p[j] : old_p;
            energy = accept ? proposed : energy;
            taken[j] += accept ? (realv)1.0 : (realv)0.0;
            const integerv improved = energy < best_energy;
            best_energy = improved ? energy : best_energy;
            for (int k = 0; k < P; ++k) best[k] = improved ? q[k] : best[k];
            realv deviation = energy < (realv)INFINITY ? energy - origin : (realv)0.0;
            sum += deviation;
            sum_of_squares += deviation * deviation;
        }
    }

    realv all_taken = (realv)0.0;
    for (int j = 0; j < P; ++j) {
        const realv rate = taken[j] / (realv)sweeps;
        const realv wider = step[j] * ((realv)1.0 + (realv)5.0 * (rate - (realv)0.6));
        const realv narrower = step[j] / ((realv)1.0 + (realv)5.0 * ((realv)0.4 - rate));
        const realv range = (realv)(upper[j] - lower[j]);
        realv next = rate > (realv)0.6 ? wider : (rate < (realv)0.4 ? narrower : step[j]);
        STORE(clamp(next, range * (realv)1e-6, range), place * P + j, step_all);
        STORE(best[j], place * P + j, q_all);
        STORE(best[j], place * P + j, best_all);
        all_taken += taken[j];
    }
    const realv count = (realv)(sweeps * P);
    const realv mean = sum / count;
    const realv spread = sqrt(max(sum_of_squares / count - mean * mean, (realv)0.0)) * (realv)0.6931471805599453;
    // No fluctuation at all: cool at the fastest rate.
    const realv exponent = spread > (realv)0.0 ? -cooling * temperature / spread : (realv)-INFINITY;
    const realv factor = clamp(exp(exponent), (realv)fastest, (realv)slowest);
    STORE(temperature * factor, place, temperature_all);
    STORE(best_energy, place, energy_all);
    STORE(best_energy, place, best_energy_all);
    real tally[2 * WIDTH];
    STORE(all_taken, 0, tally);
    STORE(not_finite, 1, tally);
    for (uint k = 0; k < 2 * WIDTH; ++k) counts[place * 2 * WIDTH + k] += (uint)tally[k];
}
