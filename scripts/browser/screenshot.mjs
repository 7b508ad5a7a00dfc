// Screenshots as numbers: what a reader sees, without fonts and anti-aliasing.

// Brightness (0 to 1) of the cells of a grid over a PNG, and the boxes of pixels that differ between two PNGs. Decoded by a page of the
// browser itself.
const decode = `async (base64) => {
  const blob = await (await fetch('data:image/png;base64,' + base64)).blob();
  const bitmap = await createImageBitmap(blob);
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}`;

const base64 = (png) => Buffer.from(png).toString('base64');

// Mean brightness of each cell, row by row.
export async function grid(tool, png, columns = 16, rows = 8) {
  return tool.evaluate(`(async () => {
    const { data, width, height } = await (${decode})('${base64(png)}');
    const [columns, rows] = [${columns}, ${rows}];
    const sums = new Array(columns * rows).fill(0), counts = new Array(columns * rows).fill(0);
    for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
      const cell = Math.floor((y * rows) / height) * columns + Math.floor((x * columns) / width);
      const at = 4 * (y * width + x);
      sums[cell] += (0.299 * data[at] + 0.587 * data[at + 1] + 0.114 * data[at + 2]) / 255;
      counts[cell] += 1;
    }
    return sums.map((sum, cell) => sum / Math.max(1, counts[cell]));
  })()`);
}

// Number of pixels that differ between two PNGs of one size (to a pixel), inside of any box [x1, y1, x2, y2] and outside of all.
export async function changes(tool, before, after, boxes) {
  return tool.evaluate(`(async () => {
    const [a, b] = [await (${decode})('${base64(before)}'), await (${decode})('${base64(after)}')];
    // An element that begins between two pixels may be a pixel larger.
    if (Math.abs(a.width - b.width) > 1 || Math.abs(a.height - b.height) > 1) {
      throw new Error(\`pictures of two sizes: \${a.width} × \${a.height}, \${b.width} × \${b.height}\`);
    }
    const [width, height] = [Math.min(a.width, b.width), Math.min(a.height, b.height)];
    const boxes = ${JSON.stringify(boxes)};
    const out = { inside: 0, outside: 0 };
    for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
      const [inA, inB] = [4 * (y * a.width + x), 4 * (y * b.width + x)];
      const apart = Math.max(...[0, 1, 2].map((k) => Math.abs(a.data[inA + k] - b.data[inB + k])));
      if (apart > 24) out[boxes.some(([x1, y1, x2, y2]) => x >= x1 && x <= x2 && y >= y1 && y <= y2) ? 'inside' : 'outside'] += 1;
    }
    return out;
  })()`);
}

// Largest and mean difference of two grids.
export function apart(a, b) {
  const all = a.map((value, k) => Math.abs(value - b[k]));
  return { most: Math.max(...all), mean: all.reduce((sum, value) => sum + value, 0) / all.length };
}
