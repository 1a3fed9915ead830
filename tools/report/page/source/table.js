// Sortable tables.
import { h } from './dom.js';

const rank = (value) => (typeof value === 'number' && !Number.isFinite(value) ? null : value);

function compare(a, b) {
  const [x, y] = [rank(a), rank(b)];
  if (x == null || y == null) return (x == null) - (y == null);
  return typeof x === 'string' || typeof y === 'string'
    ? String(x).localeCompare(String(y), 'en', { numeric: true })
    : x - y;
}

/**
 * columns: {title, unit, text: left-aligned, value(row): sort key, cell(row): shown cell, best(values): index of the
 * best row}. `sorted`: index of the initial sort column, ascending. Values that are not finite are always last.
 */
export function sortableTable(columns, rows, sorted) {
  const body = h('tbody');
  const heads = columns.map((column, i) =>
    h(
      'th',
      { class: column.text ? 'text' : null, scope: 'col' },
      h('button', { type: 'button', onclick: () => sort(i) }, column.title),
      column.unit ? h('span', { class: 'unit' }, column.unit) : null,
    ),
  );
  const best = columns.map((column) =>
    column.best && rows.length > 1 ? rows[column.best(rows.map(column.value))] : null,
  );

  function fill(order) {
    body.replaceChildren(
      ...order.map((row) =>
        h(
          'tr',
          {},
          columns.map((column, i) => {
            const cell = column.cell ? column.cell(row) : column.value(row);
            if (i === 0) return h('th', { scope: 'row' }, cell);
            return h(
              'td',
              {
                class:
                  [column.text ? 'text' : '', column.wrap ? 'wrap' : '', best[i] === row ? 'best' : '']
                    .join(' ')
                    .trim() || null,
              },
              cell,
            );
          }),
        ),
      ),
    );
  }

  function sort(i, direction) {
    const now = heads[i].getAttribute('aria-sort');
    const chosen = direction ?? (now === 'ascending' ? 'descending' : 'ascending');
    heads.forEach((head) => head.removeAttribute('aria-sort'));
    heads[i].setAttribute('aria-sort', chosen);
    const { value } = columns[i];
    fill(
      [...rows].sort((a, b) => {
        const [x, y] = [rank(value(a)), rank(value(b))];
        const order = compare(x, y);
        return chosen === 'descending' && x != null && y != null ? -order : order;
      }),
    );
  }

  fill(rows);
  if (sorted != null) sort(sorted, 'ascending');
  return h(
    'div',
    { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'table' },
    h('table', {}, h('thead', {}, h('tr', {}, heads)), body),
  );
}

/** Index of the smallest finite value. */
export function smallest(values) {
  let found = -1;
  values.forEach((value, i) => {
    if (Number.isFinite(value) && (found < 0 || value < values[found])) found = i;
  });
  return found;
}

export const largest = (values) => smallest(values.map((value) => -value));

/** A one-word outcome in its colour. */
function plainCell(cell) {
  const text = cell == null ? '–' : typeof cell === 'boolean' ? (cell ? 'yes' : 'no') : String(cell);
  const kind = { yes: 'good', no: 'bad', lost: 'bad', failed: 'bad' }[text];
  return kind ? h('span', { class: kind }, text) : text;
}

/** A table without sorting: header and rows of text or numbers. */
export function plainTable(header, rows) {
  return h(
    'div',
    { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'table' },
    h(
      'table',
      {},
      h(
        'thead',
        {},
        h(
          'tr',
          {},
          header.map((text) => h('th', { scope: 'col' }, text)),
        ),
      ),
      h(
        'tbody',
        {},
        rows.map((row) =>
          h(
            'tr',
            {},
            row.map((cell, i) => (i === 0 ? h('th', { scope: 'row' }, plainCell(cell)) : h('td', {}, plainCell(cell)))),
          ),
        ),
      ),
    ),
  );
}
