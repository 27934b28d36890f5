// Maps of the hemisphere over (theta_r, phi), equal-area (Lambert's azimuthal projection about the normal).

const EDGE = Math.sin(45 * RAD);
const MOST_PIXELS = 440;

// Circles on the model's map where something was measured; more of them would hide it.
const MOST_CIRCLES = 1500;

// From a direction to the unit disc: x right (forward, phi = 180), y down.
function discOf(thetaR, phi) {
  const r = Math.sin((thetaR / 2) * RAD) / EDGE;
  return [-r * Math.cos(phi * RAD), r * Math.sin(phi * RAD)];
}

function directionOf(x, y) {
  const r = Math.hypot(x, y);
  if (r >= 1) return null;
  const thetaR = (2 * Math.asin(r * EDGE)) / RAD;
  const phi = Math.atan2(y, -x) / RAD;
  return [Math.min(thetaR, 89.99), phi < 0 ? phi + 360 : phi];
}

function makeMaps(panel, act) {
  panel.figure.className = "figure maps";
  const names = { measured: "measured", model: "model", residual: "residual" };
  const maps = Object.entries(names).map(([kind, title]) => {
    const box = document.createElement("div");
    box.className = "map";
    box.innerHTML = `<h3>${title}</h3><canvas tabindex="0" role="application" aria-describedby="readout"></canvas><div class="key"></div>`;
    panel.figure.append(box);
    const canvas = box.querySelector("canvas");
    canvas.dataset.kind = kind;
    canvas.dataset.title = title;
    canvas.setAttribute("aria-label", `${title} over the hemisphere; arrow keys move the cursor, with Shift by 10°`);
    listen(canvas, act);
    return { kind, box, canvas, heading: box.querySelector("h3"), key: box.querySelector(".key") };
  });
  const cache = { key: "" };
  return {
    draw(view) {
      for (const map of maps) {
        map.box.hidden = !view.f && map.kind !== "measured";
        if (!map.box.hidden) drawMap(map, view, cache);
      }
    },
    // Values of the model at the pixels, for tests: [theta_r, phi, value] row by row.
    sample: (view, step) => samplePixels(view, cache, step),
  };
}

function listen(canvas, act) {
  const go = (event) => {
    const box = canvas.getBoundingClientRect();
    const half = box.width / 2;
    const radius = half * canvas.discShare;
    const at = directionOf((event.clientX - box.left - half) / radius, (event.clientY - box.top - half) / radius);
    if (at) act.point(at[0], at[1], 7 / radius);
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
    const step = event.shiftKey ? 10 : 1;
    const moves = { ArrowUp: [step, 0], ArrowDown: [-step, 0], ArrowLeft: [0, step], ArrowRight: [0, -step] };
    if (event.key in moves) act.step(...moves[event.key]);
    else if (event.key === "Home") act.mirror();
    else return;
    event.preventDefault();
  });
}

// Features of the pixels inside the disc, kept until the incident direction changes.
function pixels(view, cache, size) {
  const { s, state } = view;
  const key = `${state.subject} ${state.thetaI} ${state.phiI} ${size}`;
  if (cache.key === key) return cache;
  const even = !s.model.needs_phi;
  const rows = even ? Math.ceil(size / 2) : size;
  const places = [];
  const angles = [];
  for (let j = 0; j < rows; j++) {
    for (let i = 0; i < size; i++) {
      const at = directionOf((2 * (i + 0.5)) / size - 1, (2 * (j + 0.5)) / size - 1);
      if (at) {
        places.push(j * size + i);
        angles.push(at);
      }
    }
  }
  const features = s.surface.features(angles.length, (k) => [state.thetaI, state.phiI, angles[k][0], angles[k][1]]);
  return Object.assign(cache, { key, size, even, places, angles, features });
}

function samplePixels(view, cache, step) {
  const grid = pixels(view, cache, cache.size || 200);
  const value = view.s.surface.value(view.p);
  const out = [];
  for (let k = 0; k < grid.places.length; k += step) out.push([...grid.angles[k], value(grid.features, k * view.s.surface.count)]);
  return out;
}

function drawMap(map, view, cache) {
  const { state, s, scale } = view;
  const { canvas } = map;
  const css = Math.max(120, canvas.clientWidth);
  const ratio = window.devicePixelRatio || 1;
  const size = Math.round(css * ratio);
  if (canvas.width !== size) canvas.width = canvas.height = size;
  const draw = canvas.getContext("2d");
  const colours = theme();
  const font = fontSize() * ratio;
  const radius = size / 2 - 2.3 * font;
  canvas.discShare = radius / (size / 2);
  draw.clearRect(0, 0, size, size);
  const centre = size / 2;
  const paper = parseColour(colours.paper);
  disc(draw, centre, radius, colours.paper);
  if (map.kind === "model") drawPixels(draw, view, cache, centre, radius, ratio);
  else hatch(draw, centre, radius, colours.line, ratio);
  const model = map.kind === "model";
  drawRings(draw, centre, radius, colours, font, model);
  const residual = map.kind === "residual";
  const shown = residual ? new Map(view.deviations.points.map((p) => [p.row, p.value])) : null;
  const rows = s.rows(state.thetaI, state.phiI);
  const grow = ratio * Math.max(1, css / 380);
  const big = Math.max(2 * grow, Math.min(7 * grow, 0.55 * radius * spacing(s, rows)));
  const hidden = model && rows.length > MOST_CIRCLES;
  for (const n of hidden ? [] : rows) {
    const [x, y] = discOf(s.thetaR[n], s.phi[n]);
    const at = [centre + radius * x, centre + radius * y];
    if (!s.usable(n, state.column)) {
      cross(draw, at, big * 0.7, colours.ink, grow);
      continue;
    }
    if (model) {
      draw.strokeStyle = "rgba(255,255,255,0.7)";
      draw.lineWidth = 0.8 * ratio;
      ring(draw, at, Math.max(0.8 * ratio, big * 0.4));
      continue;
    }
    let colour;
    if (residual) {
      if (!shown.has(n)) continue;
      colour = colourAt(0.5 + (0.5 * shown.get(n)) / view.deviations.size, "difference");
    } else {
      const v = s.measured(n, state.column) / view.reference.of(state.thetaI, state.phiI, s.thetaR[n], s.phi[n]);
      colour = colourAt(scale.place(v), "value");
    }
    draw.fillStyle = rgbText(colour);
    if (big < 2.5 * grow && rows.length > MOST_CIRCLES) {
      draw.fillRect(at[0] - big, at[1] - big, 2 * big, 2 * big);
      continue;
    }
    draw.beginPath();
    draw.arc(at[0], at[1], big, 0, 7);
    draw.fill();
    draw.strokeStyle = rgbText(mixed(colour, paper, 0.35));
    draw.lineWidth = 0.7 * ratio;
    draw.stroke();
  }
  nameRings(draw, centre, radius, colours, font);
  if (!rows.length && map.kind !== "model") {
    draw.fillStyle = colours.ink;
    draw.textAlign = "center";
    draw.font = `${font}px system-ui, sans-serif`;
    draw.fillText(`not measured at θi = ${number(state.thetaI)}°`, centre, centre - 2.6 * font);
  }
  if (residual && rows.length && !view.seen) {
    draw.fillStyle = colours.ink;
    draw.textAlign = "center";
    draw.font = `${font}px system-ui, sans-serif`;
    draw.fillText("not known for parameters by hand", centre, centre - 2.6 * font);
  }
  drawCursor(draw, centre, radius, state, colours, grow);
  map.key.innerHTML = residual ? keySvg(-view.deviations.size, view.deviations.size, false, "difference", view.deviations.words, css) : keySvg(scale.lo, scale.hi, scale.log, "value", scale.words, css);
}

// Median distance from a measured direction to its nearest neighbour, on the unit disc; of some directions.
function spacing(s, rows) {
  if (spacing.rows === rows) return spacing.found;
  const at = rows.map((n) => discOf(s.thetaR[n], s.phi[n]));
  const every = Math.max(1, Math.floor(at.length / 60));
  const gaps = [];
  for (let k = 0; k < at.length; k += every) {
    let least = Infinity;
    for (const [x, y] of at) {
      const gap = Math.hypot(x - at[k][0], y - at[k][1]);
      if (gap > 1e-6 && gap < least) least = gap;
    }
    if (least < Infinity) gaps.push(least);
  }
  gaps.sort((a, b) => a - b);
  return Object.assign(spacing, { rows, found: gaps.length ? gaps[Math.floor(gaps.length / 2)] : 0.2 }).found;
}

function disc(draw, centre, radius, fill) {
  draw.beginPath();
  draw.arc(centre, centre, radius, 0, 7);
  draw.fillStyle = fill;
  draw.fill();
}

// Where nothing is known.
function hatch(draw, centre, radius, colour, ratio) {
  draw.save();
  draw.beginPath();
  draw.arc(centre, centre, radius, 0, 7);
  draw.clip();
  draw.strokeStyle = colour;
  draw.lineWidth = ratio;
  for (let k = -2 * radius; k < 2 * radius; k += 7 * ratio) {
    draw.beginPath();
    draw.moveTo(centre - radius + k, centre - radius);
    draw.lineTo(centre + radius + k, centre + radius);
    draw.stroke();
  }
  draw.restore();
}

function drawPixels(draw, view, cache, centre, radius, ratio) {
  const { s, state, scale, reference } = view;
  const size = Math.min(MOST_PIXELS, Math.round(2 * radius), view.quick ? 220 : MOST_PIXELS);
  const grid = pixels(view, cache, size);
  const image = new ImageData(size, size);
  const value = s.surface.value(view.p);
  const reach = s.reach(state.thetaI, state.phiI);
  const grey = parseColour(theme().grey);
  const { count } = s.surface;
  for (let k = 0; k < grid.places.length; k++) {
    const [thetaR, phi] = grid.angles[k];
    const f = value(grid.features, k * count) / reference.of(state.thetaI, state.phiI, thetaR, phi);
    let c = colourAt(scale.place(f), "value");
    const place = grid.places[k];
    const [i, j] = [place % size, Math.floor(place / size)];
    if (thetaR > reach + 1) c = mixed(c, grey, (i + j) % 8 < 2 ? 0.85 : 0.6);
    put(image, place, c);
    if (grid.even) put(image, (size - 1 - j) * size + i, c);
  }
  const sheet = document.createElement("canvas");
  sheet.width = sheet.height = size;
  sheet.getContext("2d").putImageData(image, 0, 0);
  draw.imageSmoothingEnabled = true;
  draw.drawImage(sheet, centre - radius, centre - radius, 2 * radius, 2 * radius);
}

function put(image, place, c) {
  image.data[4 * place] = c[0];
  image.data[4 * place + 1] = c[1];
  image.data[4 * place + 2] = c[2];
  image.data[4 * place + 3] = 255;
}

function ring(draw, [x, y], r) {
  draw.beginPath();
  draw.arc(x, y, r, 0, 7);
  draw.stroke();
}

function cross(draw, [x, y], r, colour, ratio) {
  draw.strokeStyle = colour;
  draw.lineWidth = 1.2 * ratio;
  draw.beginPath();
  draw.moveTo(x - r, y - r);
  draw.lineTo(x + r, y + r);
  draw.moveTo(x + r, y - r);
  draw.lineTo(x - r, y + r);
  draw.stroke();
}

function drawRings(draw, centre, radius, colours, font, onColour) {
  draw.lineWidth = font / 14;
  draw.strokeStyle = onColour ? "rgba(255,255,255,0.45)" : colours.soft;
  draw.font = `${font * 0.85}px system-ui, sans-serif`;
  draw.textAlign = "center";
  draw.textBaseline = "middle";
  for (const angle of [30, 60, 90]) {
    const r = (Math.sin((angle / 2) * RAD) / EDGE) * radius;
    if (angle === 90) draw.strokeStyle = colours.ink;
    ring(draw, [centre, centre], r);
  }
  draw.fillStyle = colours.ink;
  for (const phi of [0, 90, 180, 270]) {
    const [x, y] = discOf(90, phi);
    const out = radius + font * (phi % 180 ? 0.95 : 1.2);
    draw.fillText(`${phi}°`, centre + out * x, centre + out * y);
  }
}

function nameRings(draw, centre, radius, colours, font) {
  draw.font = `${font * 0.85}px system-ui, sans-serif`;
  draw.textAlign = "center";
  for (const angle of [30, 60]) {
    const r = (Math.sin((angle / 2) * RAD) / EDGE) * radius * Math.SQRT1_2;
    label(draw, `${angle}°`, centre + r, centre - r, font, colours);
  }
}

function label(draw, words, x, y, font, colours) {
  const width = draw.measureText(words).width + font * 0.4;
  draw.fillStyle = colours.panel;
  draw.globalAlpha = 0.75;
  draw.fillRect(x - width / 2, y - font * 0.55, width, font * 1.1);
  draw.globalAlpha = 1;
  draw.fillStyle = colours.ink;
  draw.fillText(words, x, y);
}

// The cursor, the mirror direction (a small square) and the source (a small sun).
function drawCursor(draw, centre, radius, state, colours, ratio) {
  const at = (thetaR, phi) => discOf(thetaR, phi).map((v) => centre + radius * v);
  const outlined = (path, colour) => {
    for (const [width, ink] of [[4, colours.panel], [1.8, colour]]) {
      draw.lineWidth = width * ratio;
      draw.strokeStyle = ink;
      draw.beginPath();
      path();
      draw.stroke();
    }
  };
  const [mx, my] = at(state.thetaI, 180);
  const q = 4.5 * ratio;
  outlined(() => draw.rect(mx - q, my - q, 2 * q, 2 * q), colours.ink);
  const [sx, sy] = at(state.thetaI, 0);
  outlined(() => {
    for (let k = 0; k < 8; k++) {
      const [c, d] = [Math.cos(k * 45 * RAD), Math.sin(k * 45 * RAD)];
      draw.moveTo(sx + 2.5 * ratio * c, sy + 2.5 * ratio * d);
      draw.lineTo(sx + 7 * ratio * c, sy + 7 * ratio * d);
    }
  }, colours.ink);
  const [x, y] = at(state.thetaR, state.phi);
  outlined(() => {
    draw.moveTo(x + 8 * ratio, y);
    draw.arc(x, y, 8 * ratio, 0, 7);
    for (const [a, b] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      draw.moveTo(x + 4 * ratio * a, y + 4 * ratio * b);
      draw.lineTo(x + 13 * ratio * a, y + 13 * ratio * b);
    }
  }, colours.cursor);
}

// The key of a map: colours with their values.
function keySvg(lo, hi, log, table, words, width) {
  const font = fontSize();
  const stops = Array.from({ length: 17 }, (_, k) => `<stop offset="${(100 * k) / 16}%" stop-color="${rgbText(colourAt(k / 16, table))}"/>`);
  const left = font * 2;
  const w = width - 2 * left;
  const all = log ? logTicks(lo, hi) : ticks(lo, hi, Math.max(2, Math.floor(w / (font * 5.5))));
  const room = Math.max(2, Math.floor(w / (font * 4)));
  const every = Math.ceil(all.length / room);
  const at = (v) => left + w * (log ? Math.log(v / lo) / Math.log(hi / lo) : (v - lo) / (hi - lo));
  const marks = all
    .filter((_, k) => k % every === 0)
    .map((v) => `<line x1="${at(v)}" x2="${at(v)}" y1="${font}" y2="${font * 1.3}" stroke="var(--ink)"/><text x="${at(v)}" y="${font * 2.3}" text-anchor="middle">${number(v, 3)}</text>`);
  const id = `key-${table}-${Math.random().toString(36).slice(2)}`;
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${font * 4}" viewBox="0 0 ${width} ${font * 4}" font-size="${font * 0.9}" font-family="system-ui, sans-serif" fill="var(--ink)" role="img" aria-label="key: ${escapeText(words)}, from ${number(lo)} to ${number(hi)}">` +
    `<defs><linearGradient id="${id}">${stops.join("")}</linearGradient></defs><rect x="${left}" y="0" width="${w}" height="${font}" fill="url(#${id})"/>${marks.join("")}` +
    `<text x="${width / 2}" y="${font * 3.6}" text-anchor="middle">${escapeText(words)}</text></svg>`
  );
}
