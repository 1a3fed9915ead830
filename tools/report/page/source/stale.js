// Stale places: where the field disagrees with the map beyond what their sigmas allow.

const words = { id: '', m: 'm', ut: 'µT', s: 's', deg: '°' };

/** {x, y, row} of each place that says where it is. */
export function placesOf(estimator) {
  const stale = estimator?.stale_places;
  if (!stale) return [];
  const column = (...names) => stale.columns.findIndex((name) => names.includes(name));
  const [x, y] = [column('x_m', 'center_x_m', 'x'), column('y_m', 'center_y_m', 'y')];
  if (x < 0 || y < 0) return [];
  return stale.rows.map((row) => ({ x: Number(row[x]), y: Number(row[y]), row })).filter((place) => Number.isFinite(place.x) && Number.isFinite(place.y));
}

/** "largest_difference_ut" as {title: "largest difference", unit: "µT"}. */
export function titleOf(name) {
  const parts = name.split('_');
  const unit = parts.length > 1 ? words[parts[parts.length - 1]] : undefined;
  if (unit) parts.pop();
  return { title: parts.join(' '), unit: unit ?? '' };
}
