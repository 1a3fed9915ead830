// One chart over time: axes, cursor and zoom, which all charts of a run share.
import uPlot from 'uplot';
import { h, lineSample, metres } from './dom.js';
import { color, onTheme } from './theme.js';

export const axisWidth = 62;
export const font = '12px system-ui, sans-serif';

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
export function decades(columns) {
  const values = columns
    .map((column) => column.filter((value) => value > 0 && value < 9e5).sort((a, b) => a - b))
    .filter((column) => column.length);
  if (!values.length) return [0.001, 1];
  const low = Math.min(...values.map((column) => column[Math.floor(0.02 * column.length)]));
  const high = Math.max(...values.map((column) => column[column.length - 1]));
  const from = 10 ** Math.floor(Math.log10(low));
  const to = 10 ** Math.ceil(Math.log10(high) + 1e-9);
  return [from, to > from ? to : 10 * from];
}

/** Logarithmic if a lost estimate would flatten all others on a linear scale. */
function wantsDecades(columns) {
  const ends = columns
    .map((column) => {
      const values = column.filter((value) => value > 0).sort((a, b) => a - b);
      return values.length ? [values[Math.floor(values.length / 2)], values[values.length - 1]] : null;
    })
    .filter(Boolean);
  return ends.some(([, most]) => ends.some(([middle]) => most > 15 * middle));
}

/** One chart of the stack. `series(state)`: [{label, values, stroke, dash, width, show}]; `axis`: unit of the axis. */
export function panel(state, options) {
  const values = h('div', { class: 'values' });
  const place = h('div', { 'data-chart': options.name, role: 'img', 'aria-label': options.title });
  const element = h(
    'section',
    { class: 'panel' },
    h('div', { class: 'head' }, h('h3', {}, options.title), values),
    place,
  );
  let plot = null;
  let shown = [];

  const tellValues = (index) => {
    values.replaceChildren(
      ...shown
        .filter((one) => one.show !== false)
        .map((one) =>
          h(
            'span',
            {},
            lineSample(one.stroke, one.dash, one.width),
            `${one.label} `,
            index == null ? '' : h('b', {}, options.format(one.values[index])),
          ),
        ),
    );
  };

  function draw() {
    plot?.destroy();
    shown = options.series(state).filter((one) => one.values?.some((value) => value != null));
    element.hidden = shown.length === 0;
    if (element.hidden || element.clientWidth === 0) return;
    const { t } = state.run;
    const drawn = [...shown].reverse(); // the first series is on top
    const columns = shown.filter((one) => one.show !== false).map((one) => one.values);
    const logarithmic = options.scale === 'log' || (options.scale === 'auto' && wantsDecades(columns));
    const range = logarithmic ? decades(columns) : null;
    const held = (column) =>
      logarithmic
        ? column.map((v) => (v == null || v <= 0 ? null : Math.min(Math.max(v, range[0]), range[1])))
        : column;
    const ink = color('quiet');
    const grid = { stroke: color('grid'), width: 1 };
    plot = new uPlot(
      {
        width: element.clientWidth,
        height: options.height + (options.last ? 28 : 0),
        legend: { show: false },
        padding: [6, 8, options.last ? 0 : 6, 0],
        cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 7 }, focus: { prox: -1 }, y: false },
        scales: {
          x: { time: false, range: () => state.span ?? [t[0], t[t.length - 1]] },
          y: {
            distr: logarithmic ? 3 : 1,
            range: range ?? ((_, low, high) => options.range ?? [Math.min(0, low), high > 0 ? high * 1.06 : 1]),
          },
        },
        axes: [
          {
            show: true,
            stroke: ink,
            font,
            grid,
            ticks: { show: false },
            size: options.last ? 34 : 0,
            labelSize: 0,
            values: (_, ticks) => (options.last ? ticks.map((tick) => `${+tick.toFixed(3)} s`) : ticks.map(() => '')),
          },
          {
            stroke: ink,
            font,
            grid,
            ticks: { show: false },
            size: axisWidth,
            gap: 6,
            values: (_, ticks) => ticks.map((tick) => (tick == null ? '' : options.tick(tick))),
            ...(logarithmic
              ? {
                  filter: (_, ticks) =>
                    ticks.map((tick) =>
                      Math.abs(Math.log10(tick) - Math.round(Math.log10(tick))) < 1e-6 ? tick : null,
                    ),
                }
              : {}),
          },
        ],
        series: [
          {},
          ...drawn.map((one) => ({
            label: one.label,
            stroke: one.stroke,
            width: one.width ?? 1.6,
            dash: one.dash,
            show: one.show !== false,
            points: { show: false },
            spanGaps: false,
          })),
        ],
        hooks: {
          drawClear: [
            (u) => {
              const hidden = state.run.estimators[state.detail].series.degenerate;
              u.ctx.fillStyle = color('shade');
              for (const [from, to] of intervals(t, hidden ?? [])) {
                const x0 = Math.max(u.valToPos(from, 'x', true), u.bbox.left);
                const x1 = Math.min(u.valToPos(to, 'x', true), u.bbox.left + u.bbox.width);
                if (x1 > x0) u.ctx.fillRect(x0, u.bbox.top, Math.max(1, x1 - x0), u.bbox.height);
              }
            },
          ],
          draw: [
            (u) => {
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
              const above = y - u.bbox.top > 18 * devicePixelRatio; // otherwise there is no room for the text
              u.ctx.fillText(
                `limit ${metres(limit)}`,
                u.bbox.left + 6 * devicePixelRatio,
                y + (above ? -5 : 15) * devicePixelRatio,
              );
              u.ctx.restore();
            },
          ],
          setCursor: [
            (u) => {
              if (u.cursor.event == null) return; // moved by another chart
              state.point(u.cursor.left >= 0 ? u.cursor.idx : null, u);
            },
          ],
          setSelect: [
            (u) => {
              if (u.select.width < 4) return;
              const span = [u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x')];
              u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
              state.zoom(span);
            },
          ],
        },
      },
      [t, ...drawn.map((one) => held(one.values))],
      place,
    );
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
