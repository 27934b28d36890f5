// What is shown: kept in the address after #, so that a page, a tab or a link keeps its own.

const SCALES = ["linear", "log", "ratio"];
// How much larger the lobe is drawn, and how many degrees the cut shows on either side of the cursor; 90 is all.
const ZOOMS = [0.5, 50];
const SPANS = [0.05, 90];
const RESIDUALS = ["percent", "sigma"];

function newState(subjects) {
  const s = subjects[0];
  // Where the lobe is: the measured direction nearest to the mirror direction.
  const { row, gap } = nearestRow(s, { thetaI: s.start.theta_i, phiI: s.azimuths[0] }, s.start.theta_i, 180);
  const measured = row >= 0 && gap < 15;
  return {
    subject: 0,
    column: s.start.column,
    thetaI: s.start.theta_i,
    phiI: s.azimuths[0],
    thetaR: measured ? s.thetaR[row] : s.start.theta_i,
    phi: measured ? (s.phi[row] + 360) % 360 : 180,
    scale: wideRange(s) ? "log" : "linear",
    ratio: "mean",
    residual: "percent",
    hold: null,
    live: null,
    azimuth: -60,
    elevation: 22,
    zoom: 1,
    span: 90,
    phiD: 90,
    light: [-40, 35],
  };
}

const WIDE = 50;

// Whether the usable values of the first wavelength shown span so much that a linear scale hides most of them.
function wideRange(s) {
  let [lo, hi] = [Infinity, 0];
  for (const n of s.rows(s.start.theta_i, s.azimuths[0])) {
    const v = s.usable(n, s.start.column) ? s.measured(n, s.start.column) : NaN;
    if (v > 0) [lo, hi] = [Math.min(lo, v), Math.max(hi, v)];
  }
  return hi > WIDE * lo;
}

function writeState(state, subjects) {
  const s = subjects[state.subject];
  const words = new URLSearchParams();
  if (subjects.length > 1) words.set("file", state.subject + 1);
  words.set(s.nm ? "nm" : "band", s.nm ? s.nm[state.column] : s.labels[state.column]);
  words.set("theta_i", state.thetaI);
  if (s.azimuths.length > 1 || (s.model && s.model.needs_phi)) words.set("phi_i", state.phiI);
  words.set("theta_r", Number(state.thetaR.toFixed(6)));
  words.set("phi", Number(state.phi.toFixed(6)));
  words.set("scale", state.scale);
  if (state.scale === "ratio") words.set("to", state.ratio);
  words.set("residual", state.residual);
  words.set("turn", `${Math.round(state.azimuth)},${Math.round(state.elevation)}`);
  if (state.zoom !== 1) words.set("zoom", Number(state.zoom.toPrecision(4)));
  if (state.span !== 90) words.set("span", Number(state.span.toPrecision(4)));
  if (s.model) words.set("phi_d", state.phiD);
  if (s.model) words.set("light", state.light.map((v) => Math.round(v)).join(","));
  if (state.hold) words.set("hold", state.hold.join(","));
  if (state.live) words.set("parameters", state.live.join(","));
  return words.toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
}

// Take what an address says, as far as it makes sense here.
function readState(text, state, subjects) {
  const words = new URLSearchParams(text);
  const within = (name, lo, hi, then) => {
    const value = Number(words.get(name));
    if (words.has(name) && Number.isFinite(value) && value >= lo && value <= hi) then(value);
  };
  within("file", 1, subjects.length, (v) => (state.subject = Math.round(v) - 1));
  const s = subjects[state.subject];
  state.column = Math.min(state.column, s.columns - 1);
  within("nm", 0, 1e7, (v) => (state.column = nearestColumn(s, v)));
  if (words.has("band") && s.labels.includes(words.get("band"))) state.column = s.labels.indexOf(words.get("band"));
  within("theta_i", 0, 89, (v) => (state.thetaI = v));
  within("phi_i", 0, 360, (v) => (state.phiI = v));
  within("theta_r", 0, 89.999, (v) => (state.thetaR = v));
  within("phi", 0, 360, (v) => (state.phi = v % 360));
  if (SCALES.includes(words.get("scale"))) state.scale = words.get("scale");
  if (words.has("to") && ratioChoices(state, subjects).some(([key]) => key === words.get("to"))) {
    state.ratio = words.get("to");
  }
  if (RESIDUALS.includes(words.get("residual"))) state.residual = words.get("residual");
  within("zoom", ...ZOOMS, (v) => (state.zoom = v));
  within("span", ...SPANS, (v) => (state.span = v));
  within("phi_d", 0, 180, (v) => (state.phiD = v));
  const light = (words.get("light") || "").split(",").map(Number);
  if (light.length === 2 && light.every((v) => Math.abs(v) <= 180)) state.light = [light[0], Math.max(-80, Math.min(80, light[1]))];
  const turn = (words.get("turn") || "").split(",").map(Number);
  if (turn.length === 2 && turn.every(Number.isFinite)) {
    state.azimuth = turn[0];
    state.elevation = Math.max(-10, Math.min(90, turn[1]));
  }
  const hold = words.has("hold") ? words.get("hold").split(",").map(Number) : [];
  state.hold = hold.length === 2 && hold.every(Number.isFinite) && hold[0] < hold[1] ? hold : null;
  const live = words.has("parameters") ? words.get("parameters").split(",").map(Number) : [];
  state.live = s.model && live.length === s.size && live.every(Number.isFinite) ? Float64Array.from(live) : null;
  return state;
}

function nearestColumn(s, nm) {
  if (!s.nm) return 0;
  let best = 0;
  s.nm.forEach((w, k) => {
    if (Math.abs(w - nm) < Math.abs(s.nm[best] - nm)) best = k;
  });
  return best;
}

// What a ratio can be taken to.
function ratioChoices(state, subjects) {
  const s = subjects[state.subject];
  const out = [["mean", "the mean of the points"], ["cosine", "1/cos θr, as BRDF × cosine"]];
  if (diffusePlace(s) >= 0) out.push(["diffuse", `${s.model.parameters[diffusePlace(s)].name}/π`]);
  subjects.forEach((other, k) => {
    if (k !== state.subject) out.push([`file${k + 1}`, other.name]);
  });
  return out;
}

function diffusePlace(s) {
  return s.model ? s.model.parameters.findIndex((p) => ["kd", "lambert.rho", "wang2013.kd"].includes(p.name)) : -1;
}
