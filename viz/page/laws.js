// Energy and reciprocity.

const SERIES = ["var(--accent)", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "var(--ink)", "var(--soft)"];

function drawEnergy(panel, view) {
  const { s } = view;
  const laws = s.promises;
  const width = Math.max(260, panel.figure.clientWidth);
  const place = (k) => (s.nm ? laws.nm[k] : s.labels.indexOf(laws.labels[k]) + 1);
  const all = laws.rho.flat().filter((v) => v !== null);
  const y = { ...axisRange([...all, ...(Math.max(...all) > 0.7 ? [1] : [])], false), label: "reflectance ρ" };
  const plot = makePlot({ width, height: Math.min(0.55 * width, 24 * fontSize()), x: columnAxis(s), y, label: "directional-hemispherical reflectance over wavelength" });
  if (y.lo < 1 && y.hi > 1) plot.line([[columnAxis(s).lo, 1], [columnAxis(s).hi, 1]], "var(--ink)", "2 3", 1);
  plot.upright(columnPlace(s, view.state.column));
  laws.rho.forEach((row, k) => plot.line(row.map((v, j) => [place(j), v === null ? NaN : v]), SERIES[k % SERIES.length], k >= SERIES.length / 2 ? "6 3" : ""));
  const names = laws.theta_i.map((t, k) => `<span><i style="background:${SERIES[k % SERIES.length]}"></i>${number(t)}°</span>`);
  panel.figure.innerHTML = `${plot.svg()}<p class="legend">θi: ${names.join(" ")}</p>`;
  panel.help.innerHTML = laws.words.map((line) => escapeText(`${line[0].toUpperCase()}${line.slice(1)}.`)).join("<br>");
}

function energyTable(view) {
  const laws = view.s.promises;
  const rows = laws.labels.map((label, k) => [view.s.nm ? laws.nm[k] : label, ...laws.rho.map((row) => (row[k] === null ? NaN : row[k]))]);
  return { names: [view.s.nm ? "wavelength_nm" : "band", ...laws.theta_i.map((t) => `rho_at_${t}deg`)], rows, remarks: [...view.remarks, ...laws.words] };
}
