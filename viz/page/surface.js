// A model with functions printed from its formula: values, and their standard uncertainty.

function makeSurface(functions, model) {
  const count = Math.max(1, model.features);
  const angles = newAngles();
  const x = new Float64Array(count);
  return {
    count,
    // A function of (theta_i, phi_i, theta_r, phi), degrees, in 1/sr.
    of(parameters) {
      const value = functions.value(parameters);
      return (thetaI, phiI, thetaR, phi) => {
        functions.features(anglesOf(thetaI, phiI, thetaR, phi, angles), x, 0);
        return value(x, 0);
      };
    },
    // Features of many directions, to be used again for other parameters.
    features(length, direction) {
      const out = new Float64Array(count * length);
      for (let k = 0; k < length; k++) {
        const [thetaI, phiI, thetaR, phi] = direction(k);
        functions.features(anglesOf(thetaI, phiI, thetaR, phi, angles), out, k * count);
      }
      return out;
    },
    value: (parameters) => functions.value(parameters),
    // Standard uncertainty that follows from those of the parameters and their correlation. What has none (fixed,
    // or at a bound) counts as known; NaN where the data leave a parameter open.
    uncertainty(parameters, sigma, correlation) {
      const slopes = functions.slopes(parameters);
      const size = parameters.length;
      const d = new Float64Array(size);
      return (thetaI, phiI, thetaR, phi) => {
        functions.features(anglesOf(thetaI, phiI, thetaR, phi, angles), x, 0);
        slopes(x, 0, d);
        let variance = 0;
        let place = 0;
        for (let j = 0; j < size; j++) {
          const one = Number.isNaN(sigma[j]) ? 0 : d[j] * sigma[j];
          variance += one * one;
          for (let k = j + 1; k < size; k++, place++) {
            const r = correlation[place];
            if (r && !Number.isNaN(sigma[k]) && one) variance += 2 * r * one * d[k] * sigma[k];
          }
        }
        return variance >= 0 ? Math.sqrt(variance) : Number.isNaN(variance) ? NaN : 0;
      };
    },
  };
}
