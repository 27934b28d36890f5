// The lobe in three dimensions: the radius is the place on the scale, grey beyond what was measured.

const RINGS = 84;
const SECTORS = 96;
const TALL = 0.82;
const MOST_DOTS = 400;

function makeLobe(panel, act) {
  const label = "lobe in three dimensions; drag or arrow keys turn it, + and - change its size";
  const canvas = draggedCanvas(panel, "lobe", label, act.turn, act.rest);
  canvas.addEventListener("keydown", (event) => {
    if (event.key !== "+" && event.key !== "-") return;
    act.zoom(event.key === "+" ? 1.25 : 0.8);
    event.preventDefault();
  });
  // A touchpad's pinch arrives as a wheel with Ctrl; without it the wheel scrolls the page.
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    act.zoom(Math.exp(-0.01 * event.deltaY));
    event.preventDefault();
  }, { passive: false });
  stepButtons(panel, "lobe", (larger) => act.zoom(larger ? 1.5 : 1 / 1.5));
  const cache = { key: "" };
  return { draw: (view) => drawLobe(canvas, view, cache) };
}

// Rings around the mirror direction, close together where a lobe is narrow; the last one at the limit.
function lobeMesh(view, cache) {
  const { s, state } = view;
  const limit = Math.min(89.5, Math.max(85, s.reach(state.thetaI, state.phiI), state.thetaI + 0.5));
  const width = lobeWidth(view);
  const key = `${state.subject} ${state.thetaI} ${state.phiI} ${limit} ${width}`;
  if (cache.key === key) return cache;
  const mirror = state.thetaI * RAD;
  const angles = [];
  const vectors = [];
  for (let j = 0; j <= RINGS; j++) {
    for (let k = 0; k < SECTORS; k++) {
      const psi = (2 * Math.PI * k) / SECTORS;
      const [a, b] = [Math.cos(mirror), -Math.sin(mirror) * Math.cos(psi)];
      const farthest = Math.max(0, Math.atan2(b, a) + Math.acos(Math.min(1, Math.cos(limit * RAD) / Math.hypot(a, b))));
      const rho = width * Math.sinh((j / RINGS) * Math.asinh(farthest / width));
      const along = Math.sin(rho) * Math.cos(psi);
      const v = [Math.cos(rho) * Math.sin(mirror) + along * Math.cos(mirror), Math.sin(rho) * Math.sin(psi), Math.cos(rho) * Math.cos(mirror) - along * Math.sin(mirror)];
      vectors.push(v);
      const [theta, phi] = anglesOfVector(...v);
      angles.push(j === 0 ? [state.thetaI, 180] : [Math.min(theta, 89.99), phi]);
    }
  }
  const features = s.surface.features(angles.length, (k) => [state.thetaI, state.phiI, ...angles[k]]);
  return Object.assign(cache, { key, angles, vectors, features });
}

// Half width at half height in the plane of incidence, rad; at most 20 degrees.
function lobeWidth(view) {
  const { state, f } = view;
  const peak = f(state.thetaI, state.phiI, state.thetaI, 180);
  const far = f(state.thetaI, state.phiI, Math.abs(state.thetaI - 60), state.thetaI < 60 ? 0 : 180);
  for (let k = 0; k < 60; k++) {
    const rho = 1e-3 * 1.2 ** k;
    if (rho > 20) break;
    const t = state.thetaI - rho;
    if (f(state.thetaI, state.phiI, Math.abs(t), t < 0 ? 0 : 180) - far < 0.5 * (peak - far)) return rho * RAD;
  }
  return 20 * RAD;
}

function camera(state, size, centre) {
  const [az, el] = [state.azimuth * RAD, state.elevation * RAD];
  const right = [-Math.sin(az), Math.cos(az), 0];
  const out = [Math.cos(el) * Math.cos(az), Math.cos(el) * Math.sin(az), Math.sin(el)];
  const up = [out[1] * right[2] - out[2] * right[1], out[2] * right[0] - out[0] * right[2], out[0] * right[1] - out[1] * right[0]];
  const zoom = (size / 2.5) * state.zoom;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const aim = [dot(centre, right), dot(centre, up)];
  return {
    out,
    project: (v) => [size / 2 + zoom * (dot(v, right) - aim[0]), size * 0.5 - zoom * (dot(v, up) - aim[1]), zoom * dot(v, out)],
  };
}

// What stands in the middle: the whole, or the more the lobe is enlarged the cursor's place on it.
function lobeCentre(view) {
  const { state, scale, reference } = view;
  const middle = [0, 0, 0.36];
  if (state.zoom <= 1 || !view.f) return middle;
  const value = view.f(state.thetaI, state.phiI, state.thetaR, state.phi) / reference.of(state.thetaI, state.phiI, state.thetaR, state.phi);
  const tip = vectorOf(state.thetaR, state.phi).map((c) => c * (lengthOf(scale)(value) || 0));
  return mixedPlace(middle, tip, 1 - 1 / state.zoom);
}

const mixedPlace = (a, b, t) => a.map((v, k) => v + (b[k] - v) * t);

// Length of a value: its place on the scale; linear from 0, whatever the colours start at.
function lengthOf(scale) {
  if (scale.log) return (v) => Math.max(0, Math.min(1.15, scale.place(v)));
  return (v) => Math.max(0, Math.min(1.15, v / scale.hi));
}

function drawLobe(canvas, view, cache) {
  const { s, state, scale, reference } = view;
  const css = Math.max(160, canvas.clientWidth);
  const ratio = window.devicePixelRatio || 1;
  const size = Math.round(css * ratio);
  const high = Math.round(size * TALL);
  if (canvas.width !== size || canvas.height !== high) Object.assign(canvas, { width: size, height: high });
  const inner = Math.min(view.quick ? 520 : 1100, Math.round(size * (view.quick ? 1 : 1.5)));
  const raster = makeRaster(inner);
  const eye = camera(state, inner, lobeCentre(view));
  const colours = theme();
  const [ink, soft, grey, cursor] = ["ink", "soft", "grey", "cursor"].map((name) => parseColour(colours[name]));
  const thick = Math.max(1, inner / 420);
  const length = lengthOf(scale);
  const reach = s.reach(state.thetaI, state.phiI);
  drawGround(raster, eye, soft, ink, thick);
  if (view.f) drawSurface(raster, eye, view, lobeMesh(view, cache), length, reach, grey);
  const rows = s.rows(state.thetaI, state.phiI);
  const every = Math.ceil(rows.length / MOST_DOTS);
  for (let k = 0; k < rows.length; k += every) {
    const n = rows[k];
    if (!s.usable(n, state.column)) continue;
    const v = s.measured(n, state.column) / reference.of(state.thetaI, state.phiI, s.thetaR[n], s.phi[n]);
    const r = length(v);
    const tip = vectorOf(s.thetaR[n], s.phi[n]).map((c) => c * r);
    const at = eye.project(tip);
    at[2] += 0.01 * inner;
    const many = rows.length > 150;
    raster.dot(at, (many ? 1.7 : 2.6) * thick, view.f ? ink : colourAt(scale.place(v), "value"));
    if (!view.f && !many) raster.line(eye.project([0, 0, 0]), at, 0.5 * thick, soft);
  }
  const towards = (theta, phi, r) => eye.project(vectorOf(theta, phi).map((c) => c * r));
  raster.line(towards(state.thetaI, 0, 1.15), eye.project([0, 0, 0]), 1.2 * thick, ink);
  raster.line(towards(state.thetaI, 180, 0), towards(state.thetaI, 180, 1.15), 0.7 * thick, soft);
  raster.line(eye.project([0, 0, 0]), towards(state.thetaR, state.phi, 1.18), 1.4 * thick, cursor);
  const sheet = document.createElement("canvas");
  sheet.width = sheet.height = inner;
  sheet.getContext("2d").putImageData(raster.image(), 0, 0);
  const draw = canvas.getContext("2d");
  draw.clearRect(0, 0, size, high);
  draw.imageSmoothingEnabled = true;
  draw.imageSmoothingQuality = "high";
  const lift = Math.round((size - high) / 2);
  draw.drawImage(sheet, 0, -lift, size, size);
  const font = fontSize() * ratio;
  draw.fillStyle = colours.ink;
  draw.font = `${font}px system-ui, sans-serif`;
  draw.textAlign = "center";
  const share = size / inner;
  const [sx, sy] = towards(state.thetaI, 0, 1.22);
  draw.fillText("source", sx * share, sy * share - lift);
  for (const phi of [0, 90, 180, 270]) {
    const [x, y] = towards(90, phi, 1.12);
    draw.fillText(`${phi}°`, x * share, y * share - lift + font * 0.35);
  }
  draw.textAlign = "left";
  if (every > 1) draw.fillText(`dots: 1 of ${every} of ${rows.length} points`, font * 0.5, high - font * 2);
  draw.fillText(`radius: ${scale.log ? "log, " : ""}${scale.log ? number(scale.lo, 3) : "0"} to ${number(scale.hi, 3)} at the outer circle`, font * 0.5, high - font * 0.6);
}

function drawGround(raster, eye, soft, ink, thick) {
  const circle = (r, z, c, w) => {
    let before = null;
    for (let k = 0; k <= 180; k++) {
      const at = eye.project([r * Math.cos(2 * k * RAD), r * Math.sin(2 * k * RAD), z]);
      if (before) raster.line(before, at, w, c);
      before = at;
    }
  };
  circle(1, 0, ink, 0.7 * thick);
  circle(0.5, 0, soft, 0.4 * thick);
  for (const phi of [0, 45, 90, 135]) {
    const [x, y] = [Math.cos(phi * RAD), Math.sin(phi * RAD)];
    raster.line(eye.project([-x, -y, 0]), eye.project([x, y, 0]), 0.4 * thick, soft);
  }
}

function drawSurface(raster, eye, view, mesh, length, reach, grey) {
  const { s, state, scale, reference } = view;
  const value = s.surface.value(view.p);
  const points = [];
  const colour = [];
  for (let k = 0; k < mesh.angles.length; k++) {
    const [thetaR, phi] = mesh.angles[k];
    const v = value(mesh.features, k * s.surface.count) / reference.of(state.thetaI, state.phiI, thetaR, phi);
    const r = length(v);
    points.push(mesh.vectors[k].map((c) => c * (Number.isFinite(r) ? r : 0)));
    const c = colourAt(scale.place(v), "value");
    colour.push(thetaR > reach + 1 ? mixed(c, grey, 0.8) : c);
  }
  const flat = points.map((p) => eye.project(p));
  const normals = points.map(() => [0, 0, 0]);
  const faces = [];
  for (let j = 0; j < RINGS; j++) {
    for (let k = 0; k < SECTORS; k++) {
      const here = j * SECTORS + k;
      const right = j * SECTORS + ((k + 1) % SECTORS);
      faces.push([here, here + SECTORS, right + SECTORS], [here, right + SECTORS, right]);
    }
  }
  for (const face of faces) {
    const [a, b, c] = face.map((k) => points[k]);
    const [u, v] = [b.map((t, k) => t - a[k]), c.map((t, k) => t - a[k])];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const k of face) for (let m = 0; m < 3; m++) normals[k][m] += n[m];
  }
  const light = [0.35 * eye.out[0] + 0.2, 0.35 * eye.out[1] - 0.2, 0.35 * eye.out[2] + 0.75];
  const size = Math.hypot(...light);
  const shade = colour.map((c, k) => {
    const n = normals[k];
    const cosine = Math.abs(n[0] * light[0] + n[1] * light[1] + n[2] * light[2]) / (Math.hypot(...n) * size || 1);
    return c.map((v) => v * (0.55 + 0.45 * cosine));
  });
  for (const [a, b, c] of faces) raster.triangle(flat[a], flat[b], flat[c], shade[a], shade[b], shade[c]);
}
