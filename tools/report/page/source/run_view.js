// One run: comparison, trust, plan, charts over time, distribution, calibration, stale places, warnings, configuration.
import { calibrationSection } from './calibration.js';
import { distributionChart, timeCharts } from './charts.js';
import { cloudView } from './cloud_view.js';
import { comparison, swatch } from './comparison.js';
import { brief, count, date, duration, fixed, h, leaf, metres } from './dom.js';
import { mapView } from './map_view.js';
import { decodeCloud, decodeField, driveBox } from './plan.js';
import { mapIsHardlyTheCause, placesOf, staleColumns } from './stale.js';
import { RunState } from './state.js';
import { plainTable, sortableTable } from './table.js';
import { trustSection } from './trust.js';

/** Facts about log and maps, {title: text}; unknown facts are omitted. */
export function factsOf(run) {
  const inputs = run.inputs;
  return Object.fromEntries(
    Object.entries({
      Log: leaf(inputs.log),
      Recorded: date(run.begin_s),
      Length: duration(run.estimators[0]?.summary.duration_s),
      'Cloud map': leaf(inputs.cloud) ?? 'none',
      'Magnetic map': leaf(inputs.magnetic) ?? 'none',
      Platform: leaf(inputs.platform),
      'LiDAR range': inputs.max_range_m ? `${inputs.max_range_m} m` : null,
      'Ground truth': leaf(inputs.truth) ?? 'none',
    }).filter(([, value]) => value),
  );
}

export const factList = (facts) =>
  h(
    'dl',
    { class: 'facts' },
    Object.entries(facts).map(([name, value]) => h('div', {}, h('dt', {}, name), h('dd', {}, value))),
  );

function warnings(run) {
  const kinds = new Map();
  for (const one of run.estimators) {
    for (const [kind, entry] of Object.entries(one.summary.warnings ?? {})) {
      if (!kinds.has(kind))
        kinds.set(kind, { kind, first: entry.first, at: Number(entry.at_s) - Number(run.begin_s), counts: [] });
      kinds.get(kind).counts.push(`${one.name} ${count(entry.count)}×`);
    }
  }
  if (!kinds.size) return h('p', { class: 'quiet' }, 'There are no warnings.');
  return sortableTable(
    [
      { title: 'Warning', value: (row) => row.kind, cell: (row) => h('code', {}, row.kind) },
      { title: 'First occurrence', text: true, wrap: true, value: (row) => row.first },
      { title: 'At', unit: 's', value: (row) => row.at, cell: (row) => fixed(row.at, 1) },
      { title: 'Count', text: true, value: (row) => row.counts.join(', ') },
    ],
    [...kinds.values()],
  );
}

function staleSection(state) {
  const { run } = state;
  if (!run.estimators.some((one) => one.stale_places || one.summary.stale_map)) return null;
  const place = h('div');
  function fill() {
    const one = run.estimators[state.detail];
    const figures = one.summary.stale_map;
    const parts = [];
    if (figures?.places > 0) {
      const by = figures.largest_difference_ut > 0 ? `, the largest by ${brief(figures.largest_difference_ut)} µT` : '';
      parts.push(
        h(
          'p',
          {},
          `${one.name}: ${count(figures.stale)} of ${count(figures.places)} visited cells differ from the magnetic map`,
          by,
          figures.stale_places
            ? `; they form ${count(figures.stale_places)} ${figures.stale_places === 1 ? 'place' : 'places'}`
            : '',
          '. ',
          mapIsHardlyTheCause(figures)
            ? 'Rather the trajectory, the calibration or the choice of the map is wrong. '
            : '',
          figures.false_alarm_probability != null
            ? `The probability of a false alarm is at most ${brief(figures.false_alarm_probability)} per cell`
            : '',
          figures.expected_false_alarms != null
            ? `; ${brief(figures.expected_false_alarms)} are expected by chance on this drive.`
            : '.',
        ),
      );
    }
    if (one.stale_places?.rows.length) {
      parts.push(sortableTable(staleColumns(one.stale_places, Number(run.begin_s)), one.stale_places.rows));
    } else {
      parts.push(
        h(
          'p',
          { class: 'quiet' },
          figures?.places > 0 ? 'No stale place was found.' : `${one.name} compared no reading with the magnetic map.`,
        ),
      );
    }
    place.replaceChildren(...parts);
  }
  fill();
  state.on('detail', fill);
  return h('section', { id: 'stale' }, h('h2', {}, 'Stale places'), place);
}

/** A group of buttons with one selected. */
function choice(label, options, chosen, act) {
  const buttons = options.map(([value, text]) =>
    h(
      'button',
      {
        type: 'button',
        'aria-pressed': String(value === chosen),
        onclick: () => {
          buttons.forEach((button, i) => button.setAttribute('aria-pressed', String(options[i][0] === value)));
          act(value);
        },
        'data-choice': value,
      },
      text,
    ),
  );
  return h('div', { class: 'group', role: 'group', 'aria-label': label }, buttons);
}

function seriesButtons(state) {
  return state.run.estimators.map((one) => {
    const button = h(
      'button',
      {
        type: 'button',
        class: 'series',
        'aria-pressed': 'true',
        title: 'Show or hide',
        onclick: () => state.toggle(one.name),
      },
      swatch(one),
      one.name,
    );
    state.on('shown', () => button.setAttribute('aria-pressed', String(state.isShown(one.name))));
    return button;
  });
}

function detailChoice(state) {
  if (state.run.estimators.length < 2) return null;
  const select = h(
    'select',
    { onchange: () => state.look(Number(select.value)) },
    state.run.estimators.map((one, i) => h('option', { value: i }, one.name)),
  );
  state.on('detail', () => {
    select.value = state.detail;
  });
  return h('label', {}, 'in detail: ', select);
}

function planSection(state, grounds) {
  const { run } = state;
  const map = mapView(state, grounds);
  const space = cloudView(state, grounds.cloud);
  const top = grounds.cloud ? Math.ceil(grounds.cloud.top) : 0;
  const height = driveBox(run).z;
  const bottom = grounds.cloud ? Math.floor(grounds.cloud.low) + 0.5 : 0;
  // A roof hides the inside: the initial cut is at a person's height above the robot.
  const begin = grounds.cloud ? Math.min(top, height[1] + 1.8) : 0;
  const slider = h('input', {
    type: 'range',
    min: bottom,
    max: top,
    step: 0.1,
    value: begin,
    'aria-label': 'Largest shown height of the cloud, metres',
  });
  const shown = h('span', { class: 'small quiet' });
  const cutter = h('label', { hidden: true }, 'up to ', slider, ' ', shown);
  const cut = () => {
    const value = Number(slider.value);
    shown.textContent = `${fixed(value, 1)} m`;
    map.setCut(value >= top ? Infinity : value);
    space.setCut(value >= top ? Infinity : value);
  };
  slider.addEventListener('input', cut);
  const options = [
    grounds.field && ['field', 'Magnetic field'],
    grounds.cloud && ['cloud', 'Cloud from above'],
    ['none', 'Lines only'],
    grounds.cloud && ['space', 'Cloud in 3D'],
  ].filter(Boolean);
  const set = (value) => {
    cutter.hidden = value !== 'cloud' && value !== 'space';
    map.element.hidden = value === 'space';
    space.show(value === 'space');
    if (value !== 'space') {
      map.setGround(value);
      map.measure();
    }
  };
  const marks = run.estimators.some((one) => placesOf(one).length)
    ? ' Triangles are stale places of the magnetic map.'
    : '';
  const note = run.field || run.cloud ? '' : ' The folder has no overview of the maps.';
  return {
    element: h(
      'section',
      { id: 'plan' },
      h('h2', {}, 'Map'),
      h(
        'p',
        { class: 'quiet small' },
        run.truth ? 'The widest line is the ground truth; later estimates are narrower and on top. ' : '',
        `The ring is the initial pose. Drag to move. Zoom with the buttons, +/−, or Ctrl and the wheel.${marks}${note}`,
      ),
      h(
        'div',
        { class: 'bar' },
        choice('Background of the plan', options, map.ground(), set),
        seriesButtons(state),
        cutter,
      ),
      map.element,
      space.element,
    ),
    start() {
      map.start();
      if (grounds.cloud) cut();
      set(map.ground());
    },
  };
}

/** {element, start: to be called after the element was added to the page}. */
export async function runView(run) {
  const state = new RunState(run);
  const grounds = { field: await decodeField(run.field), cloud: decodeCloud(run.cloud) };
  const plan = planSection(state, grounds);
  const charts = timeCharts(state);
  const distribution = run.estimators.some((one) => one.series.distribution) ? distributionChart(state) : null;
  const reset = h('button', { type: 'button', hidden: true, onclick: () => state.zoom(null) }, 'show all');
  state.on('span', () => {
    reset.hidden = state.span == null;
  });
  const pooled =
    run.scans_a_point > 1
      ? ` Each point represents ${run.scans_a_point} scans: their largest error, sigma and residual, ` +
        `and their smallest weight.`
      : '';
  const limits = run.estimators.map((one) => one.degeneracy_limit_m).filter(Number.isFinite);

  const element = h(
    'div',
    {},
    !['done', 'regained', 'lost'].includes(run.status)
      ? h('p', { class: 'notice' }, `The run was ${run.status}; the report shows the results up to that time.`)
      : null,
    h(
      'section',
      { id: 'comparison' },
      h('h2', {}, run.estimators.length > 1 ? 'Comparison' : 'Figures'),
      comparison(run),
    ),
    trustSection(run),
    plan.element,
    h(
      'section',
      { id: 'time' },
      h('h2', {}, 'Time'),
      h(
        'p',
        { class: 'quiet small' },
        `Shaded: scans in which the estimator in detail found a degenerate direction` +
          `${limits.length ? `, with a predicted sigma above ${metres(limits[0])}` : ''}. `,
        `Drag across a chart to zoom all charts; double-click to show all. The dot on the plan is the cursor.${pooled}`,
      ),
      h('div', { class: 'bar' }, seriesButtons(state), detailChoice(state), reset),
      charts.element,
    ),
    distribution
      ? h(
          'section',
          { id: 'distribution' },
          h('h2', {}, 'Error distribution'),
          h(
            'p',
            { class: 'quiet small' },
            'Share of all scans with a position error up to the value on the x axis. ',
            'Lost scans count as beyond every error.',
          ),
          distribution.element,
        )
      : null,
    calibrationSection(state),
    staleSection(state),
    h('section', { id: 'warnings' }, h('h2', {}, 'Warnings'), warnings(run)),
    run.configuration
      ? h(
          'section',
          { id: 'configuration' },
          h('h2', {}, 'Configuration'),
          h(
            'details',
            {},
            h('summary', {}, 'All options, and the input files'),
            plainTable(['input', 'value'], Object.entries(run.inputs)),
            h('pre', {}, run.configuration),
          ),
        )
      : null,
  );
  return {
    element,
    start() {
      plan.start();
      charts.draw();
      distribution?.draw();
    },
  };
}
