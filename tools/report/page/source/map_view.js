// The plan: magnetic map or cloud from above, with all trajectories on top.
import { brief, fixed, h, metres, onResize } from './dom.js';
import { attachGestures } from './gestures.js';
import { driveBox, paintField, strengthAt } from './plan.js';
import { paintCloud, paintDisk, paintGrid, paintPlaces, paintTrack } from './plan_paint.js';
import { placesOf } from './stale.js';
import { color, heat, onTheme, seriesColor } from './theme.js';

export function mapView(state, grounds) {
  const { run } = state;
  const canvas = h('canvas', {
    tabindex: 0,
    'data-chart': 'map',
    role: 'img',
    'aria-label': 'Plan with trajectories. Arrows move it, plus and minus zoom, 0 shows all.',
  });
  const tip = h('div', { class: 'tip', hidden: true });
  const key = h('div', { class: 'key', hidden: true });
  const button = (text, label, act) =>
    h(
      'button',
      { type: 'button', 'aria-label': label, title: label, class: text.length > 1 ? 'wide' : null, onclick: act },
      text,
    );
  const element = h(
    'div',
    { class: 'view' },
    canvas,
    tip,
    key,
    h(
      'div',
      { class: 'zoom' },
      button('+', 'Zoom in', () => zoomAt(1.6)),
      button('−', 'Zoom out', () => zoomAt(1 / 1.6)),
      button('all', 'Show the whole drive', fit),
    ),
  );
  const box = driveBox(run);
  const middle = () => [0.5 * (box.x[0] + box.x[1]), 0.5 * (box.y[0] + box.y[1])];
  let ground = grounds.field ? 'field' : grounds.cloud ? 'cloud' : 'none';
  let cut = Infinity; // points of the cloud above this height are hidden
  let center = middle(); // of the view, metres
  let painted = null; // the raster, painted in the theme's colours
  let scheduled = false;
  const view = {
    context: canvas.getContext('2d'),
    size: [0, 0], // CSS pixels
    scale: 1, // CSS pixels per metre
    toScreen: (x, y) => [
      0.5 * view.size[0] + (x - center[0]) * view.scale,
      0.5 * view.size[1] - (y - center[1]) * view.scale,
    ],
    toMap: (u, v) => [
      center[0] + (u - 0.5 * view.size[0]) / view.scale,
      center[1] - (v - 0.5 * view.size[1]) / view.scale,
    ],
  };
  const { context } = view;

  /** Height of the drive at full width, limited to a screen's height. */
  function measure() {
    const width = element.clientWidth;
    if (width === 0) return;
    const wide = box.x[1] - box.x[0] + 4;
    const high = box.y[1] - box.y[0] + 4;
    view.size = [
      width,
      Math.round(Math.min(Math.max((width * high) / wide + 60, 280), Math.max(300, 0.72 * width), 620)),
    ];
    element.style.height = `${view.size[1]}px`;
    canvas.width = Math.round(view.size[0] * devicePixelRatio);
    canvas.height = Math.round(view.size[1] * devicePixelRatio);
    fit();
  }

  function fit() {
    const margin = 34;
    view.scale = Math.min(
      (view.size[0] - 2 * margin) / Math.max(1, box.x[1] - box.x[0]),
      (view.size[1] - 2 * margin) / Math.max(1, box.y[1] - box.y[0]),
    );
    center = middle();
    schedule();
  }

  function zoomAt(factor, u = 0.5 * view.size[0], v = 0.5 * view.size[1]) {
    const [x, y] = view.toMap(u, v);
    view.scale = Math.min(Math.max(view.scale * factor, 0.05), 5000);
    center = [x - (u - 0.5 * view.size[0]) / view.scale, y + (v - 0.5 * view.size[1]) / view.scale];
    tip.hidden = true;
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
    const [u, v] = view.toScreen(
      field.x_m - 0.5 * field.resolution_m,
      field.y_m + (field.rows - 0.5) * field.resolution_m,
    );
    context.imageSmoothingEnabled = field.resolution_m * view.scale < 8;
    context.drawImage(
      painted,
      u,
      v,
      field.columns * field.resolution_m * view.scale,
      field.rows * field.resolution_m * view.scale,
    );
  }

  /** Widths distinguish overlapping lines: the ground truth is widest, later estimates are narrower and on top. */
  function drawTracks() {
    const leading = run.truth ?? run.estimators[0].series;
    paintTrack(view, leading, color('halo'), 9);
    if (run.truth) paintTrack(view, run.truth, color('truth'), 7);
    const shown = run.estimators
      .map((one, i) => ({ ...one, paint: seriesColor(one.color), width: Math.max(1.4, 4.6 - 1.5 * i) }))
      .filter((one) => state.isShown(one.name));
    shown.forEach((one) => paintTrack(view, one.series, one.paint, one.width));
    const first = leading.x.findIndex((value) => value != null);
    if (first >= 0)
      [
        [7, 'halo'],
        [5, 'truth'],
        [2.5, 'halo'],
      ].forEach(([radius, paint]) => paintDisk(view, leading.x[first], leading.y[first], radius, color(paint)));
    canvas.dataset.tracks = shown.length + (run.truth ? 1 : 0);
    return shown;
  }

  function draw() {
    if (view.size[0] === 0) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (ground === 'cloud') paintCloud(view, grounds.cloud, cut);
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    if (ground === 'field') drawField();
    const writeLabels = paintGrid(view, ground === 'none');
    const shown = drawTracks();
    const places = placesOf(run.estimators[state.detail]);
    paintPlaces(view, places);
    for (const {
      series: { x, y },
      paint,
    } of shown) {
      if (state.moment == null || x[state.moment] == null) continue;
      paintDisk(view, x[state.moment], y[state.moment], 6.5, color('halo'));
      paintDisk(view, x[state.moment], y[state.moment], 5, paint);
    }
    writeLabels();
    canvas.dataset.ground = ground;
    canvas.dataset.marks = places.length;
  }

  function showKey() {
    const range =
      ground === 'field'
        ? [grounds.field.low_ut, grounds.field.high_ut]
        : ground === 'cloud'
          ? [grounds.cloud.low, Math.min(grounds.cloud.high, cut)]
          : null;
    key.hidden = !range;
    if (!range) return;
    const bar = h('canvas', { width: 140, height: 1 });
    const inside = bar.getContext('2d');
    for (let i = 0; i < 140; ++i) {
      inside.fillStyle = `rgb(${heat(i / 139).join(' ')})`;
      inside.fillRect(i, 0, 1, 1);
    }
    key.replaceChildren(
      h('div', {}, ground === 'field' ? '|B|, µT' : 'height, m'),
      bar,
      h('div', {}, h('span', {}, fixed(range[0], 1)), h('span', {}, fixed(range[1], 1))),
    );
  }

  /** Index of the shown pose nearest to the pointer; null if none is near. */
  function nearest(u, v) {
    let [found, least] = [null, 22];
    for (const one of run.estimators) {
      if (!state.isShown(one.name)) continue;
      const { x, y } = one.series;
      for (let i = 0; i < x.length; ++i) {
        if (x[i] == null) continue;
        const [a, b] = view.toScreen(x[i], y[i]);
        const distance = Math.hypot(a - u, b - v);
        if (distance < least - 0.5) [found, least] = [i, distance];
      }
    }
    return found;
  }

  function describe(at, u, v) {
    const [x, y] = view.toMap(u, v);
    const strength = ground === 'field' ? strengthAt(grounds.field, x, y) : null;
    const lines = [`x ${fixed(x, 2)}  y ${fixed(y, 2)} m${strength != null ? `   |B| ${fixed(strength, 1)} µT` : ''}`];
    if (at != null) {
      lines.unshift(h('b', {}, `${fixed(run.t[at], 1)} s`));
      run.estimators.forEach((one) => {
        if (!state.isShown(one.name) || one.series.x[at] == null) return;
        const [error, sigma] = [one.series.error?.[at], one.series.sigma?.[at]];
        lines.push(
          h(
            'span',
            {},
            h('span', { class: 'swatch', style: { background: seriesColor(one.color) } }),
            one.name,
            error != null ? `: error ${metres(error)}` : '',
            sigma != null ? `, sigma ${metres(sigma)}` : '',
          ),
        );
      });
    }
    for (const place of placesOf(run.estimators[state.detail])) {
      const [a, b] = view.toScreen(place.x, place.y);
      if (Math.hypot(a - u, b - v) < 12)
        lines.push(`stale place ${place.number}: differs by ${brief(place.difference)} µT from the map`);
    }
    tip.replaceChildren(...lines.flatMap((line, i) => (i ? [h('br'), line] : [line])));
    tip.hidden = false;
    const left = u + 16 + tip.offsetWidth > view.size[0] ? u - 12 - tip.offsetWidth : u + 16;
    tip.style.left = `${Math.max(4, left)}px`;
    tip.style.top = `${Math.min(Math.max(4, v + 14), view.size[1] - tip.offsetHeight - 4)}px`;
  }

  attachGestures(canvas, {
    zoomAt,
    fit,
    drag(du, dv) {
      center = [center[0] - du / view.scale, center[1] + dv / view.scale];
      tip.hidden = true;
      schedule();
    },
    hover(u, v) {
      const at = nearest(u, v);
      state.point(at);
      describe(at, u, v);
    },
    leave() {
      tip.hidden = true;
      state.point(null);
    },
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
