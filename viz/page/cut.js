// The cut through the cursor's azimuth: theta_r to the right on its side, to the left on the other.

const IN_PLANE = 1;

// Measured rows in the plane of the cursor, with signed zeniths.
function rowsInPlane(view) {
  const { s, state } = view;
  const out = [];
  for (const n of s.rows(state.thetaI, state.phiI)) {
    const t = s.thetaR[n];
    const off = Math.abs(fold(s.phi[n] - state.phi));
    if (t < 1e-9 || off <= IN_PLANE) out.push([t, n]);
    else if (180 - off <= IN_PLANE) out.push([-t, n]);
  }
  return out.sort((a, b) => a[0] - b[0]);
}

const sideOf = (state, signed) => [Math.abs(signed), signed < 0 ? (state.phi + 180) % 360 : state.phi];

// The model along the plane: signed zenith, value, uncertainty; close together around the mirror direction.
function modelInPlane(view) {
  const { state, f, uncertainty } = view;
  if (!f) return [];
  const places = new Set();
  for (let t = -89.5; t <= 89.5; t += 0.5) places.add(t);
  for (let k = -100; state.span < 90 && k <= 100; k++) {
    const t = state.thetaR + (state.span * k) / 100;
    if (Math.abs(t) < 89.5) places.add(t);
  }
  for (const [t] of rowsInPlane(view)) places.add(t);
  const inPlane = Math.abs(fold(state.phi)) < 1e-9 ? -1 : Math.abs(fold(state.phi - 180)) < 1e-9 ? 1 : 0;
  if (inPlane) {
    for (let k = -40; k <= 40; k++) {
      const t = inPlane * (state.thetaI + Math.sign(k) * 1e-3 * (1.25 ** Math.abs(k) - 1));
      if (Math.abs(t) < 89.5) places.add(t);
    }
  }
  return [...places].sort((a, b) => a - b).map((t) => {
    const [thetaR, phi] = sideOf(state, t);
    return [t, f(state.thetaI, state.phiI, thetaR, phi), uncertainty ? uncertainty(state.thetaI, state.phiI, thetaR, phi) : NaN];
  });
}

function makeCut(panel, act) {
  panel.figure.addEventListener("click", (event) => {
    if (!panel.pick) return;
    const svg = event.target.closest("svg");
    if (!svg) return;
    const signed = panel.pick((event.clientX - svg.getBoundingClientRect().left));
    if (signed !== null) act.along(signed);
  });
  stepButtons(panel, "cut around the cursor", (larger) => act.span(larger ? 0.5 : 2));
  return { draw: (view) => drawCut(panel, view) };
}

function drawCut(panel, view) {
  const { s, state, scale, reference } = view;
  const rows = rowsInPlane(view);
  const model = modelInPlane(view);
  const per = (signed) => {
    const [thetaR, phi] = sideOf(state, signed);
    return reference.of(state.thetaI, state.phiI, thetaR, phi);
  };
  const width = Math.max(260, panel.figure.clientWidth);
  const height = Math.min(0.62 * width, 30 * fontSize());
  const reach = s.reach(state.thetaI, state.phiI);
  const near = (t) => state.span >= 90 || Math.abs(t - state.thetaR) <= state.span;
  const values = rows.filter(([t, n]) => s.usable(n, state.column) && near(t)).map(([t, n]) => s.measured(n, state.column) / per(t));
  for (const [t, v] of model) if (Math.abs(t) <= reach && near(t)) values.push(v / per(t));
  const y = { ...axisRange(values, scale.log), label: state.scale === "ratio" ? "ratio" : "BRDF (1/sr)" };
  const names = (v) => `${number(Math.abs(v))}°`;
  const whole = state.span >= 90;
  const [lo, hi] = whole ? [-90, 90] : [Math.max(-90, state.thetaR - state.span), Math.min(90, state.thetaR + state.span)];
  const x = { lo, hi, ticks: whole ? [-90, -60, -30, 0, 30, 60, 90] : ticks(lo, hi, 5), names };
  const plane = `${number((state.phi + 180) % 360, 4)}°  ←  φ  →  ${number(state.phi, 4)}°`;
  const main = makePlot({ width, height, x: { ...x, label: view.f ? "" : `θr,  φ = ${plane}` }, y, label: `cut at φ = ${number(state.phi)}°: BRDF over θr` });
  main.shade(-90, -reach);
  main.shade(reach, 90);
  main.band(model.map(([t, v, e]) => [t, (v - e) / per(t), (v + e) / per(t)]));
  main.line(model.map(([t, v]) => [t, v / per(t)]));
  main.upright(state.thetaR);
  for (const [t, n] of rows) {
    const good = s.usable(n, state.column);
    main.dot(t, s.measured(n, state.column) / per(t), s.error(n, state.column) / per(t), { cross: !good });
  }
  if (view.seen && s.detector.words) {
    for (const [t, n] of rows) main.dot(t, view.seen(n) / per(t), NaN, { colour: "var(--accent)", ring: true, size: 4.2 });
  }
  if (!rows.length) main.note(view.f ? "" : "nothing measured in this plane");
  let html = main.svg();
  if (view.f) {
    const shown = view.deviations.points.filter((p) => rows.some(([, n]) => n === p.row));
    const of = new Map(shown.map((p) => [p.row, p.value]));
    const size = 1.1 * (Math.max(0, ...shown.map((p) => Math.abs(p.value))) || 1);
    const below = makePlot({
      width,
      height: Math.max(height * 0.42, 9 * fontSize()),
      x: { ...x, label: `θr,  φ = ${plane}` },
      y: { lo: -size, hi: size, label: state.residual === "percent" ? "%" : "σ" },
      label: `deviations ${view.deviations.words}`,
      zero: true,
    });
    for (const [t, n] of rows) if (of.has(n)) below.dot(t, of.get(n), NaN);
    below.upright(state.thetaR);
    if (!shown.length) below.note(view.seen ? "no point in this plane" : "not known for parameters set by hand");
    html += below.svg();
  }
  panel.figure.innerHTML = html;
  const rings = s.model && s.detector.words ? " Rings: the model as the detector sees it in each measured direction; residuals are against these." : "";
  panel.help.textContent = `Points with ±σ: measured; line and band: ${rings ? "the surface's " : ""}model ±1σ of its parameters; grey: beyond what was measured.${rings} Click to move the cursor.`;
  panel.pick = (px) => {
    const t = lo + ((px - main.area.left) / main.area.width) * (hi - lo);
    return Math.abs(t) <= 89.99 ? t : null;
  };
}

function cutTable(view) {
  const { s, state } = view;
  const rows = [];
  for (const [t, v, e] of modelInPlane(view)) {
    const [thetaR, phi] = sideOf(state, t);
    rows.push([thetaR, phi, NaN, NaN, v, e, ...seenCell(view, -1), ""]);
  }
  for (const [t, n] of rowsInPlane(view)) {
    const [thetaR, phi] = [Math.abs(t), s.phi[n] < 0 ? s.phi[n] + 360 : s.phi[n]];
    const model = view.f ? view.f(state.thetaI, state.phiI, thetaR, phi) : NaN;
    rows.push([thetaR, phi, s.measured(n, state.column), s.error(n, state.column), model, NaN, ...seenCell(view, n), reason(s, n, state.column)]);
  }
  return { names: ["theta_r_deg", "phi_deg", "measured_per_sr", "sigma_per_sr", "model_per_sr", "model_sigma_per_sr", ...seenName(view), "masked"], rows, remarks: view.remarks };
}

// The column of a table for what the detector sees, where an instrument stands between; and a cell of it.
const seenName = ({ s }) => (s.model && s.detector.words ? ["seen_per_sr"] : []);
const seenCell = (view, row) => seenName(view).map(() => (view.seen && row >= 0 ? view.seen(row) : NaN));

const reason = (s, n, column) => (s.usable(n, column) ? "" : s.flag_names[s.flags[s.at(n, column)] - 1].replaceAll("_", " "));
