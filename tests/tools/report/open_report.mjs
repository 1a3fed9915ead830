// Opens a report in Chromium as a reader would, and says in JSON what it drew and what it asked for.
//
//   node open_report.mjs REPORT.html [--size 1280x900] [--dark] [--choose field|cloud|none|space] [--detail N]
//       [--hover SHARE] [--screenshot OUT.png] [--whole] [--pdf OUT.pdf]
//
// --whole: the screenshot shows the page to its end. --hover: the pointer stands over the first chart, at that share of
// its width.
import { existsSync, writeFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { Chromium } from './chromium.mjs';

const {
  values: options,
  positionals: [file],
} = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: 'string', default: '1280x900' },
    dark: { type: 'boolean' },
    choose: { type: 'string' },
    detail: { type: 'string' },
    hover: { type: 'string' },
    screenshot: { type: 'string' },
    whole: { type: 'boolean' },
    pdf: { type: 'string' },
    scale: { type: 'string', default: '1' },
  },
});
if (!file || !existsSync(file)) {
  console.error(`open_report.mjs: ${file ?? 'no file named'}: there is no such file`);
  process.exit(2);
}
const [width, height] = options.size.split('x').map(Number);
const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

/** Runs in the page: what every chart's canvas holds. */
function inspect() {
  const rgb = (text) => text.match(/\d+/g).slice(0, 3).map(Number);
  return [...document.querySelectorAll('[data-chart]')]
    .filter((one) => one.offsetParent !== null)
    .map((one) => {
      const source = one.tagName === 'CANVAS' ? one : one.querySelector('canvas');
      if (!source) return { chart: one.dataset.chart, painted: 0, colors: 0, series: [] };
      const copy = document.createElement('canvas');
      copy.width = source.width;
      copy.height = source.height;
      const context = copy.getContext('2d');
      context.drawImage(source, 0, 0);
      const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
      const swatches = [...(one.closest('.panel')?.querySelectorAll('.values .swatch') ?? [])];
      const inks = swatches.map((swatch) => rgb(getComputedStyle(swatch).backgroundColor));
      const counts = inks.map(() => 0);
      const colors = new Set();
      let painted = 0;
      for (let i = 0; i < pixels.length; i += 4) {
        if (pixels[i + 3] === 0) continue;
        ++painted;
        colors.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
        inks.forEach((ink, k) => {
          if (ink.every((value, c) => Math.abs(value - pixels[i + c]) < 40)) ++counts[k];
        });
      }
      return {
        chart: one.dataset.chart,
        width: copy.width,
        height: copy.height,
        painted,
        colors: colors.size,
        series: counts,
        strokes: new Set(swatches.map((swatch) => swatch.style.webkitMaskImage)).size, // different ones in the legend
        data: { ...one.dataset },
      };
    });
}

const chromium = new Chromium(process.env.LODESTONE_CHROMIUM ?? 'chromium');
const requests = [];
const errors = [];
try {
  await chromium.openTab();
  chromium.on('Network.requestWillBeSent', ({ request }) =>
    requests.push(request.url.startsWith('data:') ? request.url.slice(0, 40) : request.url),
  );
  chromium.on('Runtime.exceptionThrown', ({ exceptionDetails }) =>
    errors.push(exceptionDetails.exception?.description ?? exceptionDetails.text),
  );
  chromium.on('Runtime.consoleAPICalled', ({ type, args }) => {
    if (type === 'error' || type === 'warning') errors.push(args.map((one) => one.value ?? one.description).join(' '));
  });
  chromium.on('Log.entryAdded', ({ entry }) => {
    if (entry.level === 'error' || entry.source === 'security') errors.push(entry.text);
  });
  for (const domain of ['Page', 'Runtime', 'Network', 'Log']) await chromium.call(`${domain}.enable`);
  await chromium.call('Emulation.setDeviceMetricsOverride', {
    width,
    height,
    deviceScaleFactor: Number(options.scale),
    mobile: width < 600,
  });
  if (options.dark)
    await chromium.call('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: 'dark' }] });
  await chromium.call('Page.navigate', { url: pathToFileURL(resolve(file)).href });
  let ready = false;
  for (let waited = 0; waited < 60_000 && !ready; waited += 100) {
    ready = await chromium.evaluate("document.documentElement?.dataset.ready === 'yes'");
    if (!ready) await pause(100);
  }
  const click = async (choice) => {
    await chromium.evaluate(`document.querySelector('[data-choice="${choice}"]').click()`);
    await pause(400);
  };
  if (ready && options.choose) await click(options.choose);
  if (ready && options.detail) {
    await chromium.evaluate(
      `{ const s = document.querySelector('#time select'); s.value = ${Number(options.detail)};
          s.dispatchEvent(new Event('change')); }`,
    );
    await pause(200);
  }
  let hovered = null;
  if (ready && options.hover) {
    const frame = await chromium.evaluate(`(() => { const over = document.querySelector('#time .u-over');
    over.scrollIntoView({ block: 'center' });
      const { left, top, width, height } = over.getBoundingClientRect(); return { left, top, width, height }; })()`);
    await chromium.call('Input.dispatchMouseEvent', {
      type: 'mouseMoved',
      x: frame.left + Number(options.hover) * frame.width,
      y: frame.top + 0.4 * frame.height,
    });
    await pause(300);
    hovered = await chromium.evaluate("[...document.querySelectorAll('#time .values')].map((one) => one.textContent)");
    if (options.whole) await chromium.evaluate('scrollTo(0, 0)');
  }
  const charts = await chromium.evaluate(`(${inspect})()`);
  const page = await chromium.evaluate(`({ width: document.documentElement.scrollWidth,
    height: document.documentElement.scrollHeight,
    headings: [...document.querySelectorAll('h1, h2')].map((one) => one.textContent),
    rows: document.querySelectorAll('#comparison tbody tr').length,
    trust: Array.from(document.querySelectorAll('#trust p, #trust td'), (cell) => cell.textContent),
    staleRows: document.querySelectorAll('#stale tbody tr').length,
    calibrationRows: document.querySelectorAll('#calibration tbody tr').length,
    images: [...document.images].filter((one) => one.naturalWidth > 0).length,
    text: document.getElementById('report').innerText.length })`);
  if (options.screenshot) {
    const clip = options.whole ? { x: 0, y: 0, width, height: page.height, scale: 1 } : undefined;
    const { data } = await chromium.call('Page.captureScreenshot', {
      format: 'png',
      captureBeyondViewport: Boolean(options.whole),
      clip,
    });
    writeFileSync(options.screenshot, Buffer.from(data, 'base64'));
  }
  if (options.pdf) {
    const { data } = await chromium.call('Page.printToPDF', { printBackground: true, preferCSSPageSize: true });
    writeFileSync(options.pdf, Buffer.from(data, 'base64'));
  }
  console.log(JSON.stringify({ ready, requests, errors, charts, page, hovered }, null, 1));
} catch (error) {
  console.error(`open_report.mjs: ${error.message}`);
  process.exitCode = 1;
} finally {
  await chromium.close();
}
