// Reads the page's data and builds the page. `data-ready` on the root is set when everything is drawn.
import { h } from './dom.js';
import { reproduceView } from './reproduce_view.js';
import { factList, factsOf, runView } from './run_view.js';

function header(data) {
  if (data.reproduce) {
    return h(
      'header',
      {},
      h('h1', {}, data.reproduce.title || data.reproduce.experiment || data.folder),
      h(
        'p',
        { class: 'quiet' },
        `Experiment ${data.reproduce.experiment || data.folder}, ${data.reproduce.all_runs} runs, ` +
          `Lodestone ${data.version}`,
      ),
    );
  }
  const { run } = data;
  const lost = run.estimators.filter((one) => one.status === 'lost').map((one) => one.name);
  const bad = run.status !== 'done';
  return h(
    'header',
    {},
    h(
      'h1',
      {},
      data.folder,
      ' ',
      h('span', { class: `badge ${bad ? 'bad' : 'good'}` }, lost.length ? `${lost.join(', ')} lost track` : run.status),
    ),
    factList({ ...factsOf(run), Lodestone: run.inputs.lodestone ?? data.version }),
  );
}

function footer() {
  return h(
    'footer',
    {},
    'Poses are T_map_imu at scan ends. Errors are against the ground truth, without alignment. ',
    'Sigma of a position: the root of its covariance’s trace. ',
    'NEES is per degree of freedom; above 1, the covariance is too small (overconfident). ',
    'This file contains its scripts (uPlot and three.js, MIT licence) and makes no network requests.',
  );
}

async function start() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const view = data.reproduce ? await reproduceView(data.reproduce) : await runView(data.run);
  document.getElementById('report').replaceChildren(header(data), h('main', {}, view.element));
  document.body.append(footer());
  await view.start();
  window.addEventListener('beforeprint', () =>
    document.querySelectorAll('details').forEach((one) => {
      one.open = true;
    }),
  );
  requestAnimationFrame(() =>
    requestAnimationFrame(() => {
      document.documentElement.dataset.ready = 'yes';
    }),
  );
}

start().catch((error) => {
  document
    .getElementById('report')
    .prepend(h('p', { class: 'notice' }, `This report could not be shown: ${error.message}`));
  throw error;
});
