// What a model may ask of a view direction when a mesh is evaluated without a trip to the host.
//
//   cos_i, cos_r   cosines of incident and view zenith, > 0
//   sin2_gamma     sin²γ, γ the half-angle between the view and the mirror direction (10)
//   attenuation    G cosθi cosθr (11), finite up to grazing
//
// A model's .cl turns it into its features with `geometry_of_direction`; the host features in
// clbrdf/models stay the reference (tests/viz/test_evaluator.py compares the two).
typedef struct {
    realv cos_i, cos_r, sin2_gamma, attenuation;
} direction;
