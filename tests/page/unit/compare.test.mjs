// Tests the mapping of a place in one patch to another patch on the same rail.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { onSameRail } from '../../../src/http/page/web/js/placing.js';

const RADIUS = 20;
/** A rail whose head is an arc about (-750, -20), in track axes. @param {number} angle From its top, to the left. @returns {[number, number]} */
const at = (angle) => [-750 + RADIUS * Math.sin(angle), -RADIUS + RADIUS * Math.cos(angle)];
const rail = Array.from({ length: 401 }, (_, step) => at(((step - 200) / 200) * 1.4));

/** A patch on that rail about an angle. @param {number} angle @param {string} surface @param {{ hand?: 'left' | 'right', x?: number }} [more] @returns {any} */
function side(angle, surface, { hand = 'right', x = 0 } = {}) {
  const turn = hand === 'left' ? -1 : 1;
  const [y, z] = at(angle);
  const place = [x, turn * y, z];
  return {
    document: { contact: { type: 'profiles', side: hand, reference_surface: surface } }, patch: 0, sections: { rail: rail.map(([py, pz]) => [turn * py, pz]) },
    result: { patches: [{ position: { origin_track_mm: place, track_mm: place, contact_angle_rad: -turn * angle } }] }, field: { cells: { y_mm: [-8, 8] } },
  };
}

test('on the curve of the rail a place keeps its distance along the rail', () => {
  const move = onSameRail(side(0.5, 'curve', { x: 1 }), side(0.3, 'curve'));
  for (const y of [-3, 0, 2.5]) {
    const found = move?.({ x: 2, y });
    assert.ok(found && Math.abs(found.y - (y + 0.2 * RADIUS)) < 0.05, `${y}: ${found?.y}`);
    assert.equal(found.x, 3);
  }
});

test('a place on a plane is found on the curve, and on the rail of the other side', () => {
  // A point 3 mm along the tangent plane at 0.3 rad is 0.2 mm away from the arc.
  const curve = onSameRail(side(0.3, 'plane'), side(0.3, 'curve'))?.({ x: 0, y: 3 });
  assert.ok(Math.abs((curve?.y ?? NaN) - RADIUS * Math.atan(3 / RADIUS)) < 0.05, `${curve?.y}`);
  const left = onSameRail(side(0.3, 'curve'), side(0.3, 'curve', { hand: 'left' }))?.({ x: 0, y: 3 });
  assert.ok(Math.abs((left?.y ?? NaN) + 3) < 0.05, `${left?.y}`);
});
