// Parameters over wavelength with bands of 1 sigma, E and sigma_r; the status as marks.

function makeStrip(panel, act) {
  panel.figure.className = "figure strip";
  panel.figure.addEventListener("click", (event) => {
    const svg = event.target.closest("svg");
    if (svg && panel.pick) act.column(panel.pick(event.clientX - svg.getBoundingClientRect().left));
  });
  return { draw: (view) => view.quick || drawStrip(panel, view) };
}

function drawStrip(panel, view) {
  const { s, state } = view;
  const { fit, model, size } = s;
  const font = fontSize();
  const total = Math.max(260, panel.figure.clientWidth);
  const across = Math.max(1, Math.min(4, Math.floor(total / (20 * font))));
  const width = total / across - 6;
  const x = columnAxis(s);
  x.label = s.nm ? "nm" : "band";
  const plots = [];
  let area = null;
  // The wide band is all of 1 sigma, the one within what differs from direction to direction; bars are intervals.
  const small = (name, unit, values, log, { sigmas = null, random = null, ends = null } = {}) => {
    const reach = [...values];
    const near = (v, w) => Number.isFinite(w) && Math.abs(w - v) < 3 * Math.abs(v);
    values.forEach((v, k) => {
      if (sigmas && near(v, v + sigmas[k])) reach.push(v + sigmas[k], v - sigmas[k]);
      if (ends) reach.push(...ends[k].filter((w) => near(v, w)));
    });
    const y = { ...axisRange(reach, log), label: `${name}${unit ? ` (${unit})` : ""}` };
    const plot = makePlot({ width, height: 13 * font, x, y, label: `${name} over wavelength` });
    plot.upright(columnPlace(s, state.column));
    if (sigmas) plot.band(values.map((v, k) => [columnPlace(s, k), v - sigmas[k], v + sigmas[k]]));
    if (random) plot.band(values.map((v, k) => [columnPlace(s, k), v - random[k], v + random[k]]));
    if (ends) ends.forEach(([lo, hi], k) => plot.bar(columnPlace(s, k), lo, hi));
    plot.line(values.map((v, k) => [columnPlace(s, k), v]), "var(--accent)", "", 1.2);
    if (s.columns <= 120) {
      values.forEach((v, k) => {
        const cross = fit.status[k] === "not converged";
        plot.dot(columnPlace(s, k), v, NaN, { colour: "var(--accent)", open: !!sigmas && !Number.isFinite(sigmas[k]), cross, size: 2.2 });
      });
    }
    area = plot.area;
    plots.push(plot.svg());
  };
  const column = (array, j) => Array.from({ length: s.columns }, (_, k) => array[k * size + j]);
  model.parameters.forEach((p, j) => {
    if (p.given === "wavelength") return;
    const values = column(fit.parameters, j);
    const positive = values.every((v) => !(v <= 0));
    const spread = positive && Math.max(...values.filter(Number.isFinite)) > 30 * Math.min(...values.filter(Number.isFinite));
    const given = fit.given.includes(p.name);
    const of = (array) => (given || !array ? null : column(array, j));
    const ends = given || !fit.interval ? null : Array.from({ length: s.columns }, (_, k) => intervalOf(s, k, j));
    small(p.name, p.unit, values, spread, { sigmas: of(fit.sigma), random: of(fit.sigmaRandom), ends });
  });
  const E = Array.from(fit.E);
  small("E (13)", "", E, E.every((v) => !(v <= 0)) && Math.max(...E.filter(Number.isFinite)) > 30 * Math.min(...E.filter(Number.isFinite)));
  small("σr (14)", "%", Array.from(fit.sigmaR, (v) => 100 * v), false);
  plots.push(parametersHere(view));
  panel.figure.innerHTML = plots.join("");
  panel.help.textContent = stripHelp(s);
  panel.pick = (px) => {
    const at = x.lo + ((px - area.left) / area.width) * (x.hi - x.lo);
    return s.nm ? nearestColumn(s, at) : Math.max(0, Math.min(s.columns - 1, Math.round(at) - 1));
  };
}

// Both ends of a parameter's profile-likelihood interval.
const intervalOf = (s, column, j) => {
  const first = 2 * (column * s.size + j);
  return [s.fit.interval[first], s.fit.interval[first + 1]];
};

const INTERVAL = "68.3 % interval, by profile likelihood";

// What the bands and bars of the plots are, of those that there are.
function stripHelp(s) {
  const parts = [s.fit.sigmaRandom ? "Wide bands: ±1σ; within them: its random part, of errors that differ from direction to direction." : "Bands: ±1σ."];
  if (s.fit.interval) parts.push(`Bars: ${INTERVAL}; they hold at bounds, too.`);
  parts.push("Open marks: at a bound or not determined, without uncertainty; crosses: not converged. Click to choose a wavelength.");
  return parts.join(" ");
}

// The parameters at the wavelength that is shown, as numbers.
function parametersHere(view) {
  const { s, state } = view;
  const { fit } = s;
  const k = state.column;
  if (!s.parameters(k)) return "";
  const heads = ["parameter", "value", "1σ"];
  if (fit.sigmaRandom) heads.push("random part", "common part");
  if (fit.interval) heads.push(INTERVAL);
  const units = s.model.parameters.some((p) => p.unit);
  if (units) heads.push("unit");
  const body = s.model.parameters.map((p, j) => {
    const at = k * s.size + j;
    const given = p.given === "wavelength" || fit.given.includes(p.name);
    const cells = [number(fit.parameters[at], given ? 6 : digitsFor(Math.abs(fit.parameters[at]), fit.sigma[at])), given ? "given" : number(fit.sigma[at], 3)];
    if (fit.sigmaRandom) cells.push(...[fit.sigmaRandom, fit.sigmaCommon].map((part) => (given ? "" : number(part[at], 3))));
    if (fit.interval) cells.push(given ? "" : intervalWords(s, k, j));
    if (units) cells.push(p.unit);
    return `<tr><th scope="row" title="${escapeText(p.meaning)}">${escapeText(p.name)}</th>${cells.map((c) => `<td>${escapeText(c)}</td>`).join("")}</tr>`;
  });
  return (
    `<div class="scroll parameters" tabindex="0" role="region" aria-label="parameters at ${escapeText(s.labels[k])}"><table><caption>The fit at ${escapeText(s.labels[k])}</caption>` +
    `<thead><tr>${heads.map((h) => `<th scope="col">${h}</th>`).join("")}</tr></thead><tbody>${body.join("")}</tbody></table></div>`
  );
}

// Digits of a number so that two of its uncertainty are among them.
function digitsFor(size, width) {
  const digits = Math.ceil(Math.log10(size / width)) + 2;
  return Number.isFinite(digits) ? Math.max(3, Math.min(12, digits)) : 6;
}

function intervalWords(s, k, j) {
  const [lo, hi] = intervalOf(s, k, j);
  const digits = digitsFor(Math.max(Math.abs(lo), Math.abs(hi)), hi - lo);
  return Number.isFinite(lo) || Number.isFinite(hi) ? `${number(lo, digits)} to ${number(hi, digits)}` : "–";
}

function stripTable(view) {
  const { s } = view;
  const { fit, size } = s;
  // A heading's ending, and the number for a parameter's place in the arrays.
  const parts = [["", (at) => fit.parameters[at]], ["_sigma", (at) => fit.sigma[at]]];
  if (fit.sigmaRandom) parts.push(["_sigma_random", (at) => fit.sigmaRandom[at]], ["_sigma_common", (at) => fit.sigmaCommon[at]]);
  if (fit.interval) parts.push(["_lower", (at) => fit.interval[2 * at]], ["_upper", (at) => fit.interval[2 * at + 1]]);
  const names = [s.nm ? "wavelength_nm" : "band", ...s.model.parameters.flatMap((p) => parts.map(([end]) => p.name + end))];
  names.push("E", "sigma_r_percent", "status", "remark");
  const rows = s.labels.map((label, k) => {
    const values = s.model.parameters.flatMap((_, j) => parts.map(([, of]) => of(k * size + j)));
    return [s.nm ? s.nm[k] : label, ...values, fit.E[k], 100 * fit.sigmaR[k], fit.status[k], fit.remarks[fit.remark[k]]];
  });
  return { names, rows, remarks: view.remarks };
}
