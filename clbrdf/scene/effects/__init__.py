"""The effects that only scenes know, one a file: what it does, its formula and source, its settings.

Those that a fit can take out again stand in `clbrdf.instrument`: misalignment, beam, aperture, bandwidth and
footprint.

An effect that a scene does not ask for is not called, and nothing is allocated or built for it. In the
order of the light's path:

    misalignment                 the directions that are really there
    beam, aperture, bandwidth    means of model values over nodes, in the kernel
    footprint, lamp_drift        factors of the BRDF
    stray_light, dark, shot_noise, nonlinearity, read_noise, saturation
                                 on the counts of the detector
    reader                       on the value that is written down
"""
