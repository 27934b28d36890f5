// The model over half and difference angle, at one phi_d: mirrors left, retro-reflection below, grazing angles above.

const SLICE_PIXELS = 180;
const NEAR_SLICE = 8;

function makeSlice(panel, act) {
  panel.figure.innerHTML =
    '<div class="slice"><canvas tabindex="0" role="application" data-title="half and difference angle" aria-label="model over half angle θh and difference angle θd; arrow keys move the cursor by 1°"></canvas></div>' +
    '<div class="key"></div><div class="slider"><label>φd <output></output><input type="range" min="0" max="180" step="5" aria-label="difference azimuth φd in degrees"></label></div>';
  const canvas = panel.figure.querySelector("canvas");
  const range = panel.figure.querySelector("input");
  range.addEventListener("input", () => act.difference(Number(range.value)));
  const go = (event) => {
    const box = canvas.getBoundingClientRect();
    const [left, top, side] = canvas.frame;
    act.half((90 * (event.clientX - box.left - left)) / side, 90 - (90 * (event.clientY - box.top - top)) / side);
  };
  let down = false;
  canvas.addEventListener("pointerdown", (event) => {
    down = true;
    canvas.setPointerCapture(event.pointerId);
    go(event);
  });
  canvas.addEventListener("pointermove", (event) => down && go(event));
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => (down = false));
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (!(event.key in moves)) return;
    act.halfStep(...moves[event.key]);
    event.preventDefault();
  });
  const cache = { key: "" };
  return { draw: (view) => view.waits || drawSlice(panel, canvas, range, view, cache) };
}

// Places of the slice with directions above the horizon, and their features, kept until φd or φi changes.
function slicePixels(view, cache, inner) {
  const { s, state } = view;
  const key = `${state.subject} ${state.phiI} ${state.phiD} ${inner}`;
  if (cache.key === key) return cache;
  const places = [];
  const angles = [];
  for (let j = 0; j < inner; j++) {
    for (let i = 0; i < inner; i++) {
      const at = directionsOfHalf((90 * (i + 0.5)) / inner, 90 - (90 * (j + 0.5)) / inner, state.phiD);
      if (!at) continue;
      places.push(j * inner + i);
      angles.push(at);
    }
  }
  const features = s.surface.features(angles.length, (k) => [angles[k].thetaI, state.phiI, angles[k].thetaR, angles[k].phi]);
  return Object.assign(cache, { key, places, angles, features });
}

function drawSlice(panel, canvas, range, view, cache) {
  const { s, state, scale } = view;
  range.value = state.phiD;
  panel.figure.querySelector("output").textContent = `${state.phiD}°`;
  const css = Math.max(200, canvas.clientWidth);
  const ratio = window.devicePixelRatio || 1;
  const size = Math.round(css * ratio);
  if (canvas.width !== size) Object.assign(canvas, { width: size, height: size });
  const draw = canvas.getContext("2d");
  const colours = theme();
  const font = fontSize() * ratio;
  const [left, top] = [3.6 * font, 0.8 * font];
  const side = size - left - font;
  const low = size - 3.4 * font;
  const tall = Math.min(side, low - top);
  canvas.frame = [left / ratio, top / ratio, tall / ratio];
  draw.clearRect(0, 0, size, size);
  const inner = view.quick ? 90 : SLICE_PIXELS;
  const image = new ImageData(inner, inner);
  const [paper, grey] = [parseColour(colours.paper), parseColour(colours.grey)];
  for (let k = 0; k < inner * inner; k++) put(image, k, paper);
  const grid = slicePixels(view, cache, inner);
  const value = s.surface.value(view.p);
  grid.places.forEach((place, k) => {
    const at = grid.angles[k];
    const f = value(grid.features, k * s.surface.count) / view.reference.of(at.thetaI, state.phiI, at.thetaR, at.phi);
    const c = colourAt(scale.place(f), "value");
    put(image, place, at.thetaI > s.farthest[0] + 1 || at.thetaR > s.farthest[1] + 1 ? mixed(c, grey, 0.75) : c);
  });
  const sheet = document.createElement("canvas");
  sheet.width = sheet.height = inner;
  sheet.getContext("2d").putImageData(image, 0, 0);
  draw.imageSmoothingEnabled = true;
  draw.drawImage(sheet, left, top, tall, tall);
  const place = (thetaH, thetaD) => [left + (tall * thetaH) / 90, top + tall * (1 - thetaD / 90)];
  const grow = ratio * Math.max(1, css / 380);
  for (const { row, at } of rowsInSlice(view)) {
    const v = s.measured(row, state.column) / view.reference.of(s.thetaI[row], s.phiI[row], s.thetaR[row], s.phi[row]);
    draw.fillStyle = rgbText(colourAt(scale.place(v), "value"));
    draw.strokeStyle = "rgba(255,255,255,0.8)";
    draw.lineWidth = 0.8 * ratio;
    draw.beginPath();
    draw.arc(...place(at.thetaH, at.thetaD), 2.4 * grow, 0, 7);
    draw.fill();
    draw.stroke();
  }
  draw.strokeStyle = colours.ink;
  draw.lineWidth = ratio;
  draw.strokeRect(left, top, tall, tall);
  draw.fillStyle = colours.ink;
  draw.font = `${font}px system-ui, sans-serif`;
  draw.textAlign = "center";
  for (const t of [0, 30, 60, 90]) {
    const [x, y] = place(t, t);
    draw.fillText(`${t}°`, x, top + tall + 1.3 * font);
    draw.textAlign = "right";
    draw.fillText(`${t}°`, left - 0.4 * font, y + (t === 90 ? font * 0.8 : 0.35 * font));
    draw.textAlign = "center";
  }
  draw.fillText("half angle θh", left + tall / 2, top + tall + 2.8 * font);
  draw.save();
  draw.translate(font, top + tall / 2);
  draw.rotate(-Math.PI / 2);
  draw.fillText("difference angle θd", 0, 0);
  draw.restore();
  const here = halfOfDirections(state.thetaI, state.thetaR, state.phi);
  const [x, y] = place(here.thetaH, here.thetaD);
  for (const [width, ink] of [[4, colours.panel], [1.8, colours.cursor]]) {
    draw.lineWidth = width * grow;
    draw.strokeStyle = ink;
    ring(draw, [x, y], 7 * grow);
  }
  panel.figure.querySelector(".key").innerHTML = keySvg(scale.lo, scale.hi, scale.log, "value", scale.words, css);
}

// Measured rows whose phi_d lies near that of the slice; near theta_d = 0 all do.
function rowsInSlice(view) {
  const { s, state } = view;
  const out = [];
  const every = Math.ceil(s.count / 4000);
  for (let n = 0; n < s.count; n += every) {
    if (!s.usable(n, state.column)) continue;
    const at = halfOfDirections(s.thetaI[n], s.thetaR[n], s.phi[n]);
    const off = Math.min(Math.abs(fold(at.phiD - state.phiD)), Math.abs(fold(-at.phiD - state.phiD)));
    if (off * Math.sin(at.thetaD * RAD) <= NEAR_SLICE) out.push({ row: n, at });
  }
  return out;
}

function sliceTable(view) {
  const { state } = view;
  const rows = [];
  for (let h = 0; h <= 90; h += 3) {
    for (let d = 0; d <= 90; d += 3) {
      const at = directionsOfHalf(h, d, state.phiD);
      if (at) rows.push([h, d, state.phiD, at.thetaI, at.thetaR, at.phi, view.f(at.thetaI, state.phiI, at.thetaR, at.phi)]);
    }
  }
  return { names: ["theta_h_deg", "theta_d_deg", "phi_d_deg", "theta_i_deg", "theta_r_deg", "phi_deg", "model_per_sr"], rows, remarks: view.remarks };
}
