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
  // The wide band is all of 1 sigma, the one within what differs from direction to direction.
  const small = (name, unit, values, sigmas, log, plain = true, random = null) => {
    const ends = [...values];
    values.forEach((v, k) => {
      if (sigmas && Number.isFinite(sigmas[k]) && Math.abs(sigmas[k]) < 3 * Math.abs(v)) ends.push(v + sigmas[k], v - sigmas[k]);
    });
    const y = { ...axisRange(ends, log), label: `${name}${unit ? ` (${unit})` : ""}` };
    const plot = makePlot({ width, height: 13 * font, x, y, label: `${name} over wavelength` });
    plot.upright(columnPlace(s, state.column));
    if (sigmas) plot.band(values.map((v, k) => [columnPlace(s, k), v - sigmas[k], v + sigmas[k]]));
    if (random) plot.band(values.map((v, k) => [columnPlace(s, k), v - random[k], v + random[k]]));
    plot.line(values.map((v, k) => [columnPlace(s, k), v]), "var(--accent)", "", 1.2);
    if (!plain || s.columns <= 120) {
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
    const random = given || !fit.sigmaRandom ? null : column(fit.sigmaRandom, j);
    small(p.name, p.unit, values, given ? null : column(fit.sigma, j), spread, true, random);
  });
  const E = Array.from(fit.E);
  small("E (13)", "", E, null, E.every((v) => !(v <= 0)) && Math.max(...E.filter(Number.isFinite)) > 30 * Math.min(...E.filter(Number.isFinite)));
  small("σr (14)", "%", Array.from(fit.sigmaR, (v) => 100 * v), null, false);
  panel.figure.innerHTML = plots.join("");
  panel.pick = (px) => {
    const at = x.lo + ((px - area.left) / area.width) * (x.hi - x.lo);
    return s.nm ? nearestColumn(s, at) : Math.max(0, Math.min(s.columns - 1, Math.round(at) - 1));
  };
}

function stripTable(view) {
  const { s } = view;
  const names = [s.nm ? "wavelength_nm" : "band"];
  for (const p of s.model.parameters) {
    names.push(p.name, `${p.name}_sigma`);
    if (s.fit.sigmaRandom) names.push(`${p.name}_sigma_random`);
  }
  names.push("E", "sigma_r_percent", "status", "remark");
  const rows = s.labels.map((label, k) => {
    const row = [s.nm ? s.nm[k] : label];
    for (let j = 0; j < s.size; j++) {
      row.push(s.fit.parameters[k * s.size + j], s.fit.sigma[k * s.size + j]);
      if (s.fit.sigmaRandom) row.push(s.fit.sigmaRandom[k * s.size + j]);
    }
    return [...row, s.fit.E[k], 100 * s.fit.sigmaR[k], s.fit.status[k], s.fit.remarks[s.fit.remark[k]]];
  });
  return { names, rows, remarks: view.remarks };
}
