// Replica exchange of many chains at many wavelengths, one chain a lane (lib/chain.cl).
//
// Chains stand on ladders of fixed temperatures, `rungs` side by side. One launch of `tempering_sweeps` moves
// every chain at its temperature; one of `tempering_exchange` lets neighbours on a ladder, of even and odd
// rungs in turn, swap their states with probability min(1, exp((1/T_i − 1/T_j)(E_i − E_j))): good states sink
// to the cold end, and the warm end keeps bringing new ones.
//
// Source: Geyer, Computing Science and Statistics 23 (1991) 156; Earl and Deem, Phys. Chem. Chem. Phys. 7
// (2005) 3910.

kernel void tempering_start(DATA_ARGUMENTS, const real hottest, const real ratio, const uint rungs,
                            STATE_ARGUMENTS) {
    const size_t g = get_global_id(0), w = get_global_id(1), place = w * get_global_size(0) + g;
    start_chain(place, g * WIDTH, wavelength_keys[w], seed, rows, starts, incident_groups,
                target + w * n_directions, scale + w * n_directions, lower_all + w * P, upper_all + w * P, q_all, best_all, step_all,
                energy_all, best_energy_all, temperature_all, counts);
    for (uint k = 0; k < WIDTH; ++k)
        temperature_all[place * WIDTH + k] = hottest * pow(ratio, (real)((g * WIDTH + k) % rungs));
}

kernel void tempering_sweeps(DATA_ARGUMENTS, const uint round, const uint sweeps, STATE_ARGUMENTS) {
    const size_t g = get_global_id(0), w = get_global_id(1), place = w * get_global_size(0) + g;
    chain c = load_chain(place, q_all, best_all, step_all, energy_all, best_energy_all);
    run_chain(&c, LOAD(place, temperature_all), g * WIDTH, round * sweeps, sweeps, wavelength_keys[w], seed, rows,
              starts, incident_groups, target + w * n_directions, scale + w * n_directions, lower_all + w * P, upper_all + w * P);
    for (int j = 0; j < P; ++j) {
        STORE(next_step(&c, j, sweeps, upper_all[w * P + j] - lower_all[w * P + j]), place * P + j, step_all);
        STORE(c.q[j], place * P + j, q_all);
        STORE(c.best[j], place * P + j, best_all);
    }
    STORE(c.energy, place, energy_all);
    STORE(c.best_energy, place, best_energy_all);
    count_moves(&c, place, counts);
}

// One work item a ladder: global size (ladders, W). `groups` is the number of vectors of chains.
kernel void tempering_exchange(const ulong seed, global const uint *restrict wavelength_keys, const uint round,
                               const uint rungs, const uint groups, global real *restrict q_all,
                               global real *restrict energy_all, global const real *restrict temperature_all) {
    const size_t w = get_global_id(1);
    const philox4x32_key_t key = {{(uint)seed, (uint)(seed >> 32)}};
    for (uint rung = round % 2; rung + 1 < rungs; rung += 2) {
        const uint a = get_global_id(0) * rungs + rung, b = a + 1;
        const philox4x32_ctr_t counter = {{round, a, wavelength_keys[w], STREAM_EXCHANGE}};
        const real v = uniform_of(philox4x32(counter, key).v[0]);
        const size_t i = w * groups * WIDTH + a, j = w * groups * WIDTH + b;
        const real e_i = energy_all[i], e_j = energy_all[j];
        // False for NaN: a state without an energy stays where it is, and +∞ gives way.
        if (!(log2(v) < ((real)1.0 / temperature_all[i] - (real)1.0 / temperature_all[j]) * (e_i - e_j))) continue;
        energy_all[i] = e_j;
        energy_all[j] = e_i;
        for (uint k = 0; k < P; ++k) {
            const size_t at_i = ((w * groups + a / WIDTH) * P + k) * WIDTH + a % WIDTH;
            const size_t at_j = ((w * groups + b / WIDTH) * P + k) * WIDTH + b % WIDTH;
            const real held = q_all[at_i];
            q_all[at_i] = q_all[at_j];
            q_all[at_j] = held;
        }
    }
}
