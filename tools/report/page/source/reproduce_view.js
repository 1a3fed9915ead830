// An experiment: tables, figures, and the charts of each run with a selector.
import { count, h } from './dom.js';
import { factList, factsOf, runView } from './run_view.js';
import { plainTable } from './table.js';
import { forgetThemeListeners } from './theme.js';

/** A readable name of a run. */
const nameOf = (run) =>
  [
    run.world,
    run.sequence && `sequence ${run.sequence}`,
    run.range_m != null && `LiDAR to ${run.range_m} m`,
    run.noise_ut != null && `noise ${run.noise_ut} µT`,
    run.scene && `scene ${run.scene}`,
    [run.group, run.name].filter(Boolean).join('/'),
  ]
    .filter(Boolean)
    .join(' · ') || run.folder;

function runBrowser(runs) {
  const place = h('div', { id: 'run' });
  const select = h(
    'select',
    { id: 'choose-run', 'aria-label': 'Run', onchange: () => show(Number(select.value)) },
    runs.map((run, i) => h('option', { value: i }, nameOf(run))),
  );

  async function show(index) {
    forgetThemeListeners();
    const run = runs[index];
    const view = await runView(run.data);
    place.replaceChildren(
      factList({ ...factsOf(run.data), ...(run.seed != null ? { Seed: String(run.seed) } : {}) }),
      view.element,
    );
    view.start();
    place.dataset.run = nameOf(run);
  }

  return {
    element: h(
      'section',
      { id: 'runs' },
      h('h2', {}, 'Single runs'),
      h('div', { class: 'bar' }, h('label', {}, 'run: ', select)),
      place,
    ),
    start: () => show(0),
  };
}

export async function reproduceView(data) {
  const browser = data.runs.length ? runBrowser(data.runs) : null;
  const element = h(
    'div',
    {},
    data.missing?.length
      ? h(
          'p',
          { class: 'notice' },
          `Missing files of the experiment: ${data.missing.slice(0, 8).join(', ')}` +
            `${data.missing.length > 8 ? `, and ${data.missing.length - 8} more` : ''}.`,
        )
      : null,
    data.tables.map((table) =>
      h(
        'section',
        { class: 'result' },
        h('h2', {}, table.title),
        plainTable(table.header, table.rows),
        table.note ? h('p', { class: 'quiet small' }, table.note) : null,
      ),
    ),
    data.figures.length
      ? h(
          'section',
          { id: 'figures' },
          h('h2', {}, 'Figures'),
          h(
            'div',
            { class: 'two' },
            data.figures.map((figure) =>
              h(
                'figure',
                {},
                figure.image
                  ? h('img', { src: figure.image, alt: figure.title })
                  : h('p', { class: 'notice' }, 'not in the folder'),
                h(
                  'figcaption',
                  {},
                  h('b', {}, figure.title),
                  figure.caption ? ` ${figure.caption}` : '',
                  figure.files.length ? h('span', {}, ' Files: ', h('code', {}, figure.files.join(', '))) : '',
                ),
              ),
            ),
          ),
        )
      : null,
    browser?.element ?? h('p', { class: 'quiet' }, 'No run has finished.'),
    browser && data.all_runs > data.runs.length
      ? h(
          'p',
          { class: 'quiet small' },
          `${count(data.runs.length)} of ${count(data.all_runs)} runs are shown: one seed of each.`,
        )
      : null,
  );
  return {
    element,
    async start() {
      await browser?.start();
    },
  };
}
