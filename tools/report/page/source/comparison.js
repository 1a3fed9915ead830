// The table that compares the estimators of a run.
import { count, fixed, h, metres } from './dom.js';
import { largest, smallest, sortableTable } from './table.js';
import { onTheme, seriesColor } from './theme.js';

const share = (part, whole) =>
  whole > 0 ? ` (${fixed((100 * part) / whole, part === whole || part === 0 ? 0 : 1)}\u2009%)` : '';

/** The colour mark of an estimator. */
export function swatch(estimator) {
  const mark = h('span', { class: 'swatch', style: { background: seriesColor(estimator.color) } });
  onTheme(() => {
    mark.style.background = seriesColor(estimator.color);
  });
  return mark;
}

/** The A/B table. */
export function comparison(run) {
  const withTruth = run.estimators.some((one) => one.summary.ate_m != null);
  const of = (name) => (row) => row.summary[name] ?? NaN;
  const number = (title, unit, name, digits, best) => ({
    title,
    unit,
    value: of(name),
    cell: (row) => fixed(of(name)(row), digits),
    best,
  });
  // If an estimator did not test for degeneracy, there is no count.
  const measured = (series) => series?.some((value) => value != null);
  const degenerate = (row) => (measured(row.series.direction_1) ? of('degenerate_scans')(row) : NaN);
  const rejected = (row) => (measured(row.series.weight) ? of('magnetic_rejected')(row) : NaN);
  const outcome = (row) => {
    if (row.status !== 'done') return ['bad', row.status];
    if (row.summary.success == null)
      return row.summary.uncertain_scans > row.summary.scans / 2 ? ['bad', 'done, mostly uncertain'] : ['good', 'done'];
    return row.summary.success ? ['good', 'on track'] : ['bad', 'error above 1 m'];
  };
  const columns = [
    { title: 'Estimator', value: (row) => row.name, cell: (row) => [swatch(row), row.name] },
    {
      title: 'Outcome',
      text: true,
      value: (row) => outcome(row)[1],
      cell: (row) => h('span', { class: outcome(row)[0] }, outcome(row)[1]),
    },
    ...(withTruth
      ? [
          {
            title: 'ATE',
            unit: 'rmse, unaligned',
            value: of('ate_m'),
            cell: (row) => metres(of('ate_m')(row)),
            best: smallest,
          },
          {
            title: 'Largest',
            unit: 'error',
            value: of('max_error_m'),
            cell: (row) => metres(of('max_error_m')(row)),
            best: smallest,
          },
          {
            title: 'Heading',
            unit: 'rmse, °',
            value: of('heading_rmse_deg'),
            cell: (row) => fixed(of('heading_rmse_deg')(row), 3),
            best: smallest,
          },
          {
            title: 'NEES',
            unit: '1 is consistent',
            value: of('nees_pose'),
            cell: (row) => (of('nees_pose')(row) > 999 ? '> 999' : fixed(of('nees_pose')(row), 2)),
            best: (values) => smallest(values.map((value) => Math.abs(Math.log(value)))),
          },
        ]
      : []),
    {
      title: 'Uncertain',
      unit: 'scans',
      value: of('uncertain_scans'),
      cell: (row) => count(of('uncertain_scans')(row)),
    },
    {
      title: 'Degenerate',
      unit: 'scans',
      value: degenerate,
      cell: (row) =>
        Number.isFinite(degenerate(row))
          ? `${count(degenerate(row))}${share(degenerate(row), row.summary.scans)}`
          : '–',
    },
    { title: 'Rejected', unit: 'field samples', value: rejected, cell: (row) => count(rejected(row)) },
    number('Speed', '× real time', 'real_time_factor', 1, largest),
  ];
  return sortableTable(
    columns,
    run.estimators,
    withTruth ? 2 : 0,
  );
}
