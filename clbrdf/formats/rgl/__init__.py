"""The tensor files (.bsdf) of the RGL material database, which Mitsuba's `measured` plugin renders.

J. Dupuy and W. Jakob, "An adaptive parameterization for efficient material acquisition and rendering",
ACM Trans. Graph. 37(6), 2018, doi:10.1145/3272127.3275059; the container and the meaning of its fields:
Mitsuba 3 documentation, plugin `measured`, and the files of https://rgl.epfl.ch/materials.

`tensor_file` knows the container, `tables` what stands in it, `warp` and `values` read the BRDF off it,
`nodes` lists what was stored; `parametrise`, `incidence`, `accuracy` and `export` write one for any BRDF.
"""
