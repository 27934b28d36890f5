// The page: one state, one view of it, and panels that draw the view.

function openPage(functions) {
  const data = JSON.parse(document.getElementById("data").textContent);
  setTables(data.colours);
  const subjects = data.subjects.map((record, k) => makeSubject(record, functions[k]));
  const state = readState(location.hash.slice(1), readState(data.start, newState(subjects), subjects), subjects);
  const bar = document.getElementById("controls");
  const host = document.getElementById("panels");
  const act = makeActs(state, subjects, (only) => schedule(true, only), (only) => schedule(false, only));
  fillControls(bar, subjects, state, act);
  const panels = makePanels(host, act, () => lookAt(state, subjects, false));
  const maps = panels[0].drawn;
  const said = document.getElementById("about");
  let waiting = 0;
  let resting = 0;
  let written = 0;
  let frames = 0;
  let told = -1;
  // What the next picture draws: the names of some panels, or null for all.
  let wanted = new Set();
  let settling = new Set();

  function draw(quick) {
    const only = wanted;
    wanted = new Set();
    const began = performance.now();
    const view = lookAt(state, subjects, quick);
    // A panel that moves by itself is drawn at once; slow ones otherwise wait until nothing moves.
    view.waits = quick && !only;
    if (!only) {
      showControls(bar, subjects, state);
      showReadout(view);
    }
    if (told !== state.subject) {
      told = state.subject;
      showAbout(said, view.s);
    }
    for (const panel of panels) {
      if (only && !only.has(panel.section.id)) continue;
      panel.section.hidden = !panel.fits(view);
      if (!panel.section.hidden) panel.draw(view);
    }
    frames++;
    page.lastFrame = performance.now() - began;
    page.frames = frames;
  }

  // Draw in full what was drawn quickly.
  function settle() {
    const names = settling;
    settling = new Set();
    if (names) names.forEach((name) => schedule(false, name));
    else schedule(false);
  }

  function drawAll() {
    wanted = null;
    draw(false);
  }

  // Draw soon, small and quick while something moves, and in full once it rests.
  function schedule(quick, only = null) {
    wanted = only && wanted ? wanted.add(only) : null;
    if (!waiting) {
      waiting = requestAnimationFrame(() => {
        waiting = 0;
        draw(quick);
      });
    }
    if (quick) {
      settling = only && settling ? settling.add(only) : null;
      clearTimeout(resting);
      resting = setTimeout(settle, 160);
    }
    clearTimeout(written);
    written = setTimeout(() => history.replaceState(null, "", `#${writeState(state, subjects)}`), 250);
  }

  const page = {
    state,
    subjects,
    // Model values, in doubles: what the readouts show.
    evaluate: (thetaI, phiI, thetaR, phi, parameters) => {
      const s = subjects[state.subject];
      return s.surface.of(Float64Array.from(parameters || s.parameters(state.column)))(thetaI, phiI, thetaR, phi);
    },
    view: () => lookAt(state, subjects, false),
    half: halfOfDirections,
    act,
    maps,
  };
  window.clbrdf = page;
  addEventListener("hashchange", () => {
    readState(location.hash.slice(1), state, subjects);
    schedule(false);
  });
  addEventListener("resize", () => schedule(false));
  for (const query of ["(prefers-color-scheme: dark)", "print"]) matchMedia(query).addEventListener("change", () => drawAll());
  addEventListener("beforeprint", () => drawAll());
  // A quick picture first, then all of it; milliseconds from the opening of the page.
  wanted = null;
  draw(true);
  page.frames = frames = 0;
  page.firstPicture = performance.now();
  requestAnimationFrame(() =>
    setTimeout(() => {
      drawAll();
      page.wholePicture = performance.now();
    }, 0),
  );
}

// Everything that panels need of a state.
function lookAt(state, subjects, quick) {
  const s = subjects[state.subject];
  const view = { state, s, subjects, quick, f: null, p: null, uncertainty: null, seen: null };
  const best = s.model ? s.parameters(state.column) : null;
  if (best) {
    view.p = state.live || best;
    view.f = s.surface.of(view.p);
    // What the detector sees of it, by row.
    view.seen = s.detector.values(view.p, state.column, !!state.live);
    if (!state.live && s.hasSigma(state.column)) view.uncertainty = s.surface.uncertainty(best, s.parameterSigma(state.column), s.correlation(state.column));
  }
  view.reference = referenceOf(state, subjects);
  view.scale = makeScale(view);
  view.deviations = deviations(view);
  const place = `theta_i ${state.thetaI} deg, phi_i ${state.phiI} deg, ${s.labels[state.column]}`;
  view.remarks = [s.name, ...(s.model ? [`model ${s.model.name}${state.live ? " with parameters set by hand" : ""}`] : []), place, ...s.words, ...(s.model && s.detector.words ? [s.detector.words] : [])];
  if (view.p) view.remarks.push(s.model.parameters.map((p, j) => `${p.name} = ${view.p[j]}`).join(", "));
  return view;
}

function makePanels(host, act, view) {
  const all = [];
  const add = (id, title, help, { wide = false, fits = () => true, make, table, svg = false, png = false }) => {
    const panel = makePanel(host, id, title, help, wide);
    const drawn = make(panel);
    if (table) saveCsv(panel, () => table(view()));
    if (svg) saveSvg(panel);
    if (png) savePng(panel);
    all.push({ section: panel.section, fits, drawn, draw: drawn.draw });
  };
  const fitted = (v) => !!v.s.model;
  add("maps", "Hemisphere", "Equal-area maps over θr (centre 0°, edge 90°) and φ (180° is forward). Points: measured; crosses: masked; hatched: not measured, or beyond the largest θr measured. Square: mirror direction; star: source. Colours: viridis and PuOr, which colour-blind readers can tell apart.", {
    wide: true, make: (panel) => makeMaps(panel, act), table: pointTable, png: true,
  });
  add("lobe", "Lobe", "Drag to turn. Dark dots: measured. Grey: beyond the largest θr measured.", { make: (panel) => makeLobe(panel, act), table: pointTable, png: true });
  add("cut", "Cut through the cursor", "Points with ±σ: measured; line and band: model ±1σ of its parameters; grey: beyond what was measured. Click to move the cursor.", { make: (panel) => makeCut(panel, act), table: cutTable, svg: true });
  add("spectrum", "Spectrum at the cursor", "", { make: (panel) => makeSpectrum(panel, act), table: spectrumTable, svg: true });
  const here = (v) => !!v.f;
  add("slice", "Half and difference angle", "The model at φi as shown; points: measured, whose φd is near; grey: beyond the largest θi or θr measured. Left: mirror directions; below: back to the source; above: grazing. Click to move incident angle and cursor.", { fits: here, make: (panel) => makeSlice(panel, act), table: sliceTable, png: true });
  add("sphere", "Lit sphere", "", { fits: here, make: (panel) => makeSphere(panel, act), table: sphereTable, png: true });
  add("live", "Parameters by hand", "Curves: ln E along each parameter with the others as they are; solid mark: here, dashed: the optimum.", { fits: fitted, make: (panel) => makeLive(panel, act), table: liveTable, svg: true });
  add("strip", "Parameters over wavelength", "Bands: ±1σ. Open marks: at a bound or not determined, without uncertainty; crosses: not converged. Click to choose a wavelength.", { wide: true, fits: fitted, make: (panel) => makeStrip(panel, act), table: stripTable, svg: true });
  add("energy", "Energy", "", { fits: (v) => !!v.s.promises, make: (panel) => ({ draw: (v) => v.quick || drawEnergy(panel, v) }), table: energyTable, svg: true });
  add("colour", "Colour in the cut", "", { fits: (v) => !!v.s.model && !v.s.colour.missing && v.s.parameters(v.state.column), make: (panel) => ({ draw: (v) => v.quick || drawColour(panel, v) }), table: colourTable, svg: true });
  add("points", "Points", "", { wide: true, make: (panel) => ({ draw: (v) => v.quick || drawTable(panel, v, act) }), table: pointTable });
  return all;
}

// What a reader can do; each changes the state and asks for a picture, quick ones while something moves.
function makeActs(state, subjects, moving, still) {
  const s = () => subjects[state.subject];
  const zenith = (v) => Math.max(0, Math.min(89.99, v));
  const act = {
    set(changes) {
      Object.assign(state, changes);
      still();
    },
    subject(place) {
      const nm = s().nm ? s().nm[state.column] : null;
      Object.assign(state, { subject: place, live: null, hold: null });
      state.column = nm === null ? 0 : nearestColumn(s(), nm);
      if (!s().azimuths.includes(state.phiI)) state.phiI = s().azimuths[0];
      if (!ratioChoices(state, subjects).some(([key]) => key === state.ratio)) state.ratio = "mean";
      still();
    },
    column(place, direct = place) {
      if (direct === null || direct === state.column) return;
      Object.assign(state, { column: direct, live: null });
      moving();
    },
    incident(value) {
      const near = s().angles.find((a) => Math.abs(a - value) <= 0.5);
      state.thetaI = near === undefined ? value : near;
      moving();
    },
    azimuth(value) {
      const near = s().azimuths.find((a) => Math.abs(fold(a - value)) <= 1);
      state.phiI = near === undefined ? value : near;
      moving();
    },
    neighbour(step) {
      const list = step > 0 ? s().angles.filter((a) => a > state.thetaI + SAME_ANGLE) : s().angles.filter((a) => a < state.thetaI - SAME_ANGLE).reverse();
      if (list.length) act.set({ thetaI: list[0] });
    },
    direction(thetaR, phi) {
      Object.assign(state, { thetaR: zenith(thetaR), phi: (phi + 360) % 360 });
      still();
    },
    // A place on a map; a measured direction nearby takes the cursor. `reach`: on the unit disc.
    point(thetaR, phi, reach) {
      const [x, y] = discOf(thetaR, phi);
      let best = reach;
      let found = [thetaR, phi];
      for (const n of s().rows(state.thetaI, state.phiI)) {
        const [a, b] = discOf(s().thetaR[n], s().phi[n]);
        const gap = Math.hypot(a - x, b - y);
        if (gap < best) [best, found] = [gap, [s().thetaR[n], s().phi[n]]];
      }
      Object.assign(state, { thetaR: zenith(found[0]), phi: (found[1] + 360) % 360 });
      moving();
    },
    step(zenithStep, azimuthStep) {
      let [t, phi] = [state.thetaR + zenithStep, state.phi + azimuthStep];
      if (t < 0) [t, phi] = [-t, phi + 180];
      act.direction(t, (phi + 360) % 360);
    },
    mirror: () => act.direction(state.thetaI, 180),
    along(signed) {
      const found = rowsInPlane({ s: s(), state }).find(([t]) => Math.abs(t - signed) < 1);
      const t = found ? found[0] : signed;
      act.direction(Math.abs(t), t < 0 ? state.phi + 180 : state.phi);
    },
    turn(dx, dy) {
      state.azimuth = fold(state.azimuth - dx);
      state.elevation = Math.max(-10, Math.min(90, state.elevation + dy));
      moving("lobe");
    },
    rest: () => still("lobe"),
    zoom(factor) {
      state.zoom = Math.max(ZOOMS[0], Math.min(ZOOMS[1], state.zoom * factor));
      moving("lobe");
    },
    span(factor) {
      state.span = Math.max(SPANS[0], Math.min(SPANS[1], state.span * factor));
      still("cut");
    },
    light(dx, dy) {
      state.light = [fold(state.light[0] + dx), Math.max(-80, Math.min(80, state.light[1] + dy))];
      moving("sphere");
    },
    difference(value) {
      state.phiD = Math.max(0, Math.min(180, value));
      moving("slice");
    },
    // A place of the slice: incident angle and cursor go there.
    half(thetaH, thetaD) {
      const at = directionsOfHalf(Math.max(0, Math.min(89, thetaH)), Math.max(0, Math.min(89, thetaD)), state.phiD);
      if (!at || at.thetaI > 89) return;
      Object.assign(state, { thetaI: at.thetaI, thetaR: zenith(at.thetaR), phi: at.phi });
      moving();
    },
    halfStep(h, d) {
      const at = halfOfDirections(state.thetaI, state.thetaR, state.phi);
      act.half(at.thetaH + h, at.thetaD + d);
    },
    hold(on) {
      const { scale } = lookAt(state, subjects, true);
      act.set({ hold: on ? [scale.lo, scale.hi] : null });
    },
    parameter(place, value) {
      const p = Float64Array.from(state.live || s().parameters(state.column));
      p[place] = value;
      state.live = p;
      moving();
    },
    live(value) {
      state.live = value;
      still();
    },
    copy() {
      const words = [...document.querySelectorAll("#readout [data-value]")].map((e) => `${e.dataset.name}\t${e.dataset.value}`);
      const done = (text) => (document.getElementById("copy").textContent = text);
      const way = navigator.clipboard ? navigator.clipboard.writeText(words.join("\n")) : Promise.reject(new Error("none"));
      way.then(() => done("copied"), () => copyByHand(words.join("\n"), done));
      setTimeout(() => done("copy"), 1500);
    },
  };
  return act;
}

// Where a browser gives no clipboard to a page from a file.
function copyByHand(text, done) {
  const area = document.createElement("textarea");
  area.value = text;
  document.body.append(area);
  area.select();
  done(document.execCommand("copy") ? "copied" : "not allowed here");
  area.remove();
}

function showReadout(view) {
  const { s, state } = view;
  const near = nearestRow(s, state);
  const parts = [
    ["theta_i_deg", "θi", state.thetaI, "°"],
    ...(s.azimuths.length > 1 || (s.model && s.model.needs_phi) ? [["phi_i_deg", "φi", state.phiI, "°"]] : []),
    ["theta_r_deg", "θr", state.thetaR, "°"],
    ["phi_deg", "φ", state.phi, "°"],
    [s.nm ? "wavelength_nm" : "band", s.nm ? "λ" : "band", s.nm ? s.nm[state.column] : s.labels[state.column], s.nm ? " nm" : ""],
  ];
  const item = (name, words, value, unit, digits = 6) =>
    `<span class="item"><span>${words}</span> <b data-name="${name}" data-value="${value}">${typeof value === "number" ? number(value, digits) : escapeText(value)}${unit}</b></span>`;
  const html = parts.map((p) => item(...p));
  const there = near.row >= 0 && near.gap <= SAME_ANGLE;
  if (there && s.usable(near.row, state.column)) {
    const [f, e] = [s.measured(near.row, state.column), s.error(near.row, state.column)];
    html.push(item("measured_per_sr", "measured", f, Number.isFinite(e) ? ` ± ${number(e, 3)} 1/sr` : " 1/sr", 7));
    if (view.seen) {
      const seen = view.seen(near.row);
      const gap = f - seen;
      if (s.detector.words) html.push(item("seen_per_sr", "seen", seen, " 1/sr", 7));
      html.push(item("deviation_percent", "deviation", (100 * gap) / f, Number.isFinite(gap / e) ? ` %, ${number(gap / e, 3)} σ` : " %", 3));
    }
  } else {
    html.push(`<span class="item">${there ? `masked: ${escapeText(reason(s, near.row, state.column))}` : "not measured here"}</span>`);
  }
  if (view.f) {
    const where = [state.thetaI, state.phiI, state.thetaR, state.phi];
    const e = view.uncertainty ? view.uncertainty(...where) : NaN;
    html.push(item("model_per_sr", "model", view.f(...where), Number.isFinite(e) ? ` ± ${number(e, 3)} 1/sr` : " 1/sr", 7));
    const k = state.column;
    html.push(`<span class="item status">${state.live ? "parameters set by hand" : escapeText(s.fit.status[k])}${s.fit.remarks[s.fit.remark[k]] && !state.live ? `: ${escapeText(s.fit.remarks[s.fit.remark[k]])}` : ""}</span>`);
  } else if (s.model) html.push('<span class="item status">nothing is fitted at this wavelength</span>');
  document.getElementById("readout").innerHTML = html.join(" ");
}

function showAbout(host, s) {
  const pairs = (rows) => `<table>${rows.map(([k, v]) => `<tr><th scope="row">${escapeText(k)}</th><td>${escapeText(v)}</td></tr>`).join("")}</table>`;
  const lines = [...s.warnings, ...s.words];
  const colour = s.colour.missing && s.model ? [`no colour: ${s.colour.missing}`] : [];
  host.innerHTML =
    `<h2>Warnings</h2>${lines.length ? `<ul class="warnings">${lines.map((l) => `<li>${escapeText(l)}</li>`).join("")}</ul>` : "<p>None.</p>"}` +
    `<h2>What this is</h2>${pairs(s.summary)}${colour.map((l) => `<p>${escapeText(l)}</p>`).join("")}` +
    `<h2>Provenance</h2>${s.provenance.length ? pairs(s.provenance) : "<p>The file names none.</p>"}`;
  const seen = document.getElementById("seen");
  seen.textContent = s.model ? s.detector.words : "";
  seen.hidden = !seen.textContent;
  document.getElementById("name").textContent = s.name;
  const count = document.getElementById("count");
  count.textContent = `${counted(s.count, "direction")} × ${counted(s.columns, s.nm ? "wavelength" : "band")}${s.model ? `, model ${s.model.name}` : ", not fitted"}`;
  const warn = document.getElementById("warn");
  warn.hidden = !lines.length;
  warn.textContent = counted(lines.length, "warning");
}
