// Charts with a common time axis, cursor and zoom.
import uPlot from 'uplot';
import { brief, fixed, h, metres, onResize, roundMetres } from './dom.js';
import { color, onTheme, seriesColor } from './theme.js';

const axisWidth = 62;
const font = '12px system-ui, sans-serif';
const directionDashes = [[], [8, 3], [5, 3], [3, 3], [2, 2], [1, 3]];

/** Intervals of the axis with `values` above 0, as [from, to] in seconds. */
function intervals(t, values) {
  const found = [];
  values.forEach((value, i) => {
    if (!(value > 0)) return;
    const begin = t[Math.max(0, i - 1)];
    const last = found[found.length - 1];
    if (last && last[1] >= begin) last[1] = t[i];
    else found.push([begin, t[i]]);
  });
  return found;
}

/** Whole decades around the data. Ignores sigmas of unobservable directions, and the few moments at which an error
 * passes through zero. */
function decades(columns) {
  const values = columns.map((column) => column.filter((value) => value > 0 && value < 9e5).sort((a, b) => a - b)).filter((column) => column.length);
  if (!values.length) return [0.001, 1];
  const low = Math.min(...values.map((column) => column[Math.floor(0.02 * column.length)]));
  const high = Math.max(...values.map((column) => column[column.length - 1]));
  const from = 10 ** Math.floor(Math.log10(low));
  const to = 10 ** Math.ceil(Math.log10(high) + 1e-9);
  return [from, to > from ? to : 10 * from];
}

/** Logarithmic if a lost estimate would flatten all others on a linear scale. */
function wantsDecades(columns) {
  const ends = columns.map((column) => {
    const values = column.filter((value) => value > 0).sort((a, b) => a - b);
    return values.length ? [values[Math.floor(values.length / 2)], values[values.length - 1]] : null;
  }).filter(Boolean);
  return ends.some(([, most]) => ends.some(([middle]) => most > 15 * middle));
}

/** One chart of the stack. `series(state)`: [{label, values, stroke, dash, width, show}]; `axis`: unit of the axis. */
function panel(state, options) {
  const values = h('div', { class: 'values' });
  const place = h('div', { 'data-chart': options.name, role: 'img', 'aria-label': options.title });
  const element = h('section', { class: 'panel' }, h('div', { class: 'head' }, h('h3', {}, options.title), values), place);
  let plot = null;
  let shown = [];

  const tellValues = (index) => {
    values.replaceChildren(...shown.filter((one) => one.show !== false).map((one) =>
      h('span', {}, h('span', { class: 'swatch', style: { background: one.stroke } }), `${one.label} `,
        index == null ? '' : h('b', {}, options.format(one.values[index])))));
  };

  function draw() {
    plot?.destroy();
    shown = options.series(state).filter((one) => one.values?.some((value) => value != null));
    element.hidden = shown.length === 0;
    if (element.hidden || element.clientWidth === 0) return;
    const { t } = state.run;
    const drawn = [...shown].reverse();  // the first series is on top
    const columns = shown.filter((one) => one.show !== false).map((one) => one.values);
    const logarithmic = options.scale === 'log' || (options.scale === 'auto' && wantsDecades(columns));
    const range = logarithmic ? decades(columns) : null;
    const held = (column) => (logarithmic ? column.map((v) => (v == null || v <= 0 ? null : Math.min(Math.max(v, range[0]), range[1]))) : column);
    const ink = color('quiet');
    const grid = { stroke: color('grid'), width: 1 };
    plot = new uPlot({
      width: element.clientWidth,
      height: options.height + (options.last ? 28 : 0),
      legend: { show: false },
      padding: [6, 8, options.last ? 0 : 6, 0],
      cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 7 }, focus: { prox: -1 }, y: false },
      scales: {
        x: { time: false, range: () => state.span ?? [t[0], t[t.length - 1]] },
        y: { distr: logarithmic ? 3 : 1, range: range ?? ((_, low, high) => options.range ?? [Math.min(0, low), high > 0 ? high * 1.06 : 1]) },
      },
      axes: [
        { show: true, stroke: ink, font, grid, ticks: { show: false }, size: options.last ? 34 : 0, labelSize: 0,
          values: (_, ticks) => (options.last ? ticks.map((tick) => `${+tick.toFixed(3)} s`) : ticks.map(() => '')) },
        { stroke: ink, font, grid, ticks: { show: false }, size: axisWidth, gap: 6,
          values: (_, ticks) => ticks.map((tick) => (tick == null ? '' : options.tick(tick))),
          ...(logarithmic ? { filter: (_, ticks) => ticks.map((tick) => (Math.abs(Math.log10(tick) - Math.round(Math.log10(tick))) < 1e-6 ? tick : null)) } : {}) },
      ],
      series: [{}, ...drawn.map((one) => ({
        label: one.label, stroke: one.stroke, width: one.width ?? 1.6, dash: one.dash, show: one.show !== false,
        points: { show: false }, spanGaps: false }))],
      hooks: {
        drawClear: [(u) => {
          const hidden = state.run.estimators[state.detail].series.degenerate;
          u.ctx.fillStyle = color('shade');
          for (const [from, to] of intervals(t, hidden ?? [])) {
            const x0 = Math.max(u.valToPos(from, 'x', true), u.bbox.left);
            const x1 = Math.min(u.valToPos(to, 'x', true), u.bbox.left + u.bbox.width);
            if (x1 > x0) u.ctx.fillRect(x0, u.bbox.top, Math.max(1, x1 - x0), u.bbox.height);
          }
        }],
        draw: [(u) => {
          const limit = options.limit?.(state);
          if (!Number.isFinite(limit)) return;
          const y = u.valToPos(limit, 'y', true);
          if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) return;
          u.ctx.save();
          u.ctx.strokeStyle = u.ctx.fillStyle = color('ink');
          u.ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
          u.ctx.lineWidth = devicePixelRatio;
          u.ctx.beginPath();
          u.ctx.moveTo(u.bbox.left, y);
          u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
          u.ctx.stroke();
          u.ctx.textAlign = 'left';
          u.ctx.textBaseline = 'alphabetic';
          u.ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
          u.ctx.fillText(`limit ${metres(limit)}`, u.bbox.left + 6 * devicePixelRatio, y - 5 * devicePixelRatio);
          u.ctx.restore();
        }],
        setCursor: [(u) => {
          if (u.cursor.event == null) return;  // moved by another chart
          state.point(u.cursor.left >= 0 ? u.cursor.idx : null, u);
        }],
        setSelect: [(u) => {
          if (u.select.width < 4) return;
          const span = [u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x')];
          u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          state.zoom(span);
        }],
      },
    }, [t, ...drawn.map((one) => held(one.values))], place);
    plot.over.addEventListener('dblclick', () => state.zoom(null));
    plot.over.addEventListener('mouseleave', () => state.point(null));
    place.dataset.series = columns.length;
    tellValues(state.moment);
  }

  state.on('moment', (source) => {
    tellValues(state.moment);
    if (!plot || source === plot) return;
    const at = state.moment == null ? -10 : plot.valToPos(state.run.t[state.moment], 'x');
    plot.setCursor({ left: at, top: state.moment == null ? -10 : 1 }, false);
  });
  state.on('span', () => plot?.setScale('x', { min: 0, max: 1 }));
  for (const event of ['shown', 'detail']) state.on(event, draw);
  onTheme(draw);
  return { element, draw };
}

/** Column `name` of every estimator, in its colour. */
function ofAll(state, name, more = () => ({})) {
  return state.run.estimators.map((one, i) => ({
    label: one.name, values: one.series[name], stroke: seriesColor(i), show: state.isShown(one.name), ...more(i) }));
}

/** The charts of a run with their tools. */
export function timeCharts(state) {
  const { run } = state;
  const detail = () => run.estimators[state.detail];
  const withTruth = run.estimators.some((one) => one.series.error);
  const degrees = (value) => `${brief(value)}°`;
  const definitions = [
    withTruth && { name: 'error', title: 'Position error', height: 210, scale: 'auto', format: metres, tick: roundMetres,
      series: (s) => [...ofAll(s, 'error'),
        { label: `sigma of ${detail().name}`, values: detail().series.sigma, stroke: seriesColor(s.detail), dash: [2, 4], width: 1.2, show: s.isShown(detail().name) }] },
    !withTruth && { name: 'sigma', title: 'Predicted sigma of the position', height: 210, scale: 'auto', format: metres, tick: roundMetres,
      series: (s) => ofAll(s, 'sigma') },
    withTruth
      ? { name: 'heading', title: 'Heading error', height: 120, scale: 'auto', format: degrees, tick: degrees, series: (s) => ofAll(s, 'heading') }
      : { name: 'heading', title: 'Predicted sigma of the heading', height: 120, scale: 'auto', format: degrees, tick: degrees, series: (s) => ofAll(s, 'sigma_heading') },
    { name: 'directions', title: 'Observability by LiDAR and IMU: predicted sigma of the six directions', height: 160, scale: 'log', format: metres, tick: roundMetres,
      limit: () => detail().degeneracy_limit_m,
      series: (s) => [1, 2, 3, 4, 5, 6].map((i) => ({
        label: i === 1 ? '1, best observed' : i === 6 ? '6, least observed' : `${i}`, values: detail().series[`direction_${i}`],
        stroke: seriesColor(s.detail), dash: directionDashes[6 - i], width: i === 6 ? 2 : 1.1 })) },
    { name: 'weights', title: 'Magnetic weights: Huber’s (solid) and β (dotted)', height: 120, scale: 'linear', range: [0, 1.05], format: (v) => fixed(v, 2), tick: brief,
      // Weights of several estimators are often equal: lower curves are wider, as on the plan.
      series: (s) => [...ofAll(s, 'weight', (i) => ({ width: 1.6 + 1.6 * i })),
        ...ofAll(s, 'shrink', (i) => ({ dash: [2, 4], width: 1.6 + 0.8 * i })).map((one) => ({ ...one, label: `β of ${one.label}` }))
          .filter((one) => one.values?.some((value) => value != null && value < 0.9999))] },
    { name: 'residual', title: 'Measured minus mapped field, rms', height: 120, scale: 'auto', format: (v) => `${brief(v)}\u2009µT`, tick: (v) => `${brief(v)} µT`,
      series: (s) => ofAll(s, 'residual') },
  ].filter(Boolean).filter((one) => one.series(state).some((series) => series.values?.some((value) => value != null)));
  if (definitions.length) definitions[definitions.length - 1].last = true;
  const panels = definitions.map((one) => panel(state, one));

  const stack = h('div', { class: 'charts', tabindex: 0, role: 'group',
    'aria-label': 'Charts over time. Left and right arrows move the cursor, plus and minus zoom, 0 shows all.', onkeydown: onKey },
  panels.map((one) => one.element));

  function onKey(event) {
    const { t } = run;
    const [first, last] = state.span ?? [t[0], t[t.length - 1]];
    const at = state.moment ?? t.findIndex((value) => value >= (first + last) / 2);
    const step = event.shiftKey ? 20 : 1;
    const zoomed = (factor) => {
      const half = 0.5 * factor * (last - first);
      const middle = t[at];
      state.zoom([Math.max(t[0], middle - half), Math.min(t[t.length - 1], middle + half)]);
    };
    if (event.key === 'ArrowRight') state.point(Math.min(t.length - 1, at + step));
    else if (event.key === 'ArrowLeft') state.point(Math.max(0, at - step));
    else if (event.key === '+' || event.key === '=') zoomed(0.5);
    else if (event.key === '-') zoomed(2);
    else if (event.key === '0' || event.key === 'Escape') state.zoom(null);
    else return;
    event.preventDefault();
  }

  const drawAll = () => panels.forEach((one) => one.draw());
  onResize(stack, drawAll);
  return { element: stack, draw: drawAll };
}

/** Cumulative distribution of the error. */
export function distributionChart(state) {
  const place = h('div', { 'data-chart': 'distribution', role: 'img', 'aria-label': 'Distribution of the position error' });
  const element = h('section', { class: 'panel' }, place);
  let plot = null;

  function draw() {
    plot?.destroy();
    if (element.clientWidth === 0) return;
    const shown = state.run.estimators.map((one, i) => ({ ...one, stroke: seriesColor(i) }))
      .filter((one) => one.series.distribution && state.isShown(one.name));
    if (!shown.length) return;
    const share = shown[0].series.distribution.map((_, i, all) => (100 * i) / (all.length - 1));
    const ink = color('quiet');
    const grid = { stroke: color('grid'), width: 1 };
    // The share is the common x axis of all columns, but is drawn upright, with the errors along the bottom.
    const [low, high] = decades(shown.map((one) => one.series.distribution));
    const columns = shown.map((one) => [one.series.distribution.map((value) => Math.max(value, low)), share]);
    const every = Math.ceil((60 * Math.log10(high / low)) / Math.max(60, element.clientWidth - axisWidth));  // decades per label
    plot = new uPlot({
      mode: 2,
      width: element.clientWidth,
      height: 260,
      legend: { show: false },
      padding: [8, 30, 0, 0],
      cursor: { show: false },
      scales: { x: { time: false, auto: false, distr: 3, range: [low, high] }, y: { range: [0, 100] } },
      axes: [
        { scale: 'x', stroke: ink, font, grid, ticks: { show: false }, size: 34,
          filter: (_, ticks) => ticks.map((tick) => (Math.abs(Math.log10(tick) / every - Math.round(Math.log10(tick) / every)) < 1e-6 ? tick : null)),
          values: (_, ticks) => ticks.map((tick) => (tick == null ? '' : roundMetres(tick))) },
        { scale: 'y', stroke: ink, font, grid, ticks: { show: false }, size: axisWidth, values: (_, ticks) => ticks.map((tick) => `${tick} %`) },
      ],
      series: [{}, ...shown.map((one) => ({
        stroke: one.stroke,
        paths: (u, index) => {
          const [x, y] = u.data[index];
          const path = new Path2D();
          x.forEach((value, i) => path[i === 0 ? 'moveTo' : 'lineTo'](u.valToPos(value, 'x', true), u.valToPos(y[i], 'y', true)));
          u.ctx.save();
          u.ctx.beginPath();
          u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
          u.ctx.clip();
          u.ctx.strokeStyle = one.stroke;
          u.ctx.lineWidth = 2 * devicePixelRatio;
          u.ctx.stroke(path);
          u.ctx.restore();
          return null;
        } }))],
    }, [null, ...columns], place);
    place.dataset.series = shown.length;
  }

  state.on('shown', draw);
  onTheme(draw);
  onResize(element, draw);
  return { element, draw };
}
