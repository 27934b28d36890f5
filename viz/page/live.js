// Parameters by hand: sliders that start at the optimum, with E beside them and its course along each one.

const STEPS = 400;
const COURSE = 41;
const MOST_FOR_COURSES = 12000;

// From a slider's place in [0, 1] to a value, and back.
function slideOf(row, bounds) {
  const [a, b] = bounds;
  if (!row.log) return { value: (t) => a + t * (b - a), place: (v) => (v - a) / (b - a) };
  const least = row.floor || Math.min(Math.abs(a), Math.abs(b)) || 1e-12;
  const [lo, hi] = [Math.max(Math.min(Math.abs(a), Math.abs(b)), least), Math.max(Math.abs(a), Math.abs(b))];
  return {
    value: (t) => row.sign * lo * (hi / lo) ** t,
    place: (v) => Math.log(Math.max(row.sign * v, lo) / lo) / Math.log(hi / lo),
  };
}

function makeLive(panel, act) {
  panel.figure.className = "figure live";
  let shown = "";
  let inputs = [];
  const build = (view) => {
    const { s } = view;
    const bounds = boundsOf(s);
    panel.figure.innerHTML = `<p class="verdict" aria-live="polite"></p><div class="rows"></div><button type="button" class="reset">back to the optimum</button>`;
    panel.figure.querySelector(".reset").addEventListener("click", () => act.live(null));
    inputs = s.model.parameters.map((row, j) => {
      if (row.given === "wavelength") return null;
      const slide = slideOf(row, bounds[j]);
      const box = document.createElement("div");
      box.className = "row";
      const words = `${row.name}${row.unit ? `, ${row.unit}` : ""}: ${row.meaning}`;
      box.innerHTML =
        `<label title="${escapeText(words)}">${escapeText(row.name)}</label><input type="range" min="0" max="${STEPS}" step="any" aria-label="${escapeText(words)}">` +
        `<input type="number" step="any" aria-label="${escapeText(words)}, value"><span class="course"></span>`;
      panel.figure.querySelector(".rows").append(box);
      const [range, field] = box.querySelectorAll("input");
      range.addEventListener("input", () => act.parameter(j, slide.value(Number(range.value) / STEPS)));
      field.addEventListener("change", () => {
        if (field.value !== "" && Number.isFinite(Number(field.value))) act.parameter(j, Number(field.value));
      });
      return { row, range, field, slide, course: box.querySelector(".course") };
    });
  };
  return {
    draw(view) {
      const { s, state } = view;
      if (shown !== state.subject) {
        shown = state.subject;
        build(view);
      }
      const best = s.parameters(state.column);
      const verdict = panel.figure.querySelector(".verdict");
      panel.figure.querySelector(".rows").hidden = !best;
      panel.figure.querySelector(".reset").hidden = !state.live;
      if (!best) {
        verdict.textContent = "Nothing is fitted at this wavelength.";
        return;
      }
      panel.help.textContent = hasCourses(s)
        ? "Curves: ln E along each parameter with the others as they are; solid mark: here, dashed: the optimum."
        : `Without curves of E: ${s.detector.why || `${s.detector.count} directions or nodes are too many for them`}.`;
      const least = s.objective(best, state.column, false);
      const here = state.live ? s.objective(view.p, state.column) : least;
      const over = s.fit.thinned ? ", over the directions in this page" : "";
      if (state.live && s.detector.why) {
        verdict.textContent = `E at the optimum is ${number(least, 6)}${over}. For parameters set by hand it is not computed here: ${s.detector.why}.`;
      } else {
        verdict.innerHTML = `E = <b data-value="${here}">${number(here, 6)}</b>${state.live ? ` &nbsp; at the optimum ${number(least, 6)}, ${number(here / least, 4)} times less` : " at the optimum"}${over}`;
      }
      inputs.forEach((input, j) => {
        if (!input) return;
        if (document.activeElement !== input.range) input.range.value = STEPS * Math.max(0, Math.min(1, input.slide.place(view.p[j])));
        if (document.activeElement !== input.field) input.field.value = Number(view.p[j].toPrecision(8));
        if (!view.quick) input.course.innerHTML = courseSvg(view, input, j, best);
      });
    },
  };
}

// ln E along one parameter, the others as they are: [value, ln E] at places of its slider.
function courseOf(view, row, j, bounds) {
  const { s, state } = view;
  const slide = slideOf(row, bounds);
  const p = Float64Array.from(view.p);
  return Array.from({ length: COURSE }, (_, k) => {
    p[j] = slide.value(k / (COURSE - 1));
    return [p[j], Math.log(s.objective(p, state.column))];
  });
}

// Whether E is known along the parameters, and quick enough to follow a slider.
const hasCourses = (s) => !s.detector.why && s.detector.count <= MOST_FOR_COURSES;

const boundsOf = (s) => s.fit.bounds || s.model.parameters.map((p) => p.bounds);

function liveTable(view) {
  const { s, state } = view;
  const best = s.parameters(state.column);
  const rows = [];
  s.model.parameters.forEach((row, j) => {
    if (!best || row.given === "wavelength") return;
    rows.push([row.name, "here", view.p[j], s.objective(view.p, state.column, !!state.live)], [row.name, "optimum", best[j], s.objective(best, state.column, false)]);
    if (!hasCourses(s)) return;
    for (const [value, lnE] of courseOf(view, row, j, boundsOf(s)[j])) rows.push([row.name, "along", value, Math.exp(lnE)]);
  });
  return { names: ["parameter", "place", "value", "E"], rows, remarks: view.remarks };
}

// The floor of the course is why the optimum is where it is.
function courseSvg(view, input, j, best) {
  const { s } = view;
  if (!hasCourses(s)) return "";
  const values = courseOf(view, input.row, j, boundsOf(s)[j]).map(([, v]) => v);
  const good = values.filter(Number.isFinite);
  if (good.length < 2) return "";
  const [lo, hi] = [Math.min(...good), Math.max(...good)];
  const [w, h] = [120, 30];
  const at = (k, v) => `${((k / (COURSE - 1)) * w).toFixed(1)},${(h - 3 - ((v - lo) / (hi - lo || 1)) * (h - 6)).toFixed(1)}`;
  const line = values.map((v, k) => (Number.isFinite(v) ? at(k, v) : "")).filter(Boolean).join(" ");
  const mark = (t, colour, dash) => {
    const x = Math.max(0, Math.min(1, t)) * w;
    return `<line x1="${x}" x2="${x}" y1="0" y2="${h}" stroke="${colour}" ${dash}/>`;
  };
  return (
    `<svg viewBox="0 0 ${w} ${h}" width="${w}" height="${h}" role="img" aria-label="ln E along ${escapeText(input.row.name)}">` +
    `${mark(input.slide.place(best[j]), "var(--cursor)", 'stroke-dasharray="3 2"')}${mark(input.slide.place(view.p[j]), "var(--ink)", "")}` +
    `<polyline points="${line}" fill="none" stroke="var(--accent)" stroke-width="1.5"/></svg>`
  );
}
