// Energy, reciprocity and colour.

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

// CIELAB of XYZ with the white of the illuminant, which the weights put at Y = 1 (CIE 15:2004, 8.2.1).
function labOf(xyz, white) {
  const f = (t) => (t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29);
  const [x, y, z] = xyz.map((v, k) => f(v / white[k]));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

// Colour of the model in the cut's directions: pi times the BRDF, as against a perfect diffuser.
function coloursInCut(view) {
  const { s, state } = view;
  const lights = {};
  for (const name of ["D65", "A"]) {
    const w = unpack(s.colour[name]);
    const rows = [0, 1, 2].map((k) => w.subarray(k * s.columns, (k + 1) * s.columns));
    lights[name] = { rows, white: rows.map((row) => row.reduce((a, b) => a + b, 0)) };
  }
  const surfaces = s.labels.map((_, k) => s.parameters(k)).map((p) => p && s.surface.of(p));
  const out = [];
  for (let t = -80; t <= 80; t += 5) {
    const [thetaR, phi] = sideOf(state, t);
    const spectrum = surfaces.map((f) => (f ? Math.PI * f(state.thetaI, state.phiI, thetaR, phi) : NaN));
    const entry = { t, thetaR, phi };
    for (const [name, { rows, white }] of Object.entries(lights)) {
      entry[name] = labOf(rows.map((row) => row.reduce((sum, w, k) => (w ? sum + w * spectrum[k] : sum), 0)), white);
      if (name === "D65") entry.xyz = rows.map((row) => row.reduce((sum, w, k) => (w ? sum + w * spectrum[k] : sum), 0));
    }
    out.push(entry);
  }
  const middle = out.find((e) => e.t === 0);
  for (const e of out) for (const name of ["D65", "A"]) e[`delta${name}`] = Math.hypot(...e[name].map((v, k) => v - middle[name][k]));
  return out;
}

function srgbText([x, y, z]) {
  let rgb = [3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z, 0.0557 * x - 0.204 * y + 1.057 * z];
  const low = Math.min(0, ...rgb);
  const high = Math.max(1, ...rgb.map((v) => v - low));
  rgb = rgb.map((v) => (v - low) / high);
  return rgbText(rgb.map((v) => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055))));
}

function drawColour(panel, view) {
  const list = coloursInCut(view);
  const { state } = view;
  const width = Math.max(260, panel.figure.clientWidth);
  const font = fontSize();
  const finite = list.flatMap((e) => [e.deltaD65, e.deltaA]);
  const y = { ...axisRange([0, ...finite], false), label: "ΔE*ab to θr = 0" };
  const plot = makePlot({
    width,
    height: Math.min(0.5 * width, 22 * font),
    x: { lo: -90, hi: 90, ticks: [-90, -60, -30, 0, 30, 60, 90], names: (v) => `${Math.abs(v)}°`, label: `θr,  φ = ${number((state.phi + 180) % 360, 4)}°  ←  φ  →  ${number(state.phi, 4)}°` },
    y,
    label: "colour difference to the normal direction over θr, under D65 and A",
  });
  plot.line(list.map((e) => [e.t, e.deltaD65]), "var(--accent)");
  plot.line(list.map((e) => [e.t, e.deltaA]), "#d55e00", "6 3");
  const w = width / list.length;
  const patches = list.map((e, k) => `<rect x="${(k * w).toFixed(1)}" y="0" width="${(w + 0.5).toFixed(1)}" height="${font * 2}" fill="${srgbText(e.xyz)}"/>`);
  const strip = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${font * 2}" viewBox="0 0 ${width} ${font * 2}" role="img" aria-label="colours under D65 from θr = 80° on one side to 80° on the other">${patches.join("")}</svg>`;
  const lab = (v) => v.map((c) => number(c, 4)).join(", ");
  const middle = list.find((e) => e.t === 0);
  panel.figure.innerHTML = `${strip}${plot.svg()}<p class="legend"><span><i style="background:var(--accent)"></i>D65</span> <span><i style="background:#d55e00"></i>A</span></p>`;
  panel.help.textContent = `The model in the cursor's plane, as a reflectance factor π f; above, the colours under D65, brighter than white ones dimmed to it. At θr = 0: CIELAB ${lab(middle.D65)} under D65 and ${lab(middle.A)} under A. CIE 1931 2° observer, tables at 5 nm.`;
}

function colourTable(view) {
  const rows = coloursInCut(view).map((e) => [e.thetaR, e.phi, ...e.D65, e.deltaD65, ...e.A, e.deltaA]);
  return { names: ["theta_r_deg", "phi_deg", "L_D65", "a_D65", "b_D65", "dE_D65", "L_A", "a_A", "b_A", "dE_A"], rows, remarks: view.remarks };
}
