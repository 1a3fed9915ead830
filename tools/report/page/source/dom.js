// Elements and text formatting.

/** An element: attributes, `on…` listeners, then children (elements, text, arrays; null and false are ignored). */
export function h(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value == null || value === false) continue;
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (key === 'style') Object.assign(element.style, value);
    else element.setAttribute(key, value === true ? '' : value);
  }
  element.append(...children.flat(Infinity).filter((child) => child != null && child !== false));
  return element;
}

/** The sample of a line in a legend, with its stroke. `dash`: pixels of line and gap, as for a canvas. */
export function lineSample(stroke, dash = [], width = 4) {
  const style = { background: stroke, height: `${Math.max(2, Math.round(width))}px` };
  if (dash.length) {
    const [line, gap] = dash;
    style.width = '28px';
    style.webkitMaskImage = `repeating-linear-gradient(90deg, #000 0 ${line}px, transparent ${line}px ${line + gap}px)`;
  }
  return h('span', { class: 'swatch', style });
}

const thin = '\u2009';

/** A number with this many decimals; an en dash if it is not finite. */
export const fixed = (value, digits) =>
  Number.isFinite(value) ? value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1') : '–';

/** A length in a readable unit. */
export function metres(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 9e5) return '∞';
  if (size >= 100) return `${value.toFixed(0)}${thin}m`;
  if (size >= 1) return `${value.toFixed(2)}${thin}m`;
  if (size >= 0.01) return `${(100 * value).toFixed(1)}${thin}cm`;
  return `${(1000 * value).toFixed(size >= 0.001 ? 1 : 2)}${thin}mm`;
}

/** A round length, for ticks. */
export function roundMetres(value) {
  const [factor, unit] =
    value >= 1 ? [1, 'm'] : value >= 0.01 ? [100, 'cm'] : value >= 1e-3 ? [1000, 'mm'] : [1e6, 'µm'];
  return value === 0 ? '0' : `${+(factor * value).toPrecision(3)}${thin}${unit}`;
}

/** Three significant digits, without an exponent if possible. */
export function brief(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 1e5 || (size > 0 && size < 1e-4)) return value.toExponential(1);
  return size >= 100 ? value.toFixed(0) : `${Number(value.toPrecision(3))}`;
}

export const count = (value) => (Number.isFinite(value) ? value.toLocaleString('en-GB').replaceAll(',', thin) : '–');

/** The last part of a path. */
export const leaf = (path) => (typeof path === 'string' ? path.replace(/\/+$/, '').split('/').pop() : null);

/** A stamp in seconds as a date; null if the clock has no calendar date (a simulation from zero). */
export function date(stamp) {
  const seconds = Number(stamp);
  if (!(seconds > 6e8 && seconds < 8e9)) return null;
  return `${new Date(1000 * seconds).toISOString().slice(0, 19).replace('T', ' ')} UTC`;
}

export function duration(seconds) {
  if (!Number.isFinite(seconds)) return '–';
  if (seconds < 100) return `${seconds.toFixed(1)}${thin}s`;
  return `${Math.floor(seconds / 60)}${thin}min ${Math.round(seconds % 60)}${thin}s`;
}

/** Calls `act` after the element's width has changed. */
export function onResize(element, act) {
  let width = element.clientWidth;
  new ResizeObserver(() => {
    if (element.clientWidth === width || element.clientWidth === 0) return;
    width = element.clientWidth;
    act();
  }).observe(element);
}
