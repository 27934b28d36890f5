// The spectrum in the cursor's direction: the points of the nearest measured direction, and the model.

const NEAR = 0.5;

// The measured row nearest to the cursor among those that share the incident direction, and how far it is.
function nearestRow(s, state, thetaR = state.thetaR, phi = state.phi) {
  let best = -1;
  let gap = Infinity;
  for (const n of s.rows(state.thetaI, state.phiI)) {
    const here = separation(thetaR, phi, s.thetaR[n], s.phi[n]);
    if (here < gap) [best, gap] = [n, here];
  }
  return { row: best, gap };
}

const columnPlace = (s, k) => (s.nm ? s.nm[k] : k + 1);

function columnAxis(s, label = true) {
  const lo = columnPlace(s, 0);
  const hi = columnPlace(s, s.columns - 1);
  const pad = (hi - lo) * 0.02 || (s.nm ? 10 : 0.5);
  const axis = { lo: lo - pad, hi: hi + pad, label: label ? (s.nm ? "wavelength (nm)" : "band") : "" };
  if (!s.nm) Object.assign(axis, { ticks: s.labels.map((_, k) => k + 1), names: (v) => s.labels[v - 1] || "" });
  else if (s.columns === 1) axis.ticks = [lo];
  return axis;
}

// The measured row whose points are shown, -1 without any.
function shownRow(view) {
  const near = nearestRow(view.s, view.state);
  return near.row >= 0 && near.gap <= NEAR ? near.row : -1;
}

// The model over wavelength: as the detector sees it in the direction of the points, else the surface at the cursor.
function spectrumOf(view) {
  const { s, state } = view;
  const model = [];
  const row = s.model && s.detector.words ? shownRow(view) : -1;
  for (let k = 0; s.model && k < s.columns; k++) {
    const p = k === state.column && view.p ? view.p : s.parameters(k);
    if (!p) {
      model.push([columnPlace(s, k), NaN, NaN]);
      continue;
    }
    const live = k === state.column && !!state.live;
    const where = [state.thetaI, state.phiI, state.thetaR, state.phi];
    if (row >= 0) {
      const seen = s.detector.values(p, k, live);
      model.push([columnPlace(s, k), seen ? seen(row) : NaN, live ? NaN : s.detector.spread(k)(row)]);
      continue;
    }
    const error = live || !s.hasSigma(k) ? NaN : s.surface.uncertainty(p, s.parameterSigma(k), s.correlation(k))(...where);
    model.push([columnPlace(s, k), s.surface.of(p)(...where), error]);
  }
  return model;
}

function makeSpectrum(panel, act) {
  panel.figure.addEventListener("click", (event) => {
    const svg = event.target.closest("svg");
    if (svg && panel.pick) act.column(panel.pick(event.clientX - svg.getBoundingClientRect().left));
  });
  return { draw: (view) => drawSpectrum(panel, view) };
}

function drawSpectrum(panel, view) {
  const { s, state } = view;
  const width = Math.max(260, panel.figure.clientWidth);
  const model = spectrumOf(view);
  const near = nearestRow(s, state);
  const points = [];
  if (near.row >= 0 && near.gap <= NEAR) {
    for (let k = 0; k < s.columns; k++) points.push([columnPlace(s, k), s.measured(near.row, k), s.error(near.row, k), s.usable(near.row, k)]);
  }
  const values = [...points.filter((p) => p[3]).map((p) => p[1]), ...model.map((m) => m[1])];
  const x = columnAxis(s);
  const plot = makePlot({
    width,
    height: Math.min(0.62 * width, 28 * fontSize()),
    x,
    y: { ...axisRange(values, view.scale.log), label: "BRDF (1/sr)" },
    label: "spectrum in the cursor's direction",
  });
  plot.upright(columnPlace(s, state.column));
  plot.band(model.map(([a, v, e]) => [a, v - e, v + e]));
  plot.line(model.map(([a, v]) => [a, v]));
  const size = points.length > 200 ? 1.5 : 3;
  for (const [a, v, e, good] of points) plot.dot(a, v, e, { cross: !good, size });
  if (!values.some(Number.isFinite)) plot.note("nothing measured or fitted here");
  panel.figure.innerHTML = plot.svg();
  panel.pick = (px) => {
    const at = x.lo + ((px - plot.area.left) / plot.area.width) * (x.hi - x.lo);
    return s.nm ? nearestColumn(s, at) : Math.max(0, Math.min(s.columns - 1, Math.round(at) - 1));
  };
  const seen = s.model && s.detector.words && near.gap <= NEAR;
  const there = s.model && s.detector.why ? "Line: the model as the detector sees it there, at the optimum." : "Line and band: the model as the detector sees it there, ±1σ.";
  const line = seen ? there : "Band: ±1σ of the model.";
  panel.help.textContent =
    near.row < 0
      ? "Nothing is measured at this incident angle."
      : near.gap <= NEAR
        ? `Points with ±σ: measured at θr = ${degrees(s.thetaR[near.row])}, φ = ${degrees((s.phi[near.row] + 360) % 360)}. ${line} Click to choose a wavelength.`
        : `The nearest measured direction is ${number(near.gap, 3)}° away, so there are no points here. Band: ±1σ of the model.`;
}

function spectrumTable(view) {
  const { s, state } = view;
  const near = nearestRow(s, state);
  const there = shownRow(view) >= 0;
  const model = spectrumOf(view);
  const name = there && s.model && s.detector.words ? "seen" : "model";
  const rows = s.labels.map((name, k) => [
    s.nm ? s.nm[k] : name,
    there ? s.measured(near.row, k) : NaN,
    there ? s.error(near.row, k) : NaN,
    model.length ? model[k][1] : NaN,
    model.length ? model[k][2] : NaN,
    there ? reason(s, near.row, k) : "",
  ]);
  return { names: [s.nm ? "wavelength_nm" : "band", "measured_per_sr", "sigma_per_sr", `${name}_per_sr`, `${name}_sigma_per_sr`, "masked"], rows, remarks: view.remarks };
}
