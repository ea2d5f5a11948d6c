//! A cell that is a rectangle with constant loads: of strips that cross their patch several times, whose outline is not followed.

use crate::contact::half_space::point_loads::{LANES, LoadPack};
use crate::contact::mesh::chord::Chord;
use crate::contact::numerics::quadrature::RULES;
use crate::contact::post::subsurface::load_parts::LoadPart;
use crate::contact::post::subsurface::seen_parts::PartBox;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::strip_mesh::StripMesh;

/// The loads on a rectangle.
#[derive(Debug)]
pub(crate) struct LoadedCell {
    /// `[from, to]` along and across, in mm.
    sides: [[f64; 2]; 2],
    /// Along, across and into the body, in MPa.
    loads: [f64; 3],
}

impl LoadedCell {
    /// The cell `i` of a strip, with the traction of an answer, which is in `unit` MPa.
    pub(crate) fn new(
        level: &StripMesh,
        answer: &LevelAnswer,
        unit: f64,
        (chord, i): (&Chord, usize),
    ) -> LoadedCell {
        let [along, across] = [0, 1].map(|k| unit * answer.traction[k][i]);
        let half = 0.5 * chord.dy;
        LoadedCell {
            sides: [
                [level.mesh.left[i], level.mesh.right[i]],
                [chord.y - half, chord.y + half],
            ],
            loads: [along, across, level.pressure[i]],
        }
    }

    fn side(&self, part: &LoadPart, axis: usize, inside: f64) -> f64 {
        let [from, to] = self.sides[axis];
        let piece = [part.along, part.across][axis];
        from + (to - from) * piece.share(inside)
    }

    /// How large a part is, in mm from `origin`.
    pub(crate) fn seen(&self, part: &LoadPart, origin: [f64; 2]) -> PartBox {
        let [x, y] =
            [0, 1].map(|axis| [0.0, 1.0].map(|end| self.side(part, axis, end) - origin[axis]));
        PartBox {
            sides: [x[0], x[1], y[0], y[1]].map(|side| side as f32),
            squares: [x, y].map(|[from, to]| ((to - from) * (to - from)) as f32),
        }
    }

    /// Appends what a part carries as point loads, for rules along and across; x and y count from `origin`.
    pub(crate) fn quadrature(
        &self,
        part: &LoadPart,
        [along_rule, across_rule]: [usize; 2],
        origin: [f64; 2],
        to: &mut Vec<LoadPack>,
    ) {
        let [x, y] = [0, 1].map(|axis| [0.0, 1.0].map(|end| self.side(part, axis, end)));
        let quarter = 0.25 * (x[1] - x[0]) * (y[1] - y[0]);
        let first = to.len();
        let count = RULES[along_rule].len() * RULES[across_rule].len();
        to.resize(first + count.div_ceil(LANES), LoadPack::default());
        let mut number = 0;
        for (at_y, weight_y) in RULES[across_rule] {
            for (at_x, weight_x) in RULES[along_rule] {
                let area = quarter * weight_x * weight_y;
                let (pack, lane) = (&mut to[first + number / LANES], number % LANES);
                for (axis, ([from, to], at)) in [(x, at_x), (y, at_y)].into_iter().enumerate() {
                    let place = from + 0.5 * (1.0 + at) * (to - from);
                    pack.at[axis][lane] = (place - origin[axis]) as f32;
                }
                for (force, load) in pack.force.iter_mut().zip(self.loads) {
                    force[lane] = (load * area) as f32;
                }
                number += 1;
            }
        }
    }
}
