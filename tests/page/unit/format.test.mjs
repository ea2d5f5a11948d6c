// Tests numbers, ticks and times as text.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ago, degrees, fixed, number, seconds, tickLabel, ticks, withError } from '../../../src/http/page/web/js/format.js';
import { inclinationText, parseInclination } from '../../../src/http/page/web/js/written.js';

test('a value has the digits that its error leaves', () => {
  assert.deepEqual(withError(10.0335081, 0.127522), { value: '10.03', error: '0.13' });
  assert.deepEqual(withError(-4.3626, 0.05224), { value: '−4.363', error: '0.052' });
  assert.deepEqual(withError(12345.6, 21), { value: '12\u2009346', error: '21' });
  assert.deepEqual(withError(0.9996, 0.0095), { value: '0.9996', error: '0.0095' });
  assert.deepEqual(withError(5, 0), { value: '5.000', error: '' });
  assert.deepEqual(withError(5, null), { value: '5.000', error: '' });
});

test('a number that rounds to zero has no sign, and others a true minus', () => {
  assert.equal(fixed(-0.0001, 2), '0.00');
  assert.equal(fixed(-1.5, 1), '−1.5');
  assert.equal(fixed(NaN, 1), '–');
  assert.equal(fixed(1234567.891, 1), '1\u2009234\u2009567.9');
});

test('very large and small numbers have a power of ten', () => {
  assert.equal(number(3.2e-9, 3), '3.2·10⁻⁹');
  assert.equal(number(-1e12), '−10¹²');
  assert.equal(number(0), '0');
  assert.equal(number(undefined), '–');
});

test('ticks lie inside, at steps of 1, 2 or 5', () => {
  for (const [low, high, wanted] of [[-7.19, 7.19, 6], [0, 346.5, 4], [1e-5, 9e-5, 5], [36.2, 41.9, 7]]) {
    const all = ticks(low, high, wanted);
    assert.ok(all.length >= 2 && all.length <= 2.6 * wanted, `${all}`);
    assert.ok(all[0] >= low - 1e-9 && all[all.length - 1] <= high + 1e-9);
    const step = all[1] - all[0];
    const lead = step / 10 ** Math.floor(Math.log10(step) + 1e-9);
    assert.ok([1, 2, 5].some((factor) => Math.abs(factor - lead) < 1e-6), `${step}`);
    assert.equal(new Set(all.map((value) => tickLabel(value, all))).size, all.length);
  }
  assert.deepEqual(ticks(1, 1, 5), [1]);
});

test('a step of two and a half shows its half', () => {
  const marks = [-5, -2.5, 0, 2.5, 5];
  assert.deepEqual(marks.map((mark) => tickLabel(mark, marks)), ['−5.0', '−2.5', '0.0', '2.5', '5.0']);
  const small = [0, 0.025, 0.05];
  assert.deepEqual(small.map((mark) => tickLabel(mark, small)), ['0.000', '0.025', '0.050']);
  const whole = [0, 20, 40];
  assert.deepEqual(whole.map((mark) => tickLabel(mark, whole)), ['0', '20', '40']);
});

test('times and angles are told in units that are read', () => {
  assert.equal(seconds(0.00543), '5.43 ms');
  assert.equal(seconds(300), '5.00 min');
  assert.equal(degrees(-0.481848971752288), '−27.6°');
  const now = Date.parse('2026-02-03T12:00:00Z');
  assert.equal(ago('2026-02-03T11:59:58Z', now), 'just now');
  assert.equal(ago('2026-02-03T11:45:00Z', now), '15 min ago');
  assert.equal(ago('2026-01-01T11:45:00Z', now), '2026-01-01');
});

test('inclinations are written as ratios and read in every form', () => {
  assert.deepEqual([0.025, 0.05, -0.05, 0.03, 0, undefined].map(inclinationText), ['1:40', '1:20', '-1:20', '0.03', '0', '']);
  assert.deepEqual(['1:40', '1 / 40', '−1:20', '1:33,3', '0,025', ''].map(parseInclination), [0.025, 0.025, -0.05, 0.03003003003, 0.025, undefined]);
  assert.equal(parseInclination('much'), 'much');
});
