// What the detector sees of a model in the measured directions: a weighted mean over nodes, or the point itself.

function makeDetector(s) {
  const told = s.seen;
  const nodes = told && told.nodes ? unpackNodes(told.nodes, s) : null;
  const observed = told ? unpack(told.observed) : null;
  let kept = null;
  const features = () => {
    if (!kept) {
      const at = nodes ? nodes.direction : (n) => [s.thetaI[n], s.phiI[n], s.thetaR[n], s.phi[n]];
      kept = s.surface.features(nodes ? nodes.length : s.count, at);
    }
    return kept;
  };
  const ends = (row) => (nodes ? [nodes.first[row], nodes.first[row + 1]] : [row, row + 1]);
  const weight = (k) => (nodes ? nodes.weight[k] : 1);
  return {
    // "" for points: nothing stands between model and measured values.
    words: told ? told.words : "",
    // Why it is known at the optimum only; "" where it is known for all parameters.
    why: told ? told.why : "",
    count: nodes ? nodes.length : s.count,
    // A function of the row, in 1/sr; null where parameters are set by hand and only the optimum is known.
    values(parameters, column, byHand) {
      if (observed) return byHand ? null : (row) => observed[s.at(row, column)];
      const value = s.surface.value(parameters);
      const x = features();
      return (row) => {
        const [first, last] = ends(row);
        let sum = 0;
        for (let k = first; k < last; k++) sum += weight(k) * value(x, k * s.surface.count);
        return sum;
      };
    },
    // Its standard uncertainty at the optimum, a function of the row; NaN where it is not known.
    spread(column) {
      if (observed || !s.hasSigma(column)) return () => NaN;
      const slopes = s.surface.slopesAt(s.parameters(column));
      const [sigma, correlation] = [s.parameterSigma(column), s.correlation(column)];
      const x = features();
      const [one, all] = [new Float64Array(s.size), new Float64Array(s.size)];
      return (row) => {
        const [first, last] = ends(row);
        all.fill(0);
        for (let k = first; k < last; k++) {
          slopes(x, k * s.surface.count, one);
          for (let j = 0; j < s.size; j++) all[j] += weight(k) * one[j];
        }
        return spreadOf(all, sigma, correlation);
      };
    },
  };
}

function unpackNodes(told, s) {
  const count = unpack(told.count);
  const first = new Uint32Array(s.count + 1);
  for (let n = 0; n < s.count; n++) first[n + 1] = first[n] + count[n];
  const owner = new Uint32Array(first[s.count]);
  for (let n = 0; n < s.count; n++) owner.fill(n, first[n], first[n + 1]);
  const [thetaI, phiI, thetaR, phi] = [told.theta_i, told.phi_i, told.theta_r, told.phi].map(unpack);
  return {
    first,
    length: owner.length,
    weight: unpack(told.weight),
    // Where all nodes of a direction share the incident one, it is that of the direction.
    direction: (k) => [thetaI ? thetaI[k] : s.thetaI[owner[k]], phiI ? phiI[k] : s.phiI[owner[k]], thetaR[k], phi[k]],
  };
}
