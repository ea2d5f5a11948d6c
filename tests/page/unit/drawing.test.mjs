// Tests computations for drawings, the parsing of files, and the order of members in a case.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { acrossSection, gapOf, unfolded } from '../../../src/http/page/web/js/placing.js';
import { inOrder, isSolvedBent } from '../../../src/http/page/web/js/starts.js';
import { bodiesOf, decoded, profileKind } from '../../../src/http/page/web/js/files.js';
import { parseGapCurve, parseGrid } from '../../../src/http/page/web/js/tables.js';

test('the gap is the vertical distance of the lower side of the wheel from the upper side of the rail', () => {
  /** @type {[number, number][]} */
  const rail = [[-5, -10], [-5, 0], [5, 0], [5, -10]];
  // The flange of the wheel hangs beside the rail, and its tread rises to the left.
  /** @type {[number, number][]} */
  const wheel = [[-8, 2], [-7, -6], [-6, 1], [6, 4]];
  const gap = gapOf(rail, wheel);
  assert.ok(gap.every(([y]) => y >= -5 && y <= 5));
  for (const [y, distance] of gap) assert.ok(Math.abs(distance - (1 + (y + 6) / 4)) < 1e-9, `${y}: ${distance}`);
  assert.equal(gap.length, 51);
});

test('files of gaps and grids are read whatever separates their numbers', () => {
  assert.deepEqual(parseGapCurve('# y gap\n3; 0.2\n-3\t0.1\n0, 0\n'), { y_mm: [-3, 0, 3], gap_mm: [0.1, 0, 0.2] });
  assert.deepEqual(parseGapCurve('3;0,2\r-3;0,1\r0;0,0'), { y_mm: [-3, 0, 3], gap_mm: [0.1, 0, 0.2] });
  assert.equal(parseGapCurve('1\n2\n3'), null);
  const grid = parseGrid(',1,2,3\n20, 4,5,6\n10, 7,8,9\n');
  assert.deepEqual(grid, { x_mm: [1, 2, 3], y_mm: [10, 20], values: [[7, 8, 9], [4, 5, 6]] });
  assert.deepEqual(parseGrid('0 1 2\n10 7 8\n20 9 1')?.x_mm, [1, 2]);
  assert.equal(parseGrid('0 1 2\n10 7 8\n20 9'), null);
});

test('contents and name of a file tell its format and body', () => {
  /** @param {string} name */
  const kind = (name, text = '1 2\n3 4') => profileKind({ name, text });
  assert.deepEqual(kind('worn.BAN'), { format: 'miniprof', contents: null, named: 'rail' });
  assert.deepEqual(kind('left.whl'), { format: 'miniprof', contents: null, named: 'wheel' });
  assert.deepEqual(kind('a.prw'), { format: 'simpack', contents: null, named: 'wheel' });
  assert.deepEqual(kind('my-rail.csv'), { format: 'columns', contents: null, named: 'rail' });
  assert.deepEqual(kind('x.txt'), { format: 'columns', contents: null, named: null });
  assert.deepEqual(kind('x.txt', 'Date=1\nXYPoints=2\nColumnDef=X,Y\n\n1 2\n3 4'), { format: 'miniprof', contents: null, named: null });
  assert.deepEqual(kind('x.dat', '#MINIWHEELPROF\nMINIPROF 2020\n\n1 2'), { format: 'miniprof', contents: 'wheel', named: null });
  assert.deepEqual(kind('x.dat', '! a\nheader.begin\n type = 1\nheader.end\nspline.begin\n type = 0\n'), { format: 'simpack', contents: 'wheel', named: null });
  assert.deepEqual(kind('x.prr', 'HEADER.BEGIN\n TYPE = 0\nHEADER.END\nSPLINE.BEGIN'), { format: 'simpack', contents: 'rail', named: 'rail' });
});

test('two files always become both bodies, and contents decide before names', () => {
  /** @param {string} name @param {'rail' | 'wheel' | null} [contents] By the shape. */
  const file = (name, contents = null) => ({ name, text: name, contents });
  /** @param {ReturnType<typeof file>[]} files @param {('rail' | 'wheel')[]} missing @param {'rail' | 'wheel'} [onto] */
  const bodies = (files, missing, onto) => bodiesOf(files, files.map(({ name, text, contents }) => ({ ...profileKind({ name, text }), contents })), missing, onto);
  const [rail, wheel] = [file('a.ban'), file('b.whl')];
  const [one, two] = [file('SUIC519A.dat'), file('RUIC519A.dat')];
  const [misnamed, shaped] = [file('wheel.csv', 'rail'), file('c.dat', 'wheel')];
  for (const missing of [[], ['rail'], ['wheel'], ['rail', 'wheel']]) {
    const given = /** @type {('rail' | 'wheel')[]} */ (missing);
    assert.deepEqual(bodies([rail, wheel], given), { rail, wheel });
    assert.deepEqual(bodies([wheel, rail], given), { rail, wheel });
    assert.deepEqual(bodies([one, two], given), { rail: one, wheel: two });
    assert.deepEqual(bodies([one, rail], given), { rail, wheel: one });
    assert.deepEqual(bodies([wheel, one], given), { rail: one, wheel });
    assert.match(String(bodies([wheel, file('c.whl')], given)), /both a wheel/);
    assert.match(String(bodies([wheel, rail, one], given)), /3 files/);
    assert.deepEqual(bodies([wheel], given), { wheel });
    assert.deepEqual(bodies([wheel], given, 'rail'), { wheel });
    assert.deepEqual(bodies([one], given, 'rail'), { rail: one });
    assert.deepEqual(bodies([misnamed], given, 'wheel'), { rail: misnamed });
    assert.deepEqual(bodies([wheel, misnamed], given), { rail: misnamed, wheel });
    assert.deepEqual(bodies([misnamed, rail], given), { rail: misnamed, wheel: rail });
    assert.deepEqual(bodies([shaped, misnamed], given), { rail: misnamed, wheel: shaped });
    assert.match(String(bodies([misnamed, file('rail.csv', 'rail')], given)), /both a rail/);
  }
  assert.match(String(bodies([one], [])), /SUIC519A.dat does not show/);
  assert.deepEqual(bodies([one], ['wheel']), { wheel: one });
});

test('files are read in the encodings of instruments and office programs', () => {
  const text = 'Größe 1;2';
  /** @param {number[]} bytes */
  const of = (bytes) => decoded(new Uint8Array(bytes).buffer);
  const units = [...text].map((c) => c.charCodeAt(0));
  const little = units.flatMap((unit) => [unit & 255, unit >> 8]);
  const big = units.flatMap((unit) => [unit >> 8, unit & 255]);
  assert.equal(of([...new TextEncoder().encode(text)]), text);
  assert.equal(of([0xef, 0xbb, 0xbf, ...new TextEncoder().encode(text)]), text);
  assert.equal(of(units), text, 'latin1');
  assert.equal(of([0xff, 0xfe, ...little]), text);
  assert.equal(of([0xfe, 0xff, ...big]), text);
  assert.equal(of(little), text);
  assert.equal(of(big), text);
  assert.equal(of([]), '');
});

test('a case is written in the order that a person would choose, and loses nothing', () => {
  const document = { outputs: [], contact: { lateral_mm: 1, type: 'radii' }, extra: 1, name: 'x', motion: {} };
  const ordered = inOrder(document);
  assert.deepEqual(Object.keys(ordered), ['name', 'contact', 'motion', 'outputs', 'extra']);
  assert.deepEqual(Object.keys(/** @type {object} */ (ordered.contact)), ['type', 'lateral_mm']);
  assert.deepEqual(ordered, document);
});

test('places over an arc are found from the arc length, whichever way its points run', () => {
  /** @type {[number, number][]} */
  const arc = Array.from({ length: 401 }, (_, at) => [10 * Math.sin(-1 + at / 200), 10 * Math.cos(-1 + at / 200)]);
  for (const line of [arc, [...arc].reverse()]) {
    const on = unfolded(line, [10 * Math.sin(0.3), 10 * Math.cos(0.3)]);
    for (const [s, height] of [[0, 0], [3, 0], [-5, 2]]) {
      const [y, z] = on(s, height);
      const angle = 0.3 + s / 10;
      assert.ok(Math.hypot(y - (10 + height) * Math.sin(angle), z - (10 + height) * Math.cos(angle)) < 0.01, `${s}, ${height}: ${y}, ${z}`);
    }
  }
});

test('wear on the curve of the rail lies where the arc length leads, on planes along the plane', () => {
  // A gauge corner: an arc of 13 mm radius about (-717, -14), from the top to 80° down toward the track centre.
  const rail = Array.from({ length: 161 }, (_, i) => (i / 2 / 180) * Math.PI).map((angle) => /** @type {[number, number]} */ ([-717 + 13 * Math.sin(angle), -14 + 13 * Math.cos(angle)])).reverse();
  const at = Math.PI / 6;
  const [y, z] = [-717 + 13 * Math.sin(at), -14 + 13 * Math.cos(at)];
  const position = { origin_track_mm: [0, y, z], track_mm: [0, y, z], contact_angle_rad: -at, rail_mm: [-30, 5], wheel_mm: [-35, 7], rolling_radius_mm: 465 };
  const patch = /** @type {import('../../../src/http/page/web/js/api.js').Patch} */ (/** @type {unknown} */ ({ position }));
  const standing = /** @type {import('../../../src/http/page/web/js/result.js').Standing} */ (/** @type {unknown} */ ({ placed: { rail }, cant: 0 }));
  // On the right rail, left is toward the track centre and away from the field side.
  const bent = acrossSection(patch, 'rail', 'right', standing, true);
  for (const s of [-4, 0, 4]) assert.ok(Math.abs(bent(s) - (-30 - 13 * (Math.sin(at + s / 13) - Math.sin(at)))) < 0.01, `${s}: ${bent(s)}`);
  assert.ok(Math.abs(acrossSection(patch, 'wheel', 'right', standing, true)(4) - (bent(4) - 5)) < 1e-9);
  assert.ok(Math.abs(acrossSection(patch, 'rail', 'right', standing, false)(4) - (-30 - 4 * Math.cos(at))) < 1e-9);
});

test('a remark on planes is on the patches of one wheel of a wheelset, or on all', () => {
  const document = { contact: { type: 'wheelset' } };
  const wheel = (/** @type {number[]} */ ...patches) => ({ patches });
  const positions = [{ left: wheel(0, 1), right: wheel(2) }, { left: wheel(3), right: wheel(4) }];
  const result = (/** @type {number | undefined} */ patch) => /** @type {import('../../../src/http/page/web/js/api.js').JobResult} */ (/** @type {unknown} */ ({ wheelset: { positions }, remarks: [{ code: 'on-planes', patch }] }));
  const bent = (/** @type {number | undefined} */ patch) => [0, 1, 2, 3, 4].filter((at) => isSolvedBent(document, result(patch), at));
  assert.deepEqual(bent(0), [2, 3, 4]);
  assert.deepEqual(bent(undefined), []);
  assert.equal(isSolvedBent({ contact: { type: 'profiles', reference_surface: 'plane' } }, result(0), 3), false);
});
