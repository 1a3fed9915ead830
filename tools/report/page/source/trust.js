// How far each estimate can be trusted: one sentence for each estimator, and the stretches that were not good.
import { count, fixed, h, metres } from './dom.js';
import { sortableTable } from './table.js';

const words = (reason) => reason.replaceAll('_', ' ');

function sentence(one) {
  const { scans, good, largest_sigma_m: sigma, largest_heading_sigma_deg: heading } = one.health;
  const known = sigma > 0 ? `, with sigmas up to ${metres(sigma)} and ${fixed(heading, 2)}°` : '';
  return h('p', {}, `${one.name}: ${count(good)} of ${count(scans)} scans are good${good ? known : ''}.`);
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
