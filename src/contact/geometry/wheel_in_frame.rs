//! The wheel over the plane of a frame: a surface of revolution, seen along the normal.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::frame::{SurfaceExit, SurfaceMissed};
use crate::contact::geometry::wheel_rail::WheelRail;

/// Where a surface has no point, it is taken to be this much farther away than at the neighbouring place, in mm.
const OPEN: f64 = 1.0;

/// Indices from the one after the middle to the last, and from the one before it to the first.
fn outward(middle: usize, count: usize) -> (Vec<usize>, Vec<usize>) {
    ((middle + 1..count).collect(), (0..middle).rev().collect())
}

/// The wheel's surface over the plane of a frame, its centre at a height. A point at the height h over the place (u, v) is
/// `p = origin + u x + v t + h n` from the wheel's centre, with the frame's tangent t and normal n; both its place along the axle and the
/// square of its length are polynomials in u, v and h.
pub(crate) struct WheelInFrame<'g> {
    geometry: &'g WheelRail,
    /// Parameter of the wheel's curve over the origin of the frame.
    wheel: f64,
    mirrored: bool,
    /// Products of the frame's origin with the axle, x, tangent, normal and itself.
    origin: OriginProducts,
    /// Products of x, tangent and normal with the axle.
    axle: [f64; 3],
}

struct OriginProducts {
    axle: f64,
    x: f64,
    tangent: f64,
    normal: f64,
    itself: f64,
}

/// A point of the wheel: height over the plane, and parameter of the wheel's curve.
#[derive(Clone, Copy)]
pub(crate) struct WheelPoint {
    pub(crate) height: f64,
    pub(crate) wheel: f64,
}

impl WheelPoint {
    /// The next of a row that continues in a straight line from `before` over this one.
    fn beyond(self, before: WheelPoint) -> WheelPoint {
        WheelPoint {
            height: 2.0 * self.height - before.height,
            wheel: 2.0 * self.wheel - before.wheel,
        }
    }

    /// The point in the air that stands for one that was not found from here.
    fn opened(self) -> WheelPoint {
        WheelPoint {
            height: self.height + OPEN,
            ..self
        }
    }

    /// The next of a row that continues as the row beside it does between two points. Rows lie so close together that one step of
    /// Newton's method is enough from there; from a straight line, two or three are needed.
    fn as_between(self, from: WheelPoint, to: WheelPoint) -> WheelPoint {
        WheelPoint {
            height: self.height + (to.height - from.height),
            wheel: self.wheel + (to.wheel - from.wheel),
        }
    }
}

impl<'g> WheelInFrame<'g> {
    pub(crate) fn new(geometry: &'g WheelRail, frame: &Frame, centre: f64) -> Self {
        let [tangent, normal] = frame.axes().map(|[y, z]| [0.0, y, z]);
        let axle = geometry.axle();
        let origin = [
            frame.origin[0],
            frame.origin[1] - geometry.placement.lateral_shift,
            frame.origin[2] - centre,
        ];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        WheelInFrame {
            geometry,
            wheel: frame.wheel,
            mirrored: axle[0] == 0.0 && frame.origin[0] == 0.0,
            origin: OriginProducts {
                axle: dot(origin, axle),
                x: origin[0],
                tangent: dot(origin, tangent),
                normal: dot(origin, normal),
                itself: dot(origin, origin),
            },
            axle: [axle[0], dot(tangent, axle), dot(normal, axle)],
        }
    }

    /// Height of the wheel's surface over the plane of the frame, outward from the middle, and the places where it was not found
    /// although the profile goes on. Where there is no point of the wheel, the surface opens from the last one found.
    pub(crate) fn heights(&self, x: &[f64], y: &[f64]) -> (Vec<Vec<f64>>, Vec<[f64; 2]>) {
        let nearest = |axis: &[f64]| axis.partition_point(|at| *at < 0.0).min(axis.len() - 1);
        let middle = [nearest(x), nearest(y)];
        // With an odd number of columns over a symmetric window the middle one is x = 0, and both halves are alike; without
        // yaw they are mirror images.
        let images = x.iter().zip(x.iter().rev()).all(|(a, b)| *a == -b);
        let mirrored = images && self.mirrored;
        let mut rows = vec![vec![f64::NAN; x.len()]; y.len()];
        let mut missed = Vec::new();
        let mut found_or_open = |at: [f64; 2], start: WheelPoint| -> (WheelPoint, bool) {
            match self.height(at[0], at[1], start) {
                Ok(found) => (found, true),
                Err(miss) => {
                    if miss.exit == SurfaceExit::StepsUsedUp {
                        missed.push(at);
                    }
                    (start.opened(), false)
                }
            }
        };
        let (right, left) = outward(middle[0], x.len());
        let sides = [right, if mirrored { Vec::new() } else { left }];
        // `row` holds what was found of the row before, then of this one.
        let mut fill =
            |j: usize, start: WheelPoint, row: &mut [Option<WheelPoint>]| -> WheelPoint {
                let (first, is_found) = found_or_open([x[middle[0]], y[j]], start);
                rows[j][middle[0]] = first.height;
                let first_before =
                    std::mem::replace(&mut row[middle[0]], is_found.then_some(first));
                for columns in &sides {
                    let (mut before, mut last) = (first, first);
                    let mut from = first_before;
                    for &i in columns {
                        let to = row[i];
                        let guess = match (from, to) {
                            (Some(from), Some(to)) => last.as_between(from, to),
                            _ => last.beyond(before),
                        };
                        let (found, is_found) = found_or_open([x[i], y[j]], guess);
                        rows[j][i] = found.height;
                        if mirrored {
                            rows[j][x.len() - 1 - i] = found.height;
                        }
                        row[i] = is_found.then_some(found);
                        (before, last, from) = (last, found, to);
                    }
                }
                first
            };
        let mut first_row = vec![None; x.len()];
        let start = WheelPoint {
            height: 0.0,
            wheel: self.wheel,
        };
        let start = fill(middle[1], start, &mut first_row);
        let (up, down) = outward(middle[1], y.len());
        for order in [up, down] {
            let (mut before, mut guess) = (start, start);
            let mut row = first_row.clone();
            for j in order {
                let found = fill(j, guess, &mut row);
                (before, guess) = (found, found.beyond(before));
            }
        }
        (rows, missed)
    }

    /// Where the normal through (u, v) meets the wheel, by Newton's method in the height and the parameter of the
    /// wheel's curve.
    fn height(&self, u: f64, v: f64, start: WheelPoint) -> Result<WheelPoint, SurfaceMissed> {
        const STEP_MAX: f64 = 1.0;
        /// The error falls with the square of the step, to about 1e-8 mm after this one. Chosen by judgement: less than a millionth of the overlap of
        /// a loaded wheel.
        const STEP_LAST: f64 = 3e-4;
        let [x_axle, tangent_axle, rise_along] = self.axle;
        let origin = &self.origin;
        let along_base = origin.axle + u * x_axle + v * tangent_axle;
        let square_base = origin.itself + 2.0 * (u * origin.x + v * origin.tangent) + u * u + v * v;
        let mut guess = start;
        for _ in 0..30 {
            let h = guess.height;
            let along = along_base + h * rise_along;
            let square = square_base + h * (2.0 * origin.normal + h);
            let radius = (square - along * along).sqrt();
            let rise_radius = (origin.normal + h - along * rise_along) / radius;
            let circle = self.geometry.meridian(guess.wheel);
            let (miss_along, miss_radius) = (along - circle.along, radius - circle.radius);
            let determinant = -rise_along * circle.radius_slope + circle.along_slope * rise_radius;
            let height = (-miss_radius * circle.along_slope + miss_along * circle.radius_slope)
                / determinant;
            let wheel = (miss_along * rise_radius - miss_radius * rise_along) / determinant;
            guess.height += height.clamp(-STEP_MAX, STEP_MAX);
            guess.wheel += wheel.clamp(-STEP_MAX, STEP_MAX);
            if height.abs() + wheel.abs() < STEP_LAST {
                return Ok(guess);
            }
        }
        let [first, last] = self.geometry.ranges()[1];
        let beyond = !(first..=last).contains(&guess.wheel);
        Err(SurfaceMissed {
            at: [u, v],
            exit: if beyond {
                SurfaceExit::BeyondProfile
            } else {
                SurfaceExit::StepsUsedUp
            },
        })
    }

    /// The same from the origin of the frame, in steps that Newton's method can follow.
    pub(crate) fn height_from_origin(&self, [u, v]: [f64; 2]) -> Result<WheelPoint, SurfaceMissed> {
        /// Length of a step in mm; the sides of the windows, where rows follow each other like this, are as long.
        const STRIDE: f64 = 2.0;
        let mut before = WheelPoint {
            height: 0.0,
            wheel: self.wheel,
        };
        let mut guess = before;
        let strides = (u.hypot(v) / STRIDE).ceil() as u32;
        for k in 0..strides {
            let part = f64::from(k) / f64::from(strides);
            // The surface may be missed on the way and found at the end.
            if let Ok(found) = self.height(part * u, part * v, guess) {
                guess = if k == 0 { found } else { found.beyond(before) };
                before = found;
            }
        }
        self.height(u, v, guess)
    }
}
