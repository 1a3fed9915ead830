// How far each estimate can be trusted: one sentence for each estimator, and the stretches that were not good.
import { count, fixed, h, metres } from './dom.js';
import { sortableTable } from './table.js';

const words = (reason) => reason.replaceAll('_', ' ');

/** docs/user/concepts.md: their covariance contains only the noise of sensors and maps. */
const filters = new Set(['ieskf', 'lidar-inertial']);

/** The errors beside the sigmas; empty without ground truth. */
function errors({ ate_m: ate, max_error_m: most, nees_pose: nees }) {
  if (!Number.isFinite(most)) return '';
  const factor = Math.sqrt(nees);
  const verdict = nees > 4 ? `: errors of about ${fixed(factor, 0)} sigmas, the covariance is too small` : '';
  const text = Number.isFinite(nees) ? `. NEES ${nees > 999 ? '> 999' : fixed(nees, 2)}${verdict}` : '';
  return ` Errors of its poses: up to ${metres(most)}, rmse ${metres(ate)}${text}.`;
}

function sentence(one) {
  const { scans, good, unobserved, largest_sigma_m: sigma, largest_heading_sigma_deg: heading } = one.health;
  const known = sigma > 0 ? `, with sigmas up to ${metres(sigma)} and ${fixed(heading, 2)}°` : '';
  const parts = [`${one.name}: ${count(good)} of ${count(scans)} scans are good${good ? known : ''}.`];
  if (good) parts.push(errors(one.summary));
  if (good && filters.has(one.name)) {
    parts.push(
      ' The sigma of a filter lacks errors of calibration and clocks:',
      ' do not derive a limit of the error from it.',
    );
  }
  if (unobserved > 0)
    parts.push(` In ${count(unobserved)} of the good scans, nothing observed a degenerate direction.`);
  return h('p', {}, parts.join(''));
}

/** Null if no estimator reported its health. */
export function trustSection(run) {
  const judged = run.estimators.filter((one) => one.health);
  if (!judged.length) return null;
  const rows = judged.flatMap((one) => one.health.stretches.map((stretch) => ({ ...stretch, name: one.name })));
  const columns = [
    { title: 'Estimator', text: true, value: (row) => row.name },
    { title: 'From', unit: 's', value: (row) => row.from_s, cell: (row) => fixed(row.from_s, 1) },
    { title: 'To', unit: 's', value: (row) => row.to_s, cell: (row) => fixed(row.to_s, 1) },
    {
      title: 'Health',
      text: true,
      value: (row) => row.health,
      cell: (row) => h('span', { class: row.health === 'lost' ? 'bad' : '' }, row.health),
    },
    { title: 'Why', text: true, wrap: true, value: (row) => row.reasons.map(words).join(', ') },
  ];
  return h(
    'section',
    { id: 'trust' },
    h('h2', {}, 'Trust'),
    judged.map(sentence),
    rows.length ? sortableTable(columns, rows) : null,
  );
}
