// Triangles, lines and dots with hidden parts left out, drawn into a picture by hand: the same everywhere, with
// no graphics card and in print.

function makeRaster(size) {
  const colour = new Uint8ClampedArray(size * size * 4);
  const depth = new Float32Array(size * size).fill(-Infinity);
  const set = (place, r, g, b) => {
    colour[4 * place] = r;
    colour[4 * place + 1] = g;
    colour[4 * place + 2] = b;
    colour[4 * place + 3] = 255;
  };
  return {
    size,
    // Corners [x, y, z] in pixels, z towards the reader; colours of the corners (3 each) with shading done.
    triangle(a, b, c, ca, cb, cc) {
      const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
      if (!(Math.abs(area) > 1e-9)) return;
      const x0 = Math.max(0, Math.floor(Math.min(a[0], b[0], c[0])));
      const x1 = Math.min(size - 1, Math.ceil(Math.max(a[0], b[0], c[0])));
      const y0 = Math.max(0, Math.floor(Math.min(a[1], b[1], c[1])));
      const y1 = Math.min(size - 1, Math.ceil(Math.max(a[1], b[1], c[1])));
      for (let y = y0; y <= y1; y++) {
        for (let x = x0; x <= x1; x++) {
          const u = ((b[0] - x) * (c[1] - y) - (c[0] - x) * (b[1] - y)) / area;
          const v = ((c[0] - x) * (a[1] - y) - (a[0] - x) * (c[1] - y)) / area;
          const w = 1 - u - v;
          if (u < -1e-6 || v < -1e-6 || w < -1e-6) continue;
          const z = u * a[2] + v * b[2] + w * c[2];
          const place = y * size + x;
          if (z <= depth[place]) continue;
          depth[place] = z;
          set(place, u * ca[0] + v * cb[0] + w * cc[0], u * ca[1] + v * cb[1] + w * cc[1], u * ca[2] + v * cb[2] + w * cc[2]);
        }
      }
    },
    dot([x, y, z], r, c) {
      for (let j = Math.floor(-r); j <= r; j++) {
        for (let i = Math.floor(-r); i <= r; i++) {
          if (i * i + j * j > r * r + 0.5) continue;
          const [px, py] = [Math.round(x + i), Math.round(y + j)];
          if (px < 0 || py < 0 || px >= size || py >= size) continue;
          const place = py * size + px;
          if (z < depth[place]) continue;
          depth[place] = z;
          set(place, c[0], c[1], c[2]);
        }
      }
    },
    line(a, b, r, c, lift = 0) {
      const steps = Math.max(1, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1])));
      for (let k = 0; k <= steps; k++) {
        const t = k / steps;
        this.dot([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]) + lift], r, c);
      }
    },
    image: () => new ImageData(colour, size, size),
  };
}
