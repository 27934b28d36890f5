// A canvas of a panel that is dragged with the pointer or moved with the arrow keys.

const DEGREES_A_PIXEL = 0.5;
const DEGREES_A_KEY = 5;

// `move(right, down)` is called with degrees, `rest()` when the pointer lets go.
function draggedCanvas(panel, name, label, move, rest = () => {}) {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.className = name;
  canvas.dataset.title = name;
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-label", label);
  panel.figure.append(canvas);
  let last = null;
  canvas.addEventListener("pointerdown", (event) => {
    last = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    move((event.clientX - last[0]) * DEGREES_A_PIXEL, (event.clientY - last[1]) * DEGREES_A_PIXEL);
    last = [event.clientX, event.clientY];
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(kind, () => {
      last = null;
      rest();
    });
  }
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (!(event.key in moves)) return;
    move(...moves[event.key].map((step) => step * DEGREES_A_KEY));
    event.preventDefault();
  });
  return canvas;
}
