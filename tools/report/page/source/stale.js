// Stale places: the field differs significantly from the map. docs/user/stale-map.md has the columns.
import { brief, fixed } from './dom.js';

/** More than half of the visited cells differ: rather the trajectory, the calibration or the choice of the map is
 * wrong, as the terminal says. */
export const mapIsHardlyTheCause = (figures) => figures != null && 2 * figures.stale > figures.places;

/** {number, x, y, difference: µT, row} of each place; the first has the largest difference. None if the map is hardly
 * the cause. */
export function placesOf(estimator) {
  const stale = estimator?.stale_places;
  if (!stale || mapIsHardlyTheCause(estimator.summary.stale_map)) return [];
  const at = (row, name) => Number(row[stale.columns.indexOf(name)]);
  return stale.rows
    .map((row, i) => ({
      number: at(row, 'place') || i + 1,
      x: at(row, 'x_m'),
      y: at(row, 'y_m'),
      difference: at(row, 'largest_difference_ut'),
      row,
    }))
    .filter((place) => Number.isFinite(place.x) && Number.isFinite(place.y));
}

/** Columns of the file that the table shows. */
const shown = [
  ['place', 'Place', '', 0],
  ['x_m', 'x', 'm', 2],
  ['y_m', 'y', 'm', 2],
  ['extent_m', 'Extent', 'm', 1],
  ['cells', 'Cells', '', 0],
  ['largest_difference_ut', 'Largest', 'difference, µT', 1],
  ['mean_difference_ut', 'Mean', 'difference, µT', 1],
  ['sigma_ut', 'Sigma', 'expected, µT', 2],
  ['p_value', 'p value', 'by chance', null],
  ['first_t_s', 'First', 's', 1],
  ['last_t_s', 'Last', 's', 1],
];

/** Columns for sortableTable over the rows of `stale`; times since the log's begin. */
export function staleColumns(stale, begin) {
  return shown
    .map(([name, title, unit, digits]) => {
      const index = stale.columns.indexOf(name);
      const offset = name.endsWith('_t_s') ? begin : 0;
      const value = (row) => Number(row[index]) - offset;
      return index < 0
        ? null
        : { title, unit, value, cell: (row) => (digits == null ? brief(value(row)) : fixed(value(row), digits)) };
    })
    .filter(Boolean);
}
