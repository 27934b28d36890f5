// Panels, and what can be saved of each.

function makePanel(host, id, title, help, wide = false) {
  const section = document.createElement("section");
  section.id = id;
  section.className = wide ? "panel wide" : "panel";
  section.setAttribute("aria-labelledby", `${id}-title`);
  section.innerHTML =
    `<header><h2 id="${id}-title">${escapeText(title)}</h2><span class="save" role="group" aria-label="size and files of ${escapeText(title)}"></span></header>` +
    `<div class="figure"></div><p class="help">${escapeText(help)}</p>`;
  host.append(section);
  return { section, figure: section.querySelector(".figure"), help: section.querySelector(".help"), id };
}

// Larger and smaller, for a panel.
function stepButtons(panel, what, act) {
  for (const [sign, words] of [["−", "smaller"], ["+", "larger"]]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = sign;
    button.dataset.step = words;
    button.setAttribute("aria-label", `${what} ${words}`);
    button.addEventListener("click", () => act(sign === "+"));
    panel.section.querySelector(".save").append(button);
  }
}

function saveButton(panel, kind, make) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = kind.toUpperCase();
  button.dataset.kind = kind;
  button.setAttribute("aria-label", `save ${panel.section.querySelector("h2").textContent} as ${kind.toUpperCase()}`);
  button.addEventListener("click", () => make((content, type) => offer(content, `${panel.id}.${kind}`, type)));
  panel.section.querySelector(".save").append(button);
}

function offer(content, name, type) {
  const blob = content instanceof Blob ? content : new Blob([content], { type });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function csvText(names, rows, remarks) {
  const cell = (v) => (typeof v === "number" ? (Number.isFinite(v) ? String(v) : "") : /[",\n]/.test(v) ? `"${v.replaceAll('"', '""')}"` : v);
  const head = remarks.map((line) => `# ${line}`);
  return [...head, names.join(","), ...rows.map((row) => row.map(cell).join(","))].join("\n") + "\n";
}

const saveCsv = (panel, table) =>
  saveButton(panel, "csv", (give) => {
    const { names, rows, remarks = [] } = table();
    give(csvText(names, rows, remarks), "text/csv");
  });

// Plots of a panel as one picture, with the colours of the page written into it.
function wholeSvg(figure) {
  const parts = [...figure.querySelectorAll("svg")];
  const box = figure.getBoundingClientRect();
  let width = 0;
  let height = 0;
  const inner = parts.map((part) => {
    const at = part.getBoundingClientRect();
    const copy = part.cloneNode(true);
    copy.setAttribute("x", at.left - box.left);
    copy.setAttribute("y", at.top - box.top);
    width = Math.max(width, at.right - box.left);
    height = Math.max(height, at.bottom - box.top);
    return copy.outerHTML;
  });
  const colours = theme();
  const text = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"><rect width="100%" height="100%" fill="var(--panel)"/>${inner.join("")}</svg>`;
  return text.replace(/var\(--(\w+)\)/g, (_, name) => colours[name] || "#000");
}

const saveSvg = (panel) => saveButton(panel, "svg", (give) => give(wholeSvg(panel.figure), "image/svg+xml"));

// Canvases of a panel side by side, with their names above.
const savePng = (panel) =>
  saveButton(panel, "png", (give) => {
    const parts = [...panel.figure.querySelectorAll("canvas")].filter((c) => c.width > 0 && c.offsetParent);
    const gap = 12;
    const head = Math.round(fontSize() * 2 * (window.devicePixelRatio || 1));
    const whole = document.createElement("canvas");
    whole.width = parts.reduce((sum, c) => sum + c.width + gap, gap);
    whole.height = Math.max(...parts.map((c) => c.height)) + head + gap;
    const draw = whole.getContext("2d");
    const colours = theme();
    draw.fillStyle = colours.panel;
    draw.fillRect(0, 0, whole.width, whole.height);
    draw.fillStyle = colours.ink;
    draw.font = `${head * 0.5}px system-ui, sans-serif`;
    let x = gap;
    for (const part of parts) {
      draw.fillText(part.dataset.title || "", x, head * 0.7);
      draw.drawImage(part, x, head);
      x += part.width + gap;
    }
    whole.toBlob((blob) => give(blob, "image/png"));
  });
