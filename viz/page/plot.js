// A plot as SVG: axes, lines, bands, points with bars.

const fontSize = () => parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.8;

function makePlot({ width, height, x, y, label, zero = false }) {
  const font = fontSize();
  const left = font * 5.2;
  const right = font * 1.2;
  const top = font * 1.1;
  const bottom = font * (x.label ? 3.6 : 1.2);
  const w = Math.max(40, width - left - right);
  const h = Math.max(30, height - top - bottom);
  const side = (axis, lo, size, flip) => (v) => {
    const t = axis.log ? Math.log(v / axis.lo) / Math.log(axis.hi / axis.lo) : (v - axis.lo) / (axis.hi - axis.lo);
    return lo + size * (flip ? 1 - t : t);
  };
  const px = side(x, left, w, false);
  const py = side(y, top, h, true);
  const marks = [];
  const clip = `clip-${Math.random().toString(36).slice(2)}`;
  const xTicks = x.ticks || (x.log ? logTicks(x.lo, x.hi) : ticks(x.lo, x.hi, Math.max(2, Math.floor(w / (font * 6)))));
  const yTicks = y.ticks || (y.log ? logTicks(y.lo, y.hi) : ticks(y.lo, y.hi, Math.max(3, Math.floor(h / (font * 3)))));
  const frame = [];
  for (const v of yTicks) {
    const at = py(v);
    frame.push(`<line x1="${left}" x2="${left + w}" y1="${at}" y2="${at}" stroke="var(--line)"/>`);
    frame.push(text(left - font * 0.4, at + font * 0.35, number(v, 4), "end"));
  }
  const names = x.names || ((v) => number(v, 6));
  for (const v of xTicks) {
    const at = px(v);
    frame.push(`<line x1="${at}" x2="${at}" y1="${top + h}" y2="${top + h + font * 0.35}" stroke="var(--ink)"/>`);
    if (x.label) frame.push(text(at, top + h + font * 1.5, names(v), "middle"));
  }
  if (x.label) frame.push(text(left + w / 2, top + h + font * 3, x.label, "middle"));
  if (y.label) {
    const at = `${font * 0.9},${top + h / 2}`;
    frame.push(`<text x="${font * 0.9}" y="${top + h / 2}" transform="rotate(-90 ${at})" text-anchor="middle">${escapeText(y.label)}</text>`);
  }
  if (zero && y.lo < 0 && y.hi > 0) {
    frame.push(`<line x1="${left}" x2="${left + w}" y1="${py(0)}" y2="${py(0)}" stroke="var(--ink)"/>`);
  }
  frame.push(`<rect x="${left}" y="${top}" width="${w}" height="${h}" fill="none" stroke="var(--soft)"/>`);

  function text(atX, atY, words, anchor) {
    return `<text x="${atX.toFixed(1)}" y="${atY.toFixed(1)}" text-anchor="${anchor}">${escapeText(words)}</text>`;
  }
  const inside = (v, axis) => Number.isFinite(v) && (!axis.log || v > 0);
  const point = ([a, b]) => `${px(a).toFixed(1)},${Math.max(-9999, Math.min(9999, py(b))).toFixed(1)}`;
  // Runs of points without a hole in them.
  function runs(points) {
    const out = [];
    let run = [];
    for (const p of points) {
      if (inside(p[0], x) && p.slice(1).every((v) => inside(v, y))) run.push(p);
      else if (run.length) {
        out.push(run);
        run = [];
      }
    }
    if (run.length) out.push(run);
    return out;
  }
  return {
    px,
    py,
    area: { left, top, width: w, height: h },
    line(points, colour = "var(--accent)", dash = "", width = 1.8) {
      for (const run of runs(points)) {
        marks.push(
          run.length === 1
            ? `<circle cx="${px(run[0][0])}" cy="${py(run[0][1])}" r="3" fill="${colour}"/>`
            : `<polyline points="${run.map(point).join(" ")}" fill="none" stroke="${colour}" stroke-width="${width}"${dash ? ` stroke-dasharray="${dash}"` : ""}/>`,
        );
      }
    },
    // Each point: x, lower, upper.
    band(points, colour = "var(--accent)") {
      for (const run of runs(points)) {
        if (run.length < 2) continue;
        const there = run.map((p) => point([p[0], p[2]]));
        const back = run.map((p) => point([p[0], p[1]])).reverse();
        marks.push(`<polygon points="${there.concat(back).join(" ")}" fill="${colour}" fill-opacity="0.22"/>`);
      }
    },
    dot(a, b, error, { colour = "var(--point)", open = false, ring = false, cross = false, size = 3 } = {}) {
      if (!inside(a, x) || !inside(b, y)) return;
      const [cx, cy] = [px(a), py(b)];
      if (error > 0) {
        const low = y.log && b - error <= 0 ? top + h : py(b - error);
        marks.push(`<line x1="${cx}" x2="${cx}" y1="${low.toFixed(1)}" y2="${py(b + error).toFixed(1)}" stroke="${colour}"/>`);
      }
      if (cross) {
        const d = size;
        marks.push(`<path d="M${cx - d} ${cy - d}l${2 * d} ${2 * d}m0 ${-2 * d}l${-2 * d} ${2 * d}" stroke="${colour}" stroke-width="1.5"/>`);
      } else {
        marks.push(`<circle cx="${cx.toFixed(1)}" cy="${cy.toFixed(1)}" r="${size}" fill="${ring ? "none" : open ? "var(--panel)" : colour}" stroke="${colour}"/>`);
      }
    },
    // From low to high, with short lines across at both ends.
    bar(a, low, high, colour = "var(--ink)") {
      if (!inside(a, x) || !Number.isFinite(low) || !Number.isFinite(high)) return;
      const end = (v) => Math.max(-9999, Math.min(9999, y.log && v <= 0 ? top + h + 9 : py(v)));
      const [cx, below, above] = [px(a), end(low), end(high)];
      const cap = (at) => `M${(cx - 3).toFixed(1)} ${at.toFixed(1)}h6`;
      marks.push(`<path d="M${cx.toFixed(1)} ${below.toFixed(1)}V${above.toFixed(1)}${cap(below)}${cap(above)}" stroke="${colour}" fill="none"/>`);
    },
    upright(a, colour = "var(--cursor)") {
      if (!inside(a, x)) return;
      marks.push(`<line x1="${px(a)}" x2="${px(a)}" y1="${top}" y2="${top + h}" stroke="${colour}" stroke-dasharray="4 3"/>`);
    },
    shade(from, to) {
      const [a, b] = [px(Math.max(from, x.lo)), px(Math.min(to, x.hi))];
      if (b > a) marks.unshift(`<rect x="${a}" y="${top}" width="${b - a}" height="${h}" fill="var(--grey)" fill-opacity="0.25"/>`);
    },
    note(words) {
      marks.push(text(left + w / 2, top + h / 2, words, "middle"));
    },
    svg() {
      return (
        `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" role="img"` +
        ` aria-label="${escapeText(label)}" font-size="${font}" font-family="system-ui, sans-serif" fill="var(--ink)">` +
        `<title>${escapeText(label)}</title><defs><clipPath id="${clip}"><rect x="${left}" y="${top}" width="${w}" height="${h}"/></clipPath></defs>` +
        `${frame.join("")}<g clip-path="url(#${clip})">${marks.join("")}</g></svg>`
      );
    },
  };
}

// A range around values, for an axis.
function axisRange(values, log, pad = 0.06) {
  let lo = Infinity;
  let hi = -Infinity;
  for (const v of values) {
    if (!Number.isFinite(v) || (log && v <= 0)) continue;
    lo = Math.min(lo, v);
    hi = Math.max(hi, v);
  }
  if (!(hi >= lo)) return { lo: log ? 0.1 : 0, hi: 1, log };
  if (log) {
    lo = Math.max(lo, hi / LARGEST_RANGE);
    const grow = Math.max((hi / lo) ** pad, 1.05);
    return { lo: lo / grow, hi: hi * grow, log };
  }
  // Values that differ by rounding are one value.
  const size = Math.max(Math.abs(lo), Math.abs(hi));
  const grow = hi - lo > 1e-9 * size ? (hi - lo) * pad : size * 0.05 || 1;
  return { lo: lo - grow, hi: hi + grow, log };
}
