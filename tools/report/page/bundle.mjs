// Makes the page's template, and from it a C++ source with the template as one string.
//
//   node bundle.mjs FOLDER_WITH_NODE_MODULES OUT.cpp
//
// The content security policy names the hashes of the one script and the one style sheet, and allows nothing else: no
// request leaves the page, whatever stands in the data.
import { createHash } from 'node:crypto';
import { readFileSync, renameSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const [packages, out] = process.argv.slice(2).map((path) => resolve(path));
const source = join(dirname(fileURLToPath(import.meta.url)), 'source');
const require = createRequire(join(packages, 'package.json'));

function fail(message) {
  console.error(`bundle.mjs: ${message}`);
  process.exit(1);
}

async function bundle(entry) {
  const esbuild = require('esbuild');
  const result = await esbuild.build({
    entryPoints: [join(source, entry)],
    nodePaths: [join(packages, 'node_modules')],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    charset: 'utf8',
    target: ['chrome100', 'firefox100', 'safari15.4'],
    legalComments: 'none',
    logLevel: 'silent',
  });
  return result.outputFiles[0].text;
}

const hash = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;

/** A C++ raw string has at most 65,536 characters in a portable compiler: pieces, which the compiler joins. */
function toCpp(text) {
  const pieces = [];
  for (let begin = 0; begin < text.length; ) {
    let end = Math.min(begin + 12000, text.length);
    if (end < text.length && text.charCodeAt(end - 1) >= 0xd800 && text.charCodeAt(end - 1) < 0xdc00) --end;
    pieces.push(`R"page~(${text.slice(begin, end)})page~"`);
    begin = end;
  }
  return `// Made by tools/report/page/bundle.mjs.
#include "tools/report/page_template.h"

namespace lodestone {

namespace {
constexpr char kText[] = ${pieces.join('\n')};
}  // namespace

const std::string_view kPageTemplate{kText, sizeof(kText) - 1};

}  // namespace lodestone
`;
}

const version = (name) => JSON.parse(readFileSync(join(packages, 'node_modules', name, 'package.json'), 'utf8')).version;
const licence = (name) => readFileSync(join(packages, 'node_modules', name, 'LICENSE'), 'utf8').trim().replaceAll('--', '- -');

try {
  const script = (await bundle('main.js')).replaceAll('</script', '<\\/script').trim();
  const style = (await bundle('page.css')).trim();
  const notices = ['three', 'uplot'].map((name) => `${name} ${version(name)}\n\n${licence(name)}`).join('\n\n');
  const template = readFileSync(join(source, 'page.html'), 'utf8')
    .replace('%POLICY%', () => `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; img-src data: blob:; base-uri 'none'; form-action 'none'`)
    .replace('%STYLE%', () => style)
    .replace('%SCRIPT%', () => script)
    .replace('%NOTICES%', () => `Bundled with esbuild ${version('esbuild')} (MIT). This page contains:\n\n${notices}`);
  for (const mark of ['@TITLE@', '@DATA@']) {
    if (template.split(mark).length !== 2) fail(`page.html: expected ${mark} once`);
  }
  if (template.includes(')page~"')) fail('the page holds the end mark of a C++ raw string');
  writeFileSync(`${out}.part`, toCpp(template));
  renameSync(`${out}.part`, out);
} catch (error) {
  const first = error.errors?.[0];
  fail(first ? `${first.location?.file}:${first.location?.line}: ${first.text}` : error.message);
}
