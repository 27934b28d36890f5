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
    slopesAt: (parameters) => functions.slopes(parameters),
    // Derivatives to the parameters, as a function of direction that fills d.
    slopes(parameters) {
      const slopes = functions.slopes(parameters);
      return (thetaI, phiI, thetaR, phi, d) => {
        functions.features(anglesOf(thetaI, phiI, thetaR, phi, angles), x, 0);
        return slopes(x, 0, d);
      };
    },
    // Standard uncertainty that follows from those of the parameters and their correlation. What has none (fixed,
    // or at a bound) counts as known; NaN where the data leave a parameter open.
    uncertainty(parameters, sigma, correlation) {
      const slopes = functions.slopes(parameters);
      const size = parameters.length;
      const d = new Float64Array(size);
      return (thetaI, phiI, thetaR, phi) => {
        functions.features(anglesOf(thetaI, phiI, thetaR, phi, angles), x, 0);
        slopes(x, 0, d);
        return spreadOf(d, sigma, correlation);
      };
    },
  };
}

// Standard uncertainty of what changes by d_j when parameter j changes by one. What has none counts as known.
function spreadOf(d, sigma, correlation) {
  let variance = 0;
  let place = 0;
  for (let j = 0; j < d.length; j++) {
    const one = Number.isNaN(sigma[j]) ? 0 : d[j] * sigma[j];
    variance += one * one;
    for (let k = j + 1; k < d.length; k++, place++) {
      const r = correlation[place];
      if (r && !Number.isNaN(sigma[k]) && one) variance += 2 * r * one * d[k] * sigma[k];
    }
  }
  return variance >= 0 ? Math.sqrt(variance) : Number.isNaN(variance) ? NaN : 0;
}
