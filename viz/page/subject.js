// One scan, perhaps with its fit: measured values by place, groups by incident direction, the objective.

const SAME_ANGLE = 0.05;

function makeSubject(record, functions) {
  const s = {
    ...record,
    columns: record.labels.length,
    thetaI: unpack(record.theta_i),
    phiI: unpack(record.phi_i),
    thetaR: unpack(record.theta_r),
    phi: unpack(record.phi),
    brdf: unpack(record.brdf),
    sigma: unpack(record.sigma),
    flags: unpack(record.flags),
    surface: null,
  };
  s.count = s.thetaI.length;
  s.angles = [...new Set(s.thetaI)].sort((a, b) => a - b);
  s.azimuths = [...new Set(s.phiI)].sort((a, b) => a - b);
  // The largest incident and view zenith measured.
  s.farthest = [s.thetaI, s.thetaR].map((list) => list.reduce((a, b) => Math.max(a, b), 0));
  s.at = (row, column) => row * s.columns + column;
  s.usable = (row, column) => s.flags[s.at(row, column)] === 0;
  s.measured = (row, column) => s.brdf[s.at(row, column)];
  s.error = (row, column) => (s.sigma ? s.sigma[s.at(row, column)] : NaN);
  // Rows at an incident direction; where the model does not tell azimuths apart all phi_i are shown together
  // only if there is one of them.
  let key = "";
  let rows = [];
  s.rows = (thetaI, phiI) => {
    const wanted = `${thetaI} ${phiI}`;
    if (wanted !== key) {
      key = wanted;
      rows = [];
      for (let n = 0; n < s.count; n++) {
        if (Math.abs(s.thetaI[n] - thetaI) > SAME_ANGLE) continue;
        if (s.azimuths.length > 1 && Math.abs(fold(s.phiI[n] - phiI)) > SAME_ANGLE) continue;
        rows.push(n);
      }
    }
    return rows;
  };
  // Largest view zenith measured at an incident direction, or anywhere.
  s.reach = (thetaI, phiI) => {
    let found = 0;
    for (const n of s.rows(thetaI, phiI)) found = Math.max(found, s.thetaR[n]);
    if (found === 0) for (const angle of s.thetaR) found = Math.max(found, angle);
    return found;
  };
  if (record.fit) addFit(s, record.fit, functions);
  return s;
}

function addFit(s, fit, functions) {
  const model = fit.model;
  const size = model.parameters.length;
  const pairs = (size * (size - 1)) / 2;
  const arrays = {
    parameters: unpack(fit.parameters),
    sigma: unpack(fit.sigma),
    sigmaRandom: unpack(fit.sigma_random),
    sigmaCommon: unpack(fit.sigma_common),
    interval: unpack(fit.interval),
    correlation: unpack(fit.correlation),
    E: unpack(fit.E),
    sigmaR: unpack(fit.sigma_r),
    weightValues: unpack(fit.weight_values),
  };
  s.model = model;
  s.size = size;
  s.fit = { ...fit, ...arrays };
  s.surface = makeSurface(functions, model);
  s.parameters = (column) => {
    const p = arrays.parameters.subarray(column * size, (column + 1) * size);
    return p.every(Number.isFinite) ? p : null;
  };
  s.parameterSigma = (column) => arrays.sigma.subarray(column * size, (column + 1) * size);
  // Without a single one a model has no uncertainty, which is not the uncertainty 0.
  s.hasSigma = (column) => s.parameterSigma(column).some(Number.isFinite);
  s.correlation = (column) => arrays.correlation.subarray(column * pairs, (column + 1) * pairs);
  s.detector = makeDetector(s);
  // E of (13) over the directions in this page, of what the detector sees; NaN where that is not known.
  s.objective = (parameters, column, byHand = true) => {
    const seen = s.detector.values(parameters, column, byHand);
    if (!seen) return NaN;
    let above = 0;
    let below = 0;
    for (let n = 0; n < s.count; n++) {
      if (!s.usable(n, column)) continue;
      const f = s.measured(n, column);
      const g = weightOf(s, arrays.weightValues, n, column, f);
      if (!(g > 0)) continue;
      const gap = seen(n) - f;
      above += g * gap * gap;
      below += g * f * f;
    }
    return below > 0 ? above / below : NaN;
  };
}

function weightOf(s, weights, row, column, f) {
  if (weights) return weights[s.at(row, column)];
  if (s.fit.weights === "none") return 1;
  if (s.fit.weights === "relative") return f > 0 ? 1 / (f * f) : 0;
  const error = s.error(row, column);
  return error > 0 ? 1 / (error * error) : 0;
}
