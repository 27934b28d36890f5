// Simulated annealing of many chains at many wavelengths, one chain a lane (lib/chain.cl).
//
// One launch runs one temperature level of every chain. At its end each chain on its own
//   - widens or narrows its step in each coordinate towards equal numbers of moves taken and refused,
//   - cools: T ← T · clamp(exp(−λ T / σ), slowest, fastest), σ the standard deviation of ln E in this
//     level: slowly where the energy still fluctuates (a transition), quickly where it has settled,
//   - returns to its best state.
//
// Sources: Corana, Marchesi, Martini, Ridella, ACM TOMS 13 (1987) 262, doi:10.1145/29380.29864 (steps,
// sweeps, return to the best); Huang, Romeo, Sangiovanni-Vincentelli, ICCAD (1986) 381 (cooling).

kernel void anneal_start(DATA_ARGUMENTS, const real temperature_start, STATE_ARGUMENTS) {
    const size_t g = get_global_id(0), w = get_global_id(1), place = w * get_global_size(0) + g;
    start_chain(place, g * WIDTH, wavelength_keys[w], seed, rows, starts, incident_groups,
                target + w * n_directions, scale + w * n_directions, lower_all + w * P, upper_all + w * P, q_all, best_all, step_all,
                energy_all, best_energy_all, temperature_all, counts);
    STORE((realv)temperature_start, place, temperature_all);
}

kernel void anneal_level(DATA_ARGUMENTS, const uint level, const uint sweeps, const real cooling,
                         const real slowest, const real fastest, STATE_ARGUMENTS) {
    const size_t g = get_global_id(0), w = get_global_id(1), place = w * get_global_size(0) + g;
    chain c = load_chain(place, q_all, best_all, step_all, energy_all, best_energy_all);
    const realv temperature = LOAD(place, temperature_all);
    run_chain(&c, temperature, g * WIDTH, level * sweeps, sweeps, wavelength_keys[w], seed, rows, starts,
              incident_groups, target + w * n_directions, scale + w * n_directions, lower_all + w * P, upper_all + w * P);
    for (int j = 0; j < P; ++j) {
        STORE(next_step(&c, j, sweeps, upper_all[w * P + j] - lower_all[w * P + j]), place * P + j, step_all);
        STORE(c.best[j], place * P + j, q_all);
        STORE(c.best[j], place * P + j, best_all);
    }
    const realv count = (realv)(sweeps * SEARCHED);
    const realv mean = c.sum / count;
    const realv variance = c.sum_of_squares / count - mean * mean;
    const realv spread = sqrt(max(variance, (realv)0.0)) * (realv)0.6931471805599453;
    // No fluctuation at all: cool at the fastest rate.
    const realv exponent = spread > (realv)0.0 ? -cooling * temperature / spread : (realv)-INFINITY;
    STORE(temperature * clamp(exp(exponent), (realv)fastest, (realv)slowest), place, temperature_all);
    STORE(c.best_energy, place, energy_all);
    STORE(c.best_energy, place, best_energy_all);
    count_moves(&c, place, counts);
}
