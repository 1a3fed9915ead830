// Charts with a common time axis, cursor and zoom.
import uPlot from 'uplot';
import { brief, fixed, h, metres, onResize, roundMetres } from './dom.js';
import { axisWidth, decades, font, panel } from './panel.js';
import { color, onTheme, seriesColor } from './theme.js';

const directionDashes = [[], [8, 3], [5, 3], [3, 3], [2, 2], [1, 3]];

/** Column `name` of every estimator, in its colour. */
function ofAll(state, name, more = () => ({})) {
  return state.run.estimators.map((one, i) => ({
    label: one.name,
    values: one.series[name],
    stroke: seriesColor(one.color),
    show: state.isShown(one.name),
    ...more(i),
  }));
}

/** Whether a tick of a logarithmic axis has a label, for `decade` pixels a decade: 1, 2 and 5, or only every n-th
 * decade. */
export function labelledTicks(decade) {
  const every = Math.ceil(60 / Math.max(1, decade)); // decades per label
  return (tick) => {
    const power = Math.floor(Math.log10(tick) + 1e-6);
    const digit = Math.round(tick / 10 ** power);
    return decade > 180 ? [1, 2, 5].includes(digit) : digit === 1 && power % every === 0;
  };
}

/** The charts of a run with their tools. */
export function timeCharts(state) {
  const { run } = state;
  const detail = () => run.estimators[state.detail];
  const withTruth = run.estimators.some((one) => one.series.error);
  const degrees = (value) => `${brief(value)}°`;
  const definitions = [
    withTruth && {
      name: 'error',
      title: 'Position error',
      height: 210,
      scale: 'auto',
      format: metres,
      tick: roundMetres,
      series: (s) => [
        ...ofAll(s, 'error'),
        {
          label: `sigma of ${detail().name}`,
          values: detail().series.sigma,
          stroke: seriesColor(detail().color),
          dash: [2, 4],
          width: 1.2,
          show: s.isShown(detail().name),
        },
      ],
    },
    !withTruth && {
      name: 'sigma',
      title: 'Predicted sigma of the position',
      height: 210,
      scale: 'auto',
      format: metres,
      tick: roundMetres,
      series: (s) => ofAll(s, 'sigma'),
    },
    withTruth
      ? {
          name: 'heading',
          title: 'Heading error',
          height: 120,
          scale: 'auto',
          format: degrees,
          tick: degrees,
          series: (s) => ofAll(s, 'heading'),
        }
      : {
          name: 'heading',
          title: 'Predicted sigma of the heading',
          height: 120,
          scale: 'auto',
          format: degrees,
          tick: degrees,
          series: (s) => ofAll(s, 'sigma_heading'),
        },
    {
      name: 'directions',
      title: 'Observability by LiDAR and IMU: predicted sigma of the six directions',
      height: 160,
      scale: 'log',
      format: metres,
      tick: roundMetres,
      limit: () => detail().degeneracy_limit_m,
      series: (s) =>
        [1, 2, 3, 4, 5, 6].map((i) => ({
          label: i === 1 ? '1, best observed' : i === 6 ? '6, least observed' : `${i}`,
          values: detail().series[`direction_${i}`],
          stroke: seriesColor(detail().color),
          dash: directionDashes[6 - i],
          width: i === 6 ? 2 : 1.1,
        })),
    },
    {
      name: 'weights',
      title: 'Magnetic weights: Huber’s (solid) and β (dotted)',
      height: 120,
      scale: 'linear',
      range: [0, 1.05],
      format: (v) => fixed(v, 2),
      tick: brief,
      // Weights of several estimators are often equal: lower curves are wider, as on the plan.
      series: (s) => [
        ...ofAll(s, 'weight', (i) => ({ width: 1.6 + 1.6 * i })),
        ...ofAll(s, 'shrink', (i) => ({ dash: [2, 4], width: 1.6 + 0.8 * i }))
          .map((one) => ({ ...one, label: `β of ${one.label}` }))
          .filter((one) => one.values?.some((value) => value != null && value < 0.9999)),
      ],
    },
    {
      name: 'residual',
      title: 'Measured minus mapped field, rms',
      height: 120,
      scale: 'auto',
      format: (v) => `${brief(v)}\u2009µT`,
      tick: (v) => `${brief(v)} µT`,
      series: (s) => ofAll(s, 'residual'),
    },
  ]
    .filter(Boolean)
    .filter((one) => one.series(state).some((series) => series.values?.some((value) => value != null)));
  if (definitions.length) definitions[definitions.length - 1].last = true;
  const panels = definitions.map((one) => panel(state, one));

  const stack = h(
    'div',
    {
      class: 'charts',
      tabindex: 0,
      role: 'group',
      'aria-label': 'Charts over time. Left and right arrows move the cursor, plus and minus zoom, 0 shows all.',
      onkeydown: onKey,
    },
    panels.map((one) => one.element),
  );

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

/** Cumulative distribution of the error over all scans. It has no error for the share of lost scans: the line stays at
 * the share that was reached. */
export function distributionChart(state) {
  const place = h('div', {
    'data-chart': 'distribution',
    role: 'img',
    'aria-label': 'Distribution of the position error',
  });
  const element = h('section', { class: 'panel' }, place);
  let plot = null;

  function draw() {
    plot?.destroy();
    if (element.clientWidth === 0) return;
    const shown = state.run.estimators
      .map((one) => ({ ...one, stroke: seriesColor(one.color) }))
      .filter((one) => one.series.distribution && state.isShown(one.name));
    if (!shown.length) return;
    const ink = color('quiet');
    const grid = { stroke: color('grid'), width: 1 };
    // The share is the common x axis of all columns, but is drawn upright, with the errors along the bottom.
    const [low, high] = decades(shown.map((one) => one.series.distribution));
    const columns = shown.map((one) => {
      const reached = one.series.distribution.filter((value) => value != null);
      const share = reached.map((_, i) => (100 * i) / (one.series.distribution.length - 1));
      return [
        [low, ...reached.map((value) => Math.max(value, low)), high],
        [0, ...share, share[share.length - 1] ?? 0],
      ];
    });
    const decade = (element.clientWidth - axisWidth) / Math.log10(high / low); // pixels
    const isLabelled = labelledTicks(decade);
    plot = new uPlot(
      {
        mode: 2,
        width: element.clientWidth,
        height: 260,
        legend: { show: false },
        padding: [8, 30, 0, 0],
        cursor: { show: false },
        scales: { x: { time: false, auto: false, distr: 3, range: [low, high] }, y: { range: [0, 100] } },
        axes: [
          {
            scale: 'x',
            stroke: ink,
            font,
            grid,
            ticks: { show: false },
            size: 34,
            filter: (_, ticks) => ticks.map((tick) => (isLabelled(tick) ? tick : null)),
            values: (_, ticks) => ticks.map((tick) => (tick == null ? '' : roundMetres(tick))),
          },
          {
            scale: 'y',
            stroke: ink,
            font,
            grid,
            ticks: { show: false },
            size: axisWidth,
            values: (_, ticks) => ticks.map((tick) => `${tick} %`),
          },
        ],
        series: [
          {},
          ...shown.map((one) => ({
            stroke: one.stroke,
            paths: (u, index) => {
              const [x, y] = u.data[index];
              const path = new Path2D();
              x.forEach((value, i) =>
                path[i === 0 ? 'moveTo' : 'lineTo'](u.valToPos(value, 'x', true), u.valToPos(y[i], 'y', true)),
              );
              u.ctx.save();
              u.ctx.beginPath();
              u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
              u.ctx.clip();
              u.ctx.strokeStyle = one.stroke;
              u.ctx.lineWidth = 2 * devicePixelRatio;
              u.ctx.stroke(path);
              u.ctx.restore();
              return null;
            },
          })),
        ],
      },
      [null, ...columns],
      place,
    );
    place.dataset.series = shown.length;
  }

  state.on('shown', draw);
  onTheme(draw);
  onResize(element, draw);
  return { element, draw };
}
