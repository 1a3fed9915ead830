// The plan's two backgrounds, decoded from the data: the field's raster and the cloud.

function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** {x, y, z: Float32Array, ascending in z; low, high: of z, top: largest z; spacing}, metres; null without a cloud. */
export function decodeCloud(cloud) {
  if (!cloud) return null;
  const view = new DataView(bytesOf(cloud.positions).buffer);
  // Sorted by height: from above, higher points hide lower ones.
  const order = Uint32Array.from({ length: cloud.count }, (_, i) => i).sort(
    (a, b) => view.getUint16(6 * a + 4, true) - view.getUint16(6 * b + 4, true),
  );
  const axes = [0, 1, 2].map((axis) =>
    Float32Array.from(order, (i) => cloud.low_m[axis] + cloud.step_m[axis] * view.getUint16(6 * i + 2 * axis, true)),
  );
  const sorted = axes[2];
  const at = (share) => sorted[Math.floor(share * (sorted.length - 1))];
  // Colours range between quantiles, so that single stray points do not dominate the scale.
  return {
    x: axes[0],
    y: axes[1],
    z: axes[2],
    spacing: cloud.spacing_m ?? 0.1,
    low: at(0.01),
    high: Math.max(at(0.99), at(0.01) + 0.1),
    top: sorted[sorted.length - 1],
  };
}

/** A promise of the raster {grey: Uint8Array, top row first; 0: no field}; null without a field. */
export async function decodeField(field) {
  if (!field) return null;
  const image = new Image();
  image.src = field.image;
  await image.decode();
  const canvas = document.createElement('canvas');
  canvas.width = field.columns;
  canvas.height = field.rows;
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const pixels = context.getImageData(0, 0, field.columns, field.rows).data;
  const grey = new Uint8Array(field.columns * field.rows);
  for (let i = 0; i < grey.length; ++i) grey[i] = pixels[4 * i];
  return { ...field, grey };
}

/** |B| at a place of the map, µT; null without field. */
export function strengthAt(field, x, y) {
  const column = Math.round((x - field.x_m) / field.resolution_m);
  const row = Math.round((y - field.y_m) / field.resolution_m);
  if (column < 0 || row < 0 || column >= field.columns || row >= field.rows) return null;
  const grey = field.grey[(field.rows - 1 - row) * field.columns + column];
  return grey === 0 ? null : field.low_ut + ((grey - 1) / 254) * (field.high_ut - field.low_ut);
}

/** The raster in colours, as a canvas. */
export function paintField(field, heat) {
  const canvas = document.createElement('canvas');
  canvas.width = field.columns;
  canvas.height = field.rows;
  const context = canvas.getContext('2d');
  const image = context.createImageData(field.columns, field.rows);
  const table = Array.from({ length: 255 }, (_, i) => heat(i / 254));
  field.grey.forEach((grey, i) => {
    if (grey === 0) return;
    const [red, green, blue] = table[grey - 1];
    image.data.set([red, green, blue, 255], 4 * i);
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

/** Initial extent of the plan, {x: [low, high], y: [low, high]}: the drive. A lost estimate is ignored. */
export function driveBox(run) {
  const box = { x: [Infinity, -Infinity], y: [Infinity, -Infinity], z: [Infinity, -Infinity] };
  const leading = run.truth ?? run.estimators.find((one) => one.series.x.some((value) => value != null))?.series;
  for (const axis of ['x', 'y', 'z']) {
    for (const value of leading?.[axis] ?? []) {
      if (value == null) continue;
      box[axis][0] = Math.min(box[axis][0], value);
      box[axis][1] = Math.max(box[axis][1], value);
    }
    if (!(box[axis][1] >= box[axis][0])) box[axis] = [-1, 1];
  }
  return box;
}
