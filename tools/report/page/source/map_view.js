// The plan: magnetic map or cloud from above, with all trajectories over it. Drag, wheel, pinch and keys move it.
import { brief, fixed, h, metres, onResize } from './dom.js';
import { driveBox, paintField, strengthAt } from './plan.js';
import { placesOf } from './stale.js';
import { color, heat, onTheme, seriesColor } from './theme.js';

const roundStep = (value) => {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value);
};

export function mapView(state, grounds) {
  const { run } = state;
  const canvas = h('canvas', { tabindex: 0, 'data-chart': 'map', role: 'img',
    'aria-label': 'Plan with trajectories. Arrows move it, plus and minus zoom, 0 shows all.' });
  const tip = h('div', { class: 'tip', hidden: true });
  const key = h('div', { class: 'key', hidden: true });
  const button = (text, label, act) => h('button', { type: 'button', 'aria-label': label, title: label, class: text.length > 1 ? 'wide' : null, onclick: act }, text);
  const element = h('div', { class: 'view' }, canvas, tip, key,
    h('div', { class: 'zoom' }, button('+', 'Zoom in', () => zoomAt(1.6)), button('−', 'Zoom out', () => zoomAt(1 / 1.6)), button('all', 'Show the whole drive', fit)));
  const context = canvas.getContext('2d');
  const box = driveBox(run);
  let ground = grounds.field ? 'field' : grounds.cloud ? 'cloud' : 'none';
  let cut = Infinity;      // points of the cloud above this are left out
  let size = [0, 0];       // CSS pixels
  let scale = 1;           // CSS pixels a metre
  let center = [0.5 * (box.x[0] + box.x[1]), 0.5 * (box.y[0] + box.y[1])];
  let painted = null;      // the raster in the theme's colours
  let scheduled = false;

  const toScreen = (x, y) => [0.5 * size[0] + (x - center[0]) * scale, 0.5 * size[1] - (y - center[1]) * scale];
  const toMap = (u, v) => [center[0] + (u - 0.5 * size[0]) / scale, center[1] - (v - 0.5 * size[1]) / scale];

  /** As high as the drive needs at full width, within what a screen bears. */
  function measure() {
    const width = element.clientWidth;
    if (width === 0) return;
    const wide = box.x[1] - box.x[0] + 4;
    const high = box.y[1] - box.y[0] + 4;
    size = [width, Math.round(Math.min(Math.max((width * high) / wide + 60, 280), Math.max(300, 0.72 * width), 620))];
    element.style.height = `${size[1]}px`;
    canvas.width = Math.round(size[0] * devicePixelRatio);
    canvas.height = Math.round(size[1] * devicePixelRatio);
    fit();
  }

  function fit() {
    const margin = 34;
    scale = Math.min((size[0] - 2 * margin) / Math.max(1, box.x[1] - box.x[0]), (size[1] - 2 * margin) / Math.max(1, box.y[1] - box.y[0]));
    center = [0.5 * (box.x[0] + box.x[1]), 0.5 * (box.y[0] + box.y[1])];
    schedule();
  }

  function zoomAt(factor, u = 0.5 * size[0], v = 0.5 * size[1]) {
    const [x, y] = toMap(u, v);
    scale = Math.min(Math.max(scale * factor, 0.05), 5000);
    center = [x - (u - 0.5 * size[0]) / scale, y + (v - 0.5 * size[1]) / scale];
    schedule();
  }

  function schedule() {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(() => {
      scheduled = false;
      draw();
    });
  }

  function drawField() {
    painted ??= paintField(grounds.field, heat);
    const { field } = grounds;
    const half = 0.5 * field.resolution_m;
    const [u0, v0] = toScreen(field.x_m - half, field.y_m + (field.rows - 0.5) * field.resolution_m);
    context.imageSmoothingEnabled = field.resolution_m * scale < 8;
    context.drawImage(painted, u0, v0, field.columns * field.resolution_m * scale, field.rows * field.resolution_m * scale);
  }

  function drawCloud() {
    const { cloud } = grounds;
    const ratio = devicePixelRatio;
    const image = context.createImageData(canvas.width, canvas.height);
    const pixels = new Uint32Array(image.data.buffer);
    const table = Uint32Array.from({ length: 256 }, (_, i) => {
      const [red, green, blue] = heat(i / 255);
      return (255 << 24) | (blue << 16) | (green << 8) | red;
    });
    const top = Math.min(cloud.high, cut);
    const thick = Math.max(1, Math.round(ratio * Math.min(3, Math.max(1, 0.12 * scale))));
    const [wide, high] = [canvas.width, canvas.height];
    for (let i = 0; i < cloud.x.length; ++i) {
      if (cloud.z[i] > cut) continue;
      const [x, y] = toScreen(cloud.x[i], cloud.y[i]);
      const u = Math.round(x * ratio);
      const v = Math.round(y * ratio);
      if (u < 0 || v < 0 || u + thick > wide || v + thick > high) continue;
      const share = (cloud.z[i] - cloud.low) / (top - cloud.low);
      const paint = table[Math.min(255, Math.max(0, Math.round(255 * share)))];
      for (let b = 0; b < thick; ++b) {
        for (let a = 0; a < thick; ++a) pixels[(v + b) * wide + u + a] = paint;
      }
    }
    context.putImageData(image, 0, 0);
  }

  function drawAxes() {
    const step = roundStep(80 / scale);
    context.strokeStyle = color('grid');
    context.fillStyle = color('quiet');
    context.font = '12px system-ui, sans-serif';
    context.lineWidth = 1;
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const [x0, y0] = toMap(0, size[1]);
    const [x1, y1] = toMap(size[0], 0);
    const labels = [];
    context.beginPath();
    for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
      const [u] = toScreen(x, 0);
      context.moveTo(u, 0);
      context.lineTo(u, size[1]);
      if (u > 44) labels.push([x.toFixed(digits), u, size[1] - 6, 'center']);
    }
    for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
      const [, v] = toScreen(0, y);
      context.moveTo(0, v);
      context.lineTo(size[0], v);
      if (v < size[1] - 24) labels.push([`${y.toFixed(digits)}`, 6, v - 3, 'left']);
    }
    if (ground === 'none') context.stroke();
    return () => {
      context.lineWidth = 3;
      context.lineJoin = 'round';
      context.strokeStyle = color('halo');
      context.fillStyle = color('ink');
      for (const [text, u, v, align] of labels) {
        context.textAlign = align;
        context.strokeText(text, u, v);
        context.fillText(text, u, v);
      }
      context.textAlign = 'left';
      context.strokeText('y, m', 6, 16);
      context.fillText('y, m', 6, 16);
      context.strokeText('x, m', 6, size[1] - 6);
      context.fillText('x, m', 6, size[1] - 6);
    };
  }

  function track({ x, y }, paint, width) {
    context.strokeStyle = paint;
    context.lineWidth = width;
    context.lineJoin = context.lineCap = 'round';
    context.beginPath();
    let down = false;
    for (let i = 0; i < x.length; ++i) {
      if (x[i] == null) continue;
      const [u, v] = toScreen(x[i], y[i]);
      if (down) context.lineTo(u, v);
      else context.moveTo(u, v);
      down = true;
    }
    context.stroke();
  }

  function disk(x, y, radius, fill) {
    const [u, v] = toScreen(x, y);
    context.beginPath();
    context.arc(u, v, radius, 0, 7);
    context.fillStyle = fill;
    context.fill();
  }

  /** Triangles, so that they are told from poses in print too. */
  function drawStale() {
    const places = placesOf(run.estimators[state.detail]);
    for (const place of places) {
      const [u, v] = toScreen(place.x, place.y);
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
    }
    canvas.dataset.marks = places.length;
  }

  function draw() {
    if (size[0] === 0) return;
    const ratio = devicePixelRatio;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (ground === 'cloud') drawCloud();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (ground === 'field') drawField();
    const drawLabels = drawAxes();
    // Lines that lie on each other are told apart by their width: the truth widest, later estimates ever narrower on top.
    const leading = run.truth ?? run.estimators[0].series;
    track(leading, color('halo'), 9);
    if (run.truth) track(run.truth, color('truth'), 7);
    run.estimators.forEach((one, i) => {
      if (state.isShown(one.name)) track(one.series, seriesColor(i), Math.max(1.4, 4.6 - 1.5 * i));
    });
    const first = leading.x.findIndex((value) => value != null);
    if (first >= 0) {
      disk(leading.x[first], leading.y[first], 7, color('halo'));
      disk(leading.x[first], leading.y[first], 5, color('truth'));
      disk(leading.x[first], leading.y[first], 2.5, color('halo'));
    }
    drawStale();
    if (state.moment != null) {
      run.estimators.forEach((one, i) => {
        const { x, y } = one.series;
        if (!state.isShown(one.name) || x[state.moment] == null) return;
        disk(x[state.moment], y[state.moment], 6.5, color('halo'));
        disk(x[state.moment], y[state.moment], 5, seriesColor(i));
      });
    }
    drawLabels();
    canvas.dataset.ground = ground;
    canvas.dataset.tracks = run.estimators.filter((one) => state.isShown(one.name)).length + (run.truth ? 1 : 0);
  }

  function showKey() {
    const range = ground === 'field' ? [grounds.field.low_ut, grounds.field.high_ut] : ground === 'cloud' ? [grounds.cloud.low, Math.min(grounds.cloud.high, cut)] : null;
    key.hidden = !range;
    if (!range) return;
    const bar = h('canvas', { width: 140, height: 1 });
    const inside = bar.getContext('2d');
    for (let i = 0; i < 140; ++i) {
      inside.fillStyle = `rgb(${heat(i / 139).join(' ')})`;
      inside.fillRect(i, 0, 1, 1);
    }
    key.replaceChildren(h('div', {}, ground === 'field' ? '|B|, µT' : 'height, m'), bar,
      h('div', {}, h('span', {}, fixed(range[0], 1)), h('span', {}, fixed(range[1], 1))));
  }

  /** The nearest pose of what is shown, within reach of the pointer. */
  function nearest(u, v) {
    let found = null;
    run.estimators.forEach((one, k) => {
      if (!state.isShown(one.name)) return;
      const { x, y } = one.series;
      for (let i = 0; i < x.length; ++i) {
        if (x[i] == null) continue;
        const [a, b] = toScreen(x[i], y[i]);
        const distance = Math.hypot(a - u, b - v);
        if (distance < (found?.distance ?? 22) - 0.5) found = { distance, index: i, estimator: k };
      }
    });
    return found;
  }

  function describe(found, u, v) {
    const [x, y] = toMap(u, v);
    const lines = [`x ${fixed(x, 2)}  y ${fixed(y, 2)} m`];
    const strength = ground === 'field' ? strengthAt(grounds.field, x, y) : null;
    if (strength != null) lines[0] += `   |B| ${fixed(strength, 1)} µT`;
    if (found) {
      const at = found.index;
      lines.unshift(h('b', {}, `${fixed(run.t[at], 1)} s`));
      run.estimators.forEach((one, i) => {
        if (!state.isShown(one.name) || one.series.x[at] == null) return;
        const error = one.series.error?.[at];
        const sigma = one.series.sigma?.[at];
        lines.push(h('span', {}, h('span', { class: 'swatch', style: { background: seriesColor(i) } }), one.name,
          error != null ? `: ${metres(error)} off` : '', sigma != null ? `, sigma ${metres(sigma)}` : ''));
      });
    }
    for (const place of placesOf(run.estimators[state.detail])) {
      const [a, b] = toScreen(place.x, place.y);
      if (Math.hypot(a - u, b - v) < 12) lines.push(`stale: ${place.row.map((cell) => (Number.isFinite(+cell) ? brief(+cell) : cell)).join(', ')}`);
    }
    tip.replaceChildren(...lines.flatMap((line, i) => (i ? [h('br'), line] : [line])));
    tip.hidden = false;
    const left = u + 16 + tip.offsetWidth > size[0] ? u - 12 - tip.offsetWidth : u + 16;
    tip.style.left = `${Math.max(4, left)}px`;
    tip.style.top = `${Math.min(Math.max(4, v + 14), size[1] - tip.offsetHeight - 4)}px`;
  }

  const pointers = new Map();
  const placeOf = (event) => {
    const frame = canvas.getBoundingClientRect();
    return [event.clientX - frame.left, event.clientY - frame.top];
  };
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, placeOf(event));
  });
  canvas.addEventListener('pointermove', (event) => {
    const now = placeOf(event);
    const before = pointers.get(event.pointerId);
    if (!before) {
      const found = nearest(...now);
      state.point(found ? found.index : null);
      describe(found, ...now);
      return;
    }
    if (pointers.size === 1) {
      center = [center[0] - (now[0] - before[0]) / scale, center[1] + (now[1] - before[1]) / scale];
    } else {
      const [other] = [...pointers.entries()].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const factor = Math.hypot(now[0] - other[0], now[1] - other[1]) / Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1]));
      zoomAt(factor, 0.5 * (now[0] + other[0]), 0.5 * (now[1] + other[1]));
    }
    pointers.set(event.pointerId, now);
    tip.hidden = true;
    schedule();
  });
  for (const event of ['pointerup', 'pointercancel']) canvas.addEventListener(event, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener('pointerleave', () => {
    tip.hidden = true;
    state.point(null);
  });
  canvas.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;  // else the page scrolls
    event.preventDefault();
    zoomAt(Math.exp(-0.002 * event.deltaY), ...placeOf(event));
  }, { passive: false });
  canvas.addEventListener('dblclick', (event) => zoomAt(2, ...placeOf(event)));
  canvas.addEventListener('keydown', (event) => {
    const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (move) center = [center[0] + (60 * move[0]) / scale, center[1] + (60 * move[1]) / scale];
    else if (event.key === '+' || event.key === '=') zoomAt(1.4);
    else if (event.key === '-') zoomAt(1 / 1.4);
    else if (event.key === '0') fit();
    else return;
    event.preventDefault();
    schedule();
  });

  for (const event of ['shown', 'moment', 'detail']) state.on(event, schedule);
  onTheme(() => {
    painted = null;
    showKey();
    draw();
  });
  onResize(element, measure);
  return {
    element,
    measure,
    setGround(name) {
      ground = name;
      showKey();
      schedule();
    },
    setCut(height) {
      cut = height;
      showKey();
      schedule();
    },
    ground: () => ground,
    start() {
      measure();
      showKey();
      draw();
    },
  };
}
