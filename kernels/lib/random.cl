// Uniform random numbers that depend on their place alone: Philox 4x32-10 keyed by the seed, counted by
// (step, chain, wavelength, stream). The result is the same whatever the lanes, groups or blocks.
//
//   range    (0, 1], multiples of 2^-24 plus 2^-25: 0, whose logarithm is infinite, does not occur; the
//            largest rounds to 1 in single precision
//   source   Salmon, Moraes, Dror, Shaw, SC11 (2011), doi:10.1145/2063384.2063405 (PyOpenCL's header)

inline real uniform_of(uint word) {
    return (real)(word >> 8) * (real)5.9604644775390625e-8 + (real)2.98023223876953125e-8;
}

// Two uniform numbers a lane; lane k belongs to chain first_chain + k.
inline void uniform_lanes(ulong seed, uint stream, uint wavelength_key, uint first_chain, uint step,
                          realv *first, realv *second) {
    const philox4x32_key_t key = {{(uint)seed, (uint)(seed >> 32)}};
    real u[2 * WIDTH];
    for (uint k = 0; k < WIDTH; ++k) {
        const philox4x32_ctr_t counter = {{step, first_chain + k, wavelength_key, stream}};
        const philox4x32_ctr_t word = philox4x32(counter, key);
        u[k] = uniform_of(word.v[0]);
        u[WIDTH + k] = uniform_of(word.v[1]);
    }
    *first = LOAD(0, u);
    *second = LOAD(1, u);
}
