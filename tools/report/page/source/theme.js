// Colours: those of the page from its style sheet, those of series as in the program's pictures.

/** As in tools/plotting/colors.cpp. The first six are colour-blind safe (Okabe and Ito 2008). */
const light = [
  '#d55e00',
  '#0072b2',
  '#009e73',
  '#cc79a7',
  '#e69f00',
  '#56b4e9',
  '#785e3c',
  '#823ca0',
  '#969628',
  '#5a5a5a',
  '#148282',
];
const dark = [
  '#ff8a3d',
  '#4aa8e8',
  '#2fc79b',
  '#e39cc4',
  '#f2b632',
  '#8bcdf4',
  '#b79a72',
  '#b983d6',
  '#c8c85a',
  '#a8a8a8',
  '#4fc3c3',
];

/** Viridis at eight even steps (Smith and van der Walt 2015). */
const viridis = [
  [68, 1, 84],
  [70, 50, 127],
  [54, 92, 141],
  [39, 127, 142],
  [31, 161, 135],
  [74, 194, 109],
  [159, 218, 58],
  [253, 231, 37],
];

const darkQuery = window.matchMedia('(prefers-color-scheme: dark)');
let listeners = [];

export const isDark = () => darkQuery.matches && document.documentElement.dataset.theme !== 'light';

/** A colour of the style sheet by its name. */
export const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** The colour of an estimator; `index`: its `color` in the data. */
export const seriesColor = (index) => (isDark() ? dark : light)[index % light.length];

/** A share (0 to 1) as [red, green, blue], mixed with the page's background so that lines are visible on it. */
export function heat(share) {
  const ground = isDark() ? 16 : 255;
  const paling = isDark() ? 0.35 : 0.4;
  const place = Math.min(Math.max(share, 0), 1) * (viridis.length - 1);
  const low = Math.min(Math.floor(place), viridis.length - 2);
  return [0, 1, 2].map((i) => {
    const value = viridis[low][i] * (1 - place + low) + viridis[low + 1][i] * (place - low);
    return Math.round(value * (1 - paling) + ground * paling);
  });
}

/** The same without mixing. */
export function vivid(share) {
  const place = Math.min(Math.max(share, 0), 1) * (viridis.length - 1);
  const low = Math.min(Math.floor(place), viridis.length - 2);
  return [0, 1, 2].map((i) => Math.round(viridis[low][i] * (1 - place + low) + viridis[low + 1][i] * (place - low)));
}

/** Calls `act` when colours have changed: by the system's theme, or for printing. */
export function onTheme(act) {
  listeners.push(act);
}

/** Removes all listeners. */
export function forgetThemeListeners() {
  listeners = [];
}

const tell = () => listeners.forEach((act) => act());
darkQuery.addEventListener('change', tell);
window.addEventListener('beforeprint', () => {
  document.documentElement.dataset.theme = 'light';
  tell();
});
window.addEventListener('afterprint', () => {
  delete document.documentElement.dataset.theme;
  tell();
});
