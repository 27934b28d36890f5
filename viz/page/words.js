// Numbers and text for reading.

function number(value, digits = 5) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  let text = size >= 1e6 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  if (text.includes(".") && !text.includes("e")) text = text.replace(/\.?0+$/, "");
  if (text.includes("e")) text = text.replace(/\.?0*e\+?/, "e").replace("e-", "e−");
  return text.replace(/^-/, "−");
}

const degrees = (value) => `${number(value, 6)}°`;

const counted = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

function escapeText(text) {
  return String(text).replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
}

// Whole steps of 1, 2 or 5 times a power of ten inside a range.
function ticks(lo, hi, wanted = 5) {
  // Where both ends agree but for rounding there is no step between them.
  if (!(hi - lo > 1e-12 * Math.max(Math.abs(lo), Math.abs(hi)))) return [lo];
  const raw = (hi - lo) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5, 10].find((s) => s * power >= raw * 0.999) || 10);
  const out = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + 1e-9 * step; k++) {
    out.push(Math.abs(k) < 1e-12 ? 0 : Number((k * step).toPrecision(12)));
  }
  return out;
}

// Powers of ten; between them 2 and 5 where there are few, and plain steps where there is none.
function logTicks(lo, hi) {
  const first = Math.ceil(Math.log10(lo) - 1e-9);
  const last = Math.floor(Math.log10(hi) + 1e-9);
  const count = last - first + 1;
  if (count < 2) {
    const fine = [1, 2, 3, 5, 7].flatMap((m) => [first - 1, first].map((k) => m * 10 ** k));
    const inside = fine.filter((v) => v >= lo && v <= hi).sort((a, b) => a - b);
    return inside.length >= 2 ? inside : ticks(lo, hi, 4);
  }
  const every = Math.ceil(count / 7);
  const out = [];
  for (let k = first; k <= last; k += every) out.push(Number(`1e${k}`));
  return out;
}
