// Tests that the imports of the page have no cycles, so that no file depends on one that is loaded later.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { test } from 'node:test';

const PAGE = new URL('../../../src/http/page/web/js/', import.meta.url);

/** The files that a file imports, at once or when they are needed. */
function importsOf(file) {
  const text = readFileSync(file, 'utf8').replace(/\/\*[\s\S]*?\*\//g, '');
  const found = [...text.matchAll(/(?:\bfrom\s*|\bimport\s*\(?\s*)'(\.[^']+)'/g)];
  return found.map(([, path]) => new URL(path, file).href);
}

/** The first circle that is found, as the names of its files. */
function circle(files, importsOfFile) {
  const done = new Set();
  function visit(file, way) {
    if (way.includes(file)) return [...way.slice(way.indexOf(file)), file];
    if (done.has(file)) return null;
    for (const next of importsOfFile(file)) {
      const found = visit(next, [...way, file]);
      if (found) return found;
    }
    done.add(file);
    return null;
  }
  for (const file of files) {
    const found = visit(file, []);
    if (found) return found;
  }
  return null;
}

test('a circle is found', () => {
  const graph = { a: ['b'], b: ['c', 'd'], c: [], d: ['b'] };
  assert.deepEqual(circle(Object.keys(graph), (file) => graph[file]), ['b', 'd', 'b']);
});

test('no file of the page imports itself in a circle', () => {
  const files = readdirSync(PAGE, { recursive: true }).filter((name) => name.endsWith('.js')).map((name) => new URL(name, PAGE).href);
  const graph = new Map(files.map((file) => [file, importsOf(new URL(file))]));
  const own = [...graph.values()].flat().filter((file) => graph.has(file));
  assert.ok(own.length > files.length, `${own.length} imports were found in ${files.length} files`);
  assert.deepEqual(circle(files, (file) => graph.get(file) ?? []), null);
});

test('the document names every file that the first view needs, so that the browser asks for all of them at once', () => {
  const needed = new Set();
  const visit = (/** @type {string} */ file) => {
    if (needed.has(file)) return;
    needed.add(file);
    const text = readFileSync(new URL(file), 'utf8');
    for (const [, path] of text.matchAll(/^import (?:[^'"]*? from )?'(\.[^']+)';/gm)) visit(new URL(path, file).href);
  };
  visit(new URL('page.js', PAGE).href);
  const named = [...readFileSync(new URL('../index.html', PAGE), 'utf8').matchAll(/(?:modulepreload"|module") (?:href|src)="\/page\/-\/([^"]+)"/g)].map(([, path]) => new URL(`../${path}`, PAGE).href);
  assert.deepEqual(named.sort(), [...needed].sort());
});
