// The estimated calibration: differences from the platform file. docs/user/diagnostics.md has the columns.
import { brief, fixed, h } from './dom.js';
import { sortableTable } from './table.js';

/** Limit in sigmas of the platform file above which a parameter is marked, as in the run's warnings. */
const far = 3;

/** {sensor, parameter, unit, estimate, sigma, platform_sigma, ratio} of each estimated parameter. */
function rowsOf(estimator) {
  const { columns = [], rows = [] } = estimator?.calibration ?? {};
  return rows.map((row) => {
    const one = Object.fromEntries(columns.map((name, i) => [name, row[i]]));
    for (const name of ['estimate', 'sigma', 'platform_sigma']) one[name] = Number(one[name]);
    return { ...one, ratio: one.estimate / one.platform_sigma };
  });
}

function tableOf(rows) {
  const ratio = (row) => h('span', { class: Math.abs(row.ratio) > far ? 'bad' : null }, fixed(row.ratio, 2));
  const number = (title, unit, name) => ({ title, unit, value: (row) => row[name], cell: (row) => brief(row[name]) });
  return sortableTable(
    [
      { title: 'Parameter', value: (row) => `${row.sensor} ${row.parameter}` },
      { title: 'Unit', text: true, value: (row) => row.unit },
      number('Estimate', 'from the platform file', 'estimate'),
      number('Sigma', 'of the estimate', 'sigma'),
      number('Sigma', 'of the platform file', 'platform_sigma'),
      { title: 'Estimate', unit: '/ platform file\u2019s sigma', value: (row) => Math.abs(row.ratio), cell: ratio },
    ],
    rows,
  );
}

/** Section of the estimator in detail; null if no estimator estimated a calibration. */
export function calibrationSection(state) {
  const { run } = state;
  if (!run.estimators.some((one) => rowsOf(one).length)) return null;
  const place = h('div');
  function fill() {
    const { name } = run.estimators[state.detail];
    const rows = rowsOf(run.estimators[state.detail]);
    if (!rows.length) {
      place.replaceChildren(h('p', { class: 'quiet' }, `${name} did not estimate a calibration.`));
      return;
    }
    const off = rows.filter((row) => Math.abs(row.ratio) > far).length;
    const common = rows.filter((row) => ['lidar', 'wheels', 'magnetometers'].includes(row.sensor));
    const single = rows.filter((row) => !common.includes(row));
    place.replaceChildren(
      ...[
        h(
          'p',
          {},
          `${name}: ${off} of ${rows.length} parameters differ from the platform file ` +
            `by more than ${far} of its sigmas. `,
          'A run over another log can use the calibrated ',
          h('code', {}, 'platform.yaml'),
          ' of the results.',
        ),
        common.length ? tableOf(common) : null,
        single.length
          ? h('details', { open: !common.length }, h('summary', {}, 'Single magnetometers'), tableOf(single))
          : null,
      ].filter(Boolean),
    );
  }
  fill();
  state.on('detail', fill);
  return h('section', { id: 'calibration' }, h('h2', {}, 'Estimated calibration'), place);
}
