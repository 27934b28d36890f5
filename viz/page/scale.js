// From values to places on a scale, which maps, lobe, cut and key share.

// What a value is divided by, as a function of direction; null where a ratio has no reference.
function referenceOf(state, subjects) {
  const s = subjects[state.subject];
  if (state.scale !== "ratio") return { words: "BRDF (1/sr)", of: () => 1 };
  if (state.ratio.startsWith("file")) {
    const other = subjects[Number(state.ratio.slice(4)) - 1];
    return otherFile(other, s, state);
  }
  if (state.ratio === "cosine") {
    return { words: "BRDF × cos θr (1/sr)", of: (thetaI, phiI, thetaR) => 1 / cosOf(thetaR) };
  }
  const p = state.live || (s.model ? s.parameters(state.column) : null);
  if (state.ratio === "diffuse" && p && diffusePlace(s) >= 0) {
    const level = p[diffusePlace(s)] / Math.PI;
    return { words: `BRDF over ${s.model.parameters[diffusePlace(s)].name}/π`, of: () => level };
  }
  let sum = 0;
  let count = 0;
  for (const n of s.rows(state.thetaI, state.phiI)) {
    if (s.usable(n, state.column)) {
      sum += s.measured(n, state.column);
      count++;
    }
  }
  if (!count) return { words: "no point here to take the mean of: BRDF (1/sr)", of: () => 1 };
  return { words: `BRDF over the mean of ${count} points, ${number(sum / count)} 1/sr`, of: () => sum / count };
}

// The other file: its model at the nearest wavelength, or its points where they stand in the same directions.
function otherFile(other, s, state) {
  const column = s.nm && other.nm ? nearestColumn(other, s.nm[state.column]) : Math.min(state.column, other.columns - 1);
  const words = `BRDF over ${other.name} at ${other.labels[column]}`;
  const p = other.model ? other.parameters(column) : null;
  if (p) return { words: `${words}, its model`, of: other.surface.of(p) };
  const rows = other.rows(state.thetaI, state.phiI);
  return {
    words: `${words}, its points in the same directions`,
    of: (thetaI, phiI, thetaR, phi) => {
      for (const n of rows) {
        if (other.usable(n, column) && separation(thetaR, phi, other.thetaR[n], other.phi[n]) < SAME_ANGLE) {
          return other.measured(n, column);
        }
      }
      return NaN;
    },
  };
}

// The range of what was measured, and of the model where something was measured; never of an extrapolation.
function shownRange(view) {
  const { s, state, reference } = view;
  const values = [];
  const add = (v, thetaR, phi) => {
    const one = v / reference.of(state.thetaI, state.phiI, thetaR, phi);
    if (Number.isFinite(one)) values.push(one);
  };
  const rows = s.rows(state.thetaI, state.phiI);
  for (const n of rows) {
    if (!s.usable(n, state.column)) continue;
    add(s.measured(n, state.column), s.thetaR[n], s.phi[n]);
    if (view.f) add(view.f(state.thetaI, state.phiI, s.thetaR[n], s.phi[n]), s.thetaR[n], s.phi[n]);
  }
  if (view.f) {
    // A peak may stand between two points.
    const reach = s.reach(state.thetaI, state.phiI);
    for (let t = 0; t <= reach; t += 1) for (const phi of [0, 180]) add(view.f(state.thetaI, state.phiI, t, phi), t, phi);
    if (state.thetaI <= reach) add(view.f(state.thetaI, state.phiI, state.thetaI, 180), state.thetaI, 180);
  }
  let lo = Infinity;
  let hi = -Infinity;
  let least = Infinity;
  for (const v of values) {
    lo = Math.min(lo, v);
    hi = Math.max(hi, v);
    if (v > 0) least = Math.min(least, v);
  }
  return { lo, hi, least };
}

const LARGEST_RANGE = 1e8;

function makeScale(view) {
  const { state } = view;
  const range = shownRange(view);
  let { lo, hi } = range;
  const log = state.scale === "log";
  if (!(hi > -Infinity)) [lo, hi] = log ? [1e-3, 1] : [0, 1];
  if (log) {
    if (!(hi > 0)) hi = 1;
    lo = Math.max(Number.isFinite(range.least) ? range.least : hi / 1e3, hi / LARGEST_RANGE);
    if (!(lo < hi * 0.98)) [lo, hi] = [hi / 2, hi * 2];
  } else {
    if (state.scale === "linear" && lo > 0 && lo < 0.5 * hi) lo = 0;
    if (!(hi - lo > 1e-9 * Math.abs(hi))) {
      const pad = Math.abs(hi) * 0.1 || 1;
      [lo, hi] = [lo - pad, hi + pad];
    }
  }
  if (state.hold && (!log || state.hold[0] > 0)) [lo, hi] = state.hold;
  const place = log ? (v) => (v > 0 ? Math.log(v / lo) / Math.log(hi / lo) : v <= 0 ? 0 : NaN) : (v) => (v - lo) / (hi - lo);
  return { lo, hi, log, place, ticks: log ? logTicks(lo, hi) : ticks(lo, hi, 5), words: view.reference.words };
}

// Deviations of the points, measured minus what the detector sees of the model, and their symmetric scale.
function deviations(view) {
  const { s, state } = view;
  const out = [];
  if (!view.f) return { points: out, size: 1, words: "" };
  const name = s.detector.words ? "seen" : "model";
  const words = state.residual === "percent" ? `(measured − ${name}) / measured, %` : `(measured − ${name}) / σ`;
  if (!view.seen) return { points: out, size: 1, words };
  for (const n of s.rows(state.thetaI, state.phiI)) {
    if (!s.usable(n, state.column)) continue;
    const f = s.measured(n, state.column);
    const gap = f - view.seen(n);
    const value = state.residual === "percent" ? (100 * gap) / f : gap / s.error(n, state.column);
    if (Number.isFinite(value)) out.push({ row: n, value });
  }
  const sizes = out.map((p) => Math.abs(p.value)).sort((a, b) => a - b);
  const size = sizes.length ? sizes[Math.min(sizes.length - 1, Math.floor(0.98 * sizes.length))] || 1 : 1;
  return { points: out, size, words };
}
