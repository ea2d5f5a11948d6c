// Tests the case as a document (pointers, text, differences), and the addresses of the page.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { test } from 'node:test';
import { at, differences, placeInText, pretty, put } from '../../../src/http/page/web/js/document.js';
import { formatRoute, parseRoute } from '../../../src/http/page/web/js/routes.js';
import { withContact } from '../../../src/http/page/web/js/starts.js';
import { valueInWords, wordsOf } from '../../../src/http/page/web/js/words.js';

const EXAMPLES = new URL('../../../api/examples/', import.meta.url);

test('pointers reach members with slashes and tildes in their names', () => {
  const document = { 'a/b': { 'c~d': [10, { e: 11 }] } };
  assert.equal(at(document, '/a~1b/c~0d/1/e'), 11);
  assert.equal(at(document, '/a~1b/none/1'), undefined);
  assert.equal(at(document, ''), document);
  const changed = put(document, '/a~1b/c~0d/1/e', 12);
  assert.equal(at(changed, '/a~1b/c~0d/1/e'), 12);
  assert.equal(at(document, '/a~1b/c~0d/1/e'), 11, 'the document before stays as it was');
});

test('putting makes the objects on the way and nothing takes a member away', () => {
  assert.deepEqual(put({}, '/solver/mesh/strips', 4), { solver: { mesh: { strips: 4 } } });
  assert.deepEqual(put({ a: 1, b: 2 }, '/a', undefined), { b: 2 });
});

test('every example reads back from its pretty text', () => {
  const files = readdirSync(EXAMPLES).filter((name) => name.endsWith('.case.json'));
  assert.ok(files.length > 10);
  for (const file of files) {
    const document = JSON.parse(readFileSync(new URL(file, EXAMPLES), 'utf8'));
    assert.deepEqual(JSON.parse(pretty(document)), document, file);
  }
  for (const value of [[], {}, [[1, 2], [3, 4]], { a: [] }, { a: { b: [{ c: null }] } }, 'x', [Array(300).fill(1.25)]]) {
    assert.deepEqual(JSON.parse(pretty(value)), value);
  }
});

test('differences are the pointers at which two documents differ', () => {
  const one = { a: 1, b: { c: [1, 2, 3] }, d: 'x' };
  const two = { a: 1, b: { c: [1, 5, 3] }, e: true };
  assert.deepEqual(differences(one, two).sort(), ['/b/c/1', '/d', '/e']);
  assert.deepEqual(differences(one, structuredClone(one)), []);
  assert.deepEqual(differences({ points: Array(50).fill(0) }, { points: Array(50).fill(1) }), ['/points']);
});

test('the place of a pointer in the text is that of its member', () => {
  const text = pretty({ motion: { creepage_x: 1 }, other: { creepage_x: 2 } });
  const [start, end] = placeInText(text, '/other/creepage_x') ?? [0, 0];
  assert.equal(text.slice(start, end), '"creepage_x"');
  assert.ok(start > text.indexOf('"other"'));
});

test('addresses lead back to what they were made of', () => {
  const route = parseRoute(formatRoute('result', ['a1'], { patch: 1, point: 9, field: 'traction', x: undefined }));
  assert.deepEqual(route, { view: 'result', ids: ['a1'], query: { patch: '1', point: '9', field: 'traction' } });
  assert.deepEqual(parseRoute('#/compare/a/b/c'), { view: 'compare', ids: ['a', 'b', 'c'], query: {} });
  assert.equal(parseRoute('#/nothing').view, 'compose');
  assert.equal(parseRoute('').view, 'compose');
});

test('a case keeps what it asks for beside the fields when its contact is another one', () => {
  const asked = { outputs: ['resultants', 'damage'], damage: { models: ['t_gamma'] } };
  const document = withContact(asked, 'ellipse');
  assert.deepEqual(document.damage, asked.damage);
  assert.deepEqual(document.outputs, ['resultants', 'zones', 'tractions', 'pressure', 'slip', 'damage']);
});

test('one wheel becomes a wheelset with its cross-sections, and has loads and motions of its own', () => {
  const [rail, wheel] = [{ points_mm: [[0, 0], [1, 0]] }, { format: 'columns', text: '0 0' }];
  const one = withContact({ contact: { type: 'profiles', rail, wheel }, load: { vertical_force_n: 70_000 } }, 'wheelset');
  const { contact, load } = /** @type {{ contact: import('../../../src/http/page/web/js/document.js').JsonObject, load: object }} */ (/** @type {unknown} */ (one));
  assert.deepEqual([contact.rail, contact.wheel, load], [rail, wheel, { vertical_force_n: 150_000 }]);
  const back = withContact(one, 'profiles');
  assert.deepEqual(back.contact, { ...withContact(null, 'profiles').contact, rail, wheel });
  assert.deepEqual(withContact(back, 'radii').contact, withContact(null, 'radii').contact);
});

test('values of a case are told in the words and units of the form, a section as one, and what has no words by its pointer', () => {
  const document = JSON.parse(readFileSync(new URL('wheel-rail.case.json', EXAMPLES), 'utf8'));
  const told = (/** @type {string} */ pointer) => `${wordsOf(pointer).label}: ${valueInWords(document, wordsOf(pointer).pointer)}`;
  assert.equal(told('/load/vertical_force_n'), 'wheel load Q: 75 kN');
  assert.equal(told('/motion/wheelset/speed_mm_per_s'), 'speed: 72 km/h');
  assert.equal(told('/contact/cant_rad'), 'rail inclination: 1:40');
  assert.equal(told('/contact/rail/points_mm'), 'rail: 83 points');
  assert.equal(told('/contact/wheel/text'), 'wheel: columns, 206 lines');
  assert.equal(told('/contact/wheel/smoothing_mm'), 'wheel: smoothing: –');
  assert.deepEqual(wordsOf('/solver/mesh'), { pointer: '/solver/mesh', label: '/solver/mesh', known: false });
});
