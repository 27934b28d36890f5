// Colours: viridis for values and PuOr for differences, which colour-blind readers can tell apart too; those of
// lines and words come from the style sheet, which knows light, dark and print.

let TABLES = null;

function setTables(tables) {
  const parse = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  TABLES = Object.fromEntries(Object.entries(tables).map(([name, list]) => [name, list.map(parse)]));
}

// Colour of a place t in [0, 1]; grey where there is none.
function colourAt(t, table) {
  if (Number.isNaN(t)) return [128, 128, 128];
  return TABLES[table][Math.max(0, Math.min(255, Math.round(255 * t)))];
}

const rgbText = (c) => `rgb(${c[0]},${c[1]},${c[2]})`;

function theme() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["ink", "soft", "line", "paper", "panel", "grey", "accent", "point", "cursor"];
  return Object.fromEntries(names.map((name) => [name, of(name)]));
}

function parseColour(text) {
  const hex = text.replace("#", "");
  return [0, 2, 4].map((k) => parseInt(hex.slice(k, k + 2), 16));
}

const mixed = (a, b, t) => a.map((v, k) => Math.round(v + (b[k] - v) * t));
