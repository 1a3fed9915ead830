// Painting of the plan's backgrounds and marks. A view is {context, size: CSS pixels,
// scale: pixels per metre, toScreen, toMap}.
import { color, heat } from './theme.js';

export function paintCloud(view, cloud, cut) {
  const { context } = view;
  const { canvas } = context;
  const ratio = devicePixelRatio;
  const image = context.createImageData(canvas.width, canvas.height);
  const pixels = new Uint32Array(image.data.buffer);
  const table = Uint32Array.from({ length: 256 }, (_, i) => {
    const [red, green, blue] = heat(i / 255);
    return (255 << 24) | (blue << 16) | (green << 8) | red;
  });
  const span = Math.max(0.1, Math.min(cloud.high, cut) - cloud.low);
  // so that surfaces have no holes
  const thick = Math.max(1, Math.round(ratio * Math.min(8, Math.max(1, cloud.spacing * view.scale))));
  const [wide, high] = [canvas.width, canvas.height];
  for (let i = 0; i < cloud.x.length && cloud.z[i] <= cut; ++i) {
    const [x, y] = view.toScreen(cloud.x[i], cloud.y[i]);
    const u = Math.round(x * ratio);
    const v = Math.round(y * ratio);
    if (u < 0 || v < 0 || u + thick > wide || v + thick > high) continue;
    const paint = table[Math.min(255, Math.max(0, Math.round((255 * (cloud.z[i] - cloud.low)) / span)))];
    for (let b = 0; b < thick; ++b) pixels.fill(paint, (v + b) * wide + u, (v + b) * wide + u + thick);
  }
  context.putImageData(image, 0, 0);
}

const roundStep = (value) => {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value);
};

/** Lines at round metres (optional). Returns a function that writes the numbers, to be called last. */
export function paintGrid(view, withLines) {
  const { context, size } = view;
  const step = roundStep(80 / view.scale);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const [x0, y0] = view.toMap(0, size[1]);
  const [x1, y1] = view.toMap(size[0], 0);
  const labels = [
    ['y, m', 6, 16, 'left'],
    ['x, m', 6, size[1] - 6, 'left'],
  ];
  context.strokeStyle = color('grid');
  context.lineWidth = 1;
  context.beginPath();
  for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
    const [u] = view.toScreen(x, 0);
    context.moveTo(u, 0);
    context.lineTo(u, size[1]);
    const text = x.toFixed(digits);
    if (u > 54 && u + 4 * text.length < size[0]) labels.push([text, u, size[1] - 6, 'center']);
  }
  for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
    const [, v] = view.toScreen(0, y);
    context.moveTo(0, v);
    context.lineTo(size[0], v);
    if (v < size[1] - 24 && v > 34) labels.push([y.toFixed(digits), 6, v - 3, 'left']);
  }
  if (withLines) context.stroke();
  return () => {
    context.font = '12px system-ui, sans-serif';
    context.lineWidth = 3;
    context.lineJoin = 'round';
    context.strokeStyle = color('halo');
    context.fillStyle = color('ink');
    for (const [text, u, v, align] of labels) {
      context.textAlign = align;
      context.strokeText(text, u, v);
      context.fillText(text, u, v);
    }
  };
}

const LONGEST_GAP = 5; // points without a position that a line joins; where an estimator was lost, there are more

export function paintTrack(view, { x, y }, paint, width) {
  const { context } = view;
  context.strokeStyle = paint;
  context.lineWidth = width;
  context.lineJoin = context.lineCap = 'round';
  context.beginPath();
  let missing = LONGEST_GAP;
  for (let i = 0; i < x.length; ++i) {
    if (x[i] == null) {
      ++missing;
      continue;
    }
    const [u, v] = view.toScreen(x[i], y[i]);
    if (missing < LONGEST_GAP) context.lineTo(u, v);
    else context.moveTo(u, v);
    missing = 0;
  }
  context.stroke();
}

export function paintDisk(view, x, y, radius, fill) {
  const [u, v] = view.toScreen(x, y);
  view.context.beginPath();
  view.context.arc(u, v, radius, 0, 7);
  view.context.fillStyle = fill;
  view.context.fill();
}

/** Triangles, distinct from poses even in print; numbered as in the table if there is room. */
export function paintPlaces(view, places) {
  const { context } = view;
  for (const place of places) {
    const [u, v] = view.toScreen(place.x, place.y);
    context.beginPath();
    context.moveTo(u, v - 9);
    context.lineTo(u + 8, v + 6);
    context.lineTo(u - 8, v + 6);
    context.closePath();
    context.fillStyle = color('mark');
    context.strokeStyle = color('halo');
    context.lineWidth = 1.5;
    context.fill();
    context.stroke();
    if (places.length > 60) continue;
    context.font = 'bold 11px system-ui, sans-serif';
    context.textAlign = 'left';
    context.lineWidth = 3;
    context.strokeText(`${place.number}`, u + 9, v - 2);
    context.fillText(`${place.number}`, u + 9, v - 2);
  }
}
