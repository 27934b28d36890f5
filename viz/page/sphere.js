// A sphere of the material under one distant light, seen from far away: its colour under D65, or grey at the
// wavelength shown where the scan has no colour.

const MOST_TONES = 16;
const SPHERE_PIXELS = 260;
const STEEPEST = 88.5;

function makeSphere(panel, act) {
  const label = "sphere of the material; drag or arrow keys move the light";
  const canvas = draggedCanvas(panel, "sphere", label, (right, down) => act.light(right, -down));
  const cache = { key: "" };
  return { draw: (view) => view.waits || drawSphere(panel, canvas, view, cache) };
}

// Parameters with their weights to X, Y, Z: the wavelengths in groups, each by its middle one.
function tones(view, most) {
  const { s, state } = view;
  if (s.colour.missing || !s.nm || state.live) return { list: [{ p: view.p, weights: [0.9505, 1, 1.089] }], grey: true };
  const weights = unpack(s.colour.D65);
  const fitted = s.labels.map((_, k) => k).filter((k) => s.parameters(k) && (weights[k] || weights[s.columns + k] || weights[2 * s.columns + k]));
  const groups = Math.min(most, fitted.length);
  const list = [];
  for (let g = 0; g < groups; g++) {
    const members = fitted.slice(Math.floor((g * fitted.length) / groups), Math.floor(((g + 1) * fitted.length) / groups));
    const sums = [0, 1, 2].map((c) => members.reduce((sum, k) => sum + weights[c * s.columns + k], 0));
    list.push({ p: s.parameters(members[Math.floor(members.length / 2)]), weights: sums });
  }
  return { list, grey: false, groups, count: fitted.length };
}

// Angles at a point of the sphere with normal n, light l, viewer along z; null where it is dark.
function anglesOnSphere(n, l) {
  const cosI = n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
  if (cosI <= 0 || n[2] <= 0) return null;
  const thetaI = Math.acos(Math.min(1, cosI)) / RAD;
  const thetaR = Math.acos(Math.min(1, n[2])) / RAD;
  if (thetaI > STEEPEST || thetaR > STEEPEST) return null;
  // The sample's azimuth 0 runs around the sphere's upright axis.
  const upright = Math.hypot(n[0], n[2]) || 1e-9;
  const t = [n[2] / upright, 0, -n[0] / upright];
  const b = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
  const azimuth = (v) => Math.atan2(v[0] * b[0] + v[1] * b[1] + v[2] * b[2], v[0] * t[0] + v[1] * t[1] + v[2] * t[2]) / RAD;
  const [phiI, phiR] = [azimuth(l), azimuth([0, 0, 1])];
  return { thetaI, phiI: (phiI + 360) % 360, thetaR, phi: (phiR - phiI + 720) % 360, cosI };
}

function lightOf(state) {
  const [az, el] = state.light.map((v) => v * RAD);
  return [Math.sin(az) * Math.cos(el), Math.sin(el), Math.cos(az) * Math.cos(el)];
}

// Pixels of the sphere, those that are lit with their angles and features, kept until the light moves.
function spherePixels(view, cache, inner) {
  const { s, state } = view;
  const key = `${state.subject} ${state.light} ${inner}`;
  if (cache.key === key) return cache;
  const l = lightOf(state);
  const [disc, places, angles] = [[], [], []];
  for (let j = 0; j < inner; j++) {
    for (let i = 0; i < inner; i++) {
      const [x, y] = [((2 * (i + 0.5)) / inner - 1) / 0.96, (1 - (2 * (j + 0.5)) / inner) / 0.96];
      const r2 = x * x + y * y;
      if (r2 >= 1) continue;
      disc.push(j * inner + i);
      const at = anglesOnSphere([x, y, Math.sqrt(1 - r2)], l);
      if (!at) continue;
      places.push(j * inner + i);
      angles.push(at);
    }
  }
  const features = s.surface.features(angles.length, (k) => [angles[k].thetaI, angles[k].phiI, angles[k].thetaR, angles[k].phi]);
  return Object.assign(cache, { key, disc, places, angles, features });
}

function drawSphere(panel, canvas, view, cache) {
  const { state } = view;
  const css = Math.max(160, canvas.clientWidth);
  const size = Math.round(css * (window.devicePixelRatio || 1));
  if (canvas.width !== size) Object.assign(canvas, { width: size, height: size });
  const inner = Math.min(size, view.quick ? 90 : SPHERE_PIXELS);
  const { list, grey, groups, count } = tones(view, view.quick ? 6 : MOST_TONES);
  const shown = `${state.subject} ${state.light} ${size} ${inner} ${list.length} ${grey ? view.p.join() : ""} ${theme().panel}`;
  if (cache.shown === shown) return;
  cache.shown = shown;
  const grid = spherePixels(view, cache, inner);
  const xyz = new Float64Array(3 * inner * inner).fill(NaN);
  for (const place of grid.disc) xyz.fill(0, 3 * place, 3 * place + 3);
  for (const { p, weights } of list) {
    const value = view.s.surface.value(p);
    grid.places.forEach((place, k) => {
      const radiance = Math.PI * value(grid.features, k * view.s.surface.count) * grid.angles[k].cosI;
      if (!(radiance > 0) || radiance === Infinity) return;
      for (let c = 0; c < 3; c++) xyz[3 * place + c] += weights[c] * radiance;
    });
  }
  const bright = grid.places.map((place) => xyz[3 * place + 1]);
  bright.sort((a, b) => a - b);
  const white = bright.length ? bright[Math.floor(0.98 * (bright.length - 1))] || 1 : 1;
  const image = new ImageData(inner, inner);
  for (let k = 0; k < inner * inner; k++) {
    if (Number.isNaN(xyz[3 * k])) continue;
    put(image, k, displayed([xyz[3 * k] / white, xyz[3 * k + 1] / white, xyz[3 * k + 2] / white]));
  }
  const sheet = document.createElement("canvas");
  sheet.width = sheet.height = inner;
  sheet.getContext("2d").putImageData(image, 0, 0);
  const draw = canvas.getContext("2d");
  draw.clearRect(0, 0, size, size);
  draw.imageSmoothingEnabled = true;
  draw.imageSmoothingQuality = "high";
  draw.drawImage(sheet, 0, 0, size, size);
  const what = grey ? `Grey: the BRDF at ${view.s.labels[state.column]}${state.live ? ", parameters by hand" : ""}.` : `Colour under D65${groups < count ? `, ${groups} of ${count} wavelengths standing for all` : ""}.`;
  panel.help.textContent = `${what} Light from ${number(state.light[0], 3)}° right and ${number(state.light[1], 3)}° above the viewer; drag to move it. White is the brightness that 2 % of the lit side exceed, ${number(white, 3)} of a perfect diffuser facing the light.`;
}

// sRGB, 8 bits, of XYZ with white at Y = 1; what is brighter is white, colours outside sRGB go to its edge.
function displayed([x, y, z]) {
  const linear = [3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z, 0.0557 * x - 0.204 * y + 1.057 * z];
  return linear.map((v) => {
    const t = Math.max(0, Math.min(1, v));
    return Math.round(255 * (t <= 0.0031308 ? 12.92 * t : 1.055 * t ** (1 / 2.4) - 0.055));
  });
}

function sphereTable(view) {
  const l = lightOf(view.state);
  const rows = [];
  for (let a = -90; a <= 90; a += 10) {
    for (let e = -80; e <= 80; e += 10) {
      const n = [Math.sin(a * RAD) * Math.cos(e * RAD), Math.sin(e * RAD), Math.cos(a * RAD) * Math.cos(e * RAD)];
      const at = anglesOnSphere(n, l);
      if (at) rows.push([a, e, at.thetaI, at.phiI, at.thetaR, at.phi, view.f(at.thetaI, at.phiI, at.thetaR, at.phi)]);
    }
  }
  return { names: ["right_deg", "up_deg", "theta_i_deg", "phi_i_deg", "theta_r_deg", "phi_deg", "model_per_sr"], rows, remarks: view.remarks };
}
