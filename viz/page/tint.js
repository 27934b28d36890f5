// Colour of the model in the cut under two illuminants, and its uncertainty.

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
  const fitted = s.labels.map((_, k) => s.parameters(k));
  const surfaces = fitted.map((p) => p && s.surface.of(p));
  const out = [];
  for (let t = -80; t <= 80; t += 5) {
    const [thetaR, phi] = sideOf(state, t);
    const spectrum = surfaces.map((f) => (f ? Math.PI * f(state.thetaI, state.phiI, thetaR, phi) : NaN));
    const entry = { t, thetaR, phi };
    for (const [name, { rows, white }] of Object.entries(lights)) {
      entry[`xyz${name}`] = rows.map((row) => row.reduce((sum, w, k) => (w ? sum + w * spectrum[k] : sum), 0));
      entry[name] = labOf(entry[`xyz${name}`], white);
    }
    out.push(entry);
  }
  const middle = out.find((e) => e.t === 0);
  const slopes = slopesInCut(view, fitted, out);
  for (const e of out) {
    for (const [name, light] of Object.entries(lights)) {
      e[`delta${name}`] = differenceOf(e[name], middle[name]);
      e[`sigma${name}`] = slopes ? spreadOfDifference(view, fitted, light, e, middle, slopes, name) : NaN;
    }
  }
  return out;
}

const differenceOf = (a, b) => Math.hypot(...a.map((v, k) => v - b[k]));

// Derivatives of the BRDF to the parameters in every direction of the cut and at every wavelength; null where no
// parameter has an uncertainty.
function slopesInCut(view, fitted, list) {
  const { s, state } = view;
  if (!fitted.some((p, k) => p && s.hasSigma(k))) return null;
  const functions = fitted.map((p) => p && s.surface.slopes(p));
  for (const e of list) {
    e.slopes = functions.map((f) => {
      if (!f) return null;
      const d = new Float64Array(s.size);
      f(state.thetaI, state.phiI, e.thetaR, e.phi, d);
      return d;
    });
  }
  return functions;
}

// Standard uncertainty of a colour difference: both colours follow from the same parameters at each wavelength, and
// these are independent from one wavelength to the next. Sums of squares over wavelengths.
function spreadOfDifference(view, fitted, { rows, white }, e, middle, slopes, name) {
  const { s } = view;
  if (e === middle) return 0;
  const here = differenceSlopes(e[`xyz${name}`], middle[`xyz${name}`], white);
  let sum = 0;
  const d = new Float64Array(s.size);
  for (let k = 0; k < s.columns; k++) {
    if (!fitted[k] || !rows.some((row) => row[k])) continue;
    let [own, other] = [0, 0];
    for (let c = 0; c < 3; c++) {
      own += Math.PI * rows[c][k] * here[0][c];
      other += Math.PI * rows[c][k] * here[1][c];
    }
    for (let j = 0; j < s.size; j++) d[j] = own * e.slopes[k][j] + other * middle.slopes[k][j];
    sum += spreadOf(d, s.parameterSigma(k), s.correlation(k)) ** 2;
  }
  return Math.sqrt(sum);
}

// How a difference changes with X, Y, Z of the one colour and of the other.
function differenceSlopes(xyz, other, white) {
  const [a, b] = [labOf(xyz, white), labOf(other, white)];
  const size = differenceOf(a, b) || 1;
  const towards = a.map((v, k) => (v - b[k]) / size);
  const slope = (t) => (t > (6 / 29) ** 3 ? 1 / (3 * Math.cbrt(t) ** 2) : 1 / (3 * (6 / 29) ** 2));
  const of = (from, sign) => {
    const f = from.map((v, k) => (sign * slope(v / white[k])) / white[k]);
    const [l, m, n] = towards;
    return [500 * m * f[0], (116 * l - 500 * m + 200 * n) * f[1], -200 * n * f[2]];
  };
  return [of(xyz, 1), of(other, -1)];
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
  const finite = list.flatMap((e) => [e.deltaD65, e.deltaA, e.deltaD65 + e.sigmaD65, e.deltaA + e.sigmaA]);
  const y = { ...axisRange([0, ...finite], false), label: "ΔE*ab to θr = 0" };
  const plot = makePlot({
    width,
    height: Math.min(0.5 * width, 22 * font),
    x: { lo: -90, hi: 90, ticks: [-90, -60, -30, 0, 30, 60, 90], names: (v) => `${Math.abs(v)}°`, label: `θr,  φ = ${number((state.phi + 180) % 360, 4)}°  ←  φ  →  ${number(state.phi, 4)}°` },
    y,
    label: "colour difference to the normal direction over θr, under D65 and A",
  });
  plot.band(list.map((e) => [e.t, Math.max(0, e.deltaD65 - e.sigmaD65), e.deltaD65 + e.sigmaD65]), "var(--accent)");
  plot.band(list.map((e) => [e.t, Math.max(0, e.deltaA - e.sigmaA), e.deltaA + e.sigmaA]), "#d55e00");
  plot.line(list.map((e) => [e.t, e.deltaD65]), "var(--accent)");
  plot.line(list.map((e) => [e.t, e.deltaA]), "#d55e00", "6 3");
  const w = width / list.length;
  const patches = list.map((e, k) => `<rect x="${(k * w).toFixed(1)}" y="0" width="${(w + 0.5).toFixed(1)}" height="${font * 2}" fill="${srgbText(e.xyzD65)}"/>`);
  const strip = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${font * 2}" viewBox="0 0 ${width} ${font * 2}" role="img" aria-label="colours under D65 from θr = 80° on one side to 80° on the other">${patches.join("")}</svg>`;
  const lab = (v) => v.map((c) => number(c, 4)).join(", ");
  const middle = list.find((e) => e.t === 0);
  panel.figure.innerHTML = `${strip}${plot.svg()}<p class="legend"><span><i style="background:var(--accent)"></i>D65</span> <span><i style="background:#d55e00"></i>A</span></p>`;
  panel.help.textContent = `The model in the cursor's plane, as a reflectance factor π f; above, the colours under D65, brighter than white ones dimmed to it. At θr = 0: CIELAB ${lab(middle.D65)} under D65 and ${lab(middle.A)} under A. CIE 1931 2° observer, tables at 5 nm. ${list.some((e) => Number.isFinite(e.sigmaD65) && e.sigmaD65 > 0) ? "Bands: ±1σ from the parameters, taken as independent from one wavelength to the next." : "The parameters have no uncertainties, so that ΔE has none."}`;
}

function colourTable(view) {
  const rows = coloursInCut(view).map((e) => [e.thetaR, e.phi, ...e.D65, e.deltaD65, e.sigmaD65, ...e.A, e.deltaA, e.sigmaA]);
  return { names: ["theta_r_deg", "phi_deg", "L_D65", "a_D65", "b_D65", "dE_D65", "dE_sigma_D65", "L_A", "a_A", "b_A", "dE_A", "dE_sigma_A"], rows, remarks: view.remarks };
}
