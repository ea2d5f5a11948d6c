//! The gap of one patch in its own frame: the wheel as surface of revolution over the rail as cylinder.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::surface_exit::{SurfaceExit, SurfaceMissed};
use crate::contact::geometry::wheel_rail::WheelRail;

/// How closely a gap is sampled: along x, where it is as smooth as the wheel is round, less closely than across, where it has the detail
/// of the profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Enough for the force at a height of the wheel, to some tenths of a per cent.
    Coarse,
    /// Enough for the answer.
    Fine,
}

impl Detail {
    /// Samples along and across.
    fn samples(self) -> [usize; 2] {
        match self {
            Detail::Coarse => [17, 81],
            Detail::Fine => [17, 161],
        }
    }
}

/// Spacing along the rail's curve, in mm.
const CURVE_STEP: f64 = 0.1;
/// The rail belongs to a patch as far as the component of its tangent along the plane of the frame is at least this.
const TANGENT_MIN: f64 = 0.1;

/// Where a surface has no point, it is taken to be this much farther away than at the neighbouring place, in mm.
const OPEN: f64 = 1.0;

/// The gap of one patch at one height of the wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalGap {
    /// Frame in which the gap is given.
    pub frame: Frame,
    /// Coordinates along x in mm, from the frame's origin.
    pub x: Vec<f64>,
    /// Coordinates across in mm.
    pub y: Vec<f64>,
    /// Distance of the surfaces along the frame's normal in mm, negative where they overlap; `[j][i]` at `(x[i], y[j])`.
    pub gap: Vec<Vec<f64>>,
    /// Samples over which the wheel's surface was not found although its profile goes on; the gap opens there.
    pub missed: Vec<[f64; 2]>,
    /// Lines across, lower and upper, beyond which the surfaces were bent apart: what touches there belongs to other gaps.
    pub limits: [Option<f64>; 2],
}

impl LocalGap {
    /// The gap over the window `[[x_min, x_max], [y_min, y_max]]` in mm of a frame, with the wheel's centre at the height
    /// `centre`.
    ///
    /// # Errors
    /// A sentence, if the rail bends away from the plane of the frame within the window.
    pub(crate) fn new(
        geometry: &WheelRail,
        frame: Frame,
        centre: f64,
        window: [[f64; 2]; 2],
        detail: Detail,
    ) -> Result<LocalGap, String> {
        let rail = RailInFrame::new(geometry, &frame);
        let [columns, rows] = detail.samples();
        let [x, y] = [(window[0], columns), (window[1], rows)].map(|([low, high], count)| {
            // Measured from the middle, so that a symmetric window has symmetric coordinates.
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let at = |k: usize| (2.0 * k as f64 - (count - 1) as f64) / (count - 1) as f64;
            (0..count)
                .map(|k| middle + half * at(k))
                .collect::<Vec<f64>>()
        });
        let y: Vec<f64> = y.into_iter().filter(|v| rail.reaches(*v)).collect();
        let heights: Vec<f64> = y.iter().map(|v| rail.height(*v)[0]).collect();
        if y.len() < rows / 2 {
            return Err(format!(
                "the patch at y = {:.2} mm on the rail bends too much for a plane of contact",
                geometry.on_rail(frame.rail)[0]
            ));
        }
        let (wheel, missed) = WheelInFrame {
            geometry,
            frame: &frame,
            centre,
        }
        .heights(&x, &y);
        let gap = wheel
            .into_iter()
            .zip(&heights)
            .map(|(row, height)| row.into_iter().map(|wheel| wheel - height).collect())
            .collect();
        Ok(LocalGap {
            frame,
            x,
            y,
            gap,
            missed,
            limits: [None; 2],
        })
    }

    /// Do the bodies still overlap at the ends of the window along x, and at those across?
    pub(crate) fn overlaps_at_ends(&self) -> [bool; 2] {
        let [last_x, last_y] = [self.x.len() - 1, self.y.len() - 1];
        let overlaps = |row: &Vec<f64>| row.iter().any(|height| *height < 0.0);
        [
            self.gap.iter().any(|row| row[0] < 0.0 || row[last_x] < 0.0),
            overlaps(&self.gap[0]) || overlaps(&self.gap[last_y]),
        ]
    }
}

/// Indices from the one after the middle to the last, and from the one before it to the first.
fn outward(middle: usize, count: usize) -> (Vec<usize>, Vec<usize>) {
    ((middle + 1..count).collect(), (0..middle).rev().collect())
}

/// The rail's curve over the plane of a frame, as far as it is a function there.
struct RailInFrame<'g> {
    geometry: &'g WheelRail,
    frame: &'g Frame,
    /// `[v, parameter]` by increasing v.
    samples: Vec<[f64; 2]>,
}

impl<'g> RailInFrame<'g> {
    fn new(geometry: &'g WheelRail, frame: &'g Frame) -> Self {
        let mut rail = RailInFrame {
            geometry,
            frame,
            samples: Vec::new(),
        };
        let parameters = geometry.parameters(CURVE_STEP)[0].clone();
        let middle = parameters
            .partition_point(|s| *s < frame.rail)
            .min(parameters.len() - 1);
        let [tangent, _] = frame.axes();
        let sign = geometry.placement.side.sign();
        let along = |s: f64| {
            let place = geometry.rail_at(s).tangent();
            sign * (place[0] * tangent[0] + place[1] * tangent[1])
        };
        let keeps = |k: &usize| along(parameters[*k]) > TANGENT_MIN;
        let (after, before) = outward(middle, parameters.len());
        let before = before
            .into_iter()
            .take_while(keeps)
            .collect::<Vec<_>>()
            .into_iter()
            .rev();
        let chosen = before
            .chain([middle])
            .chain(after.into_iter().take_while(keeps));
        rail.samples = chosen
            .map(|k| [rail.local(parameters[k])[0], parameters[k]])
            .collect();
        if sign < 0.0 {
            rail.samples.reverse();
        }
        rail
    }

    /// Coordinates `[v, w]` in the frame of a point of the curve.
    fn local(&self, s: f64) -> [f64; 2] {
        self.frame.across(self.geometry, s)
    }

    fn reaches(&self, v: f64) -> bool {
        self.samples.len() > 1
            && self.samples[0][0] <= v
            && v <= self.samples[self.samples.len() - 1][0]
    }

    /// The place over v, where the rail reaches that far.
    fn over(&self, [u, v]: [f64; 2]) -> Result<[f64; 2], SurfaceMissed> {
        if self.reaches(v) {
            return Ok(self.height(v));
        }
        Err(SurfaceMissed {
            at: [u, v],
            exit: SurfaceExit::RailTurnsAway,
        })
    }

    /// Height over the plane at v, which the rail reaches, and the parameter there, by bracketed secant steps along the curve with a halving
    /// after every second one. v increases along the chosen part of the curve, so that the bracket of 0.1 mm holds one place and is narrower
    /// than the tolerance before the steps are used up. The values at both ends of the bracket are known from the samples, so that no slope
    /// is needed as in `numerics::monotone_root`.
    fn height(&self, v: f64) -> [f64; 2] {
        const STEPS: u32 = 120;
        let k = self
            .samples
            .partition_point(|sample| sample[0] < v)
            .clamp(1, self.samples.len() - 1);
        let [mut low, mut high] = [self.samples[k - 1], self.samples[k]];
        let mut found = [0.0; 2];
        for step in 0..STEPS {
            let t = if step % 3 == 2 {
                0.5
            } else {
                ((v - low[0]) / (high[0] - low[0])).clamp(0.0, 1.0)
            };
            let s = low[1] + t * (high[1] - low[1]);
            let at = self.local(s);
            found = [at[1], s];
            if (at[0] - v).abs() < 1e-11 {
                break;
            }
            if at[0] < v {
                low = [at[0], s];
            } else {
                high = [at[0], s];
            }
        }
        found
    }
}

/// The wheel's surface over the plane of a frame.
struct WheelInFrame<'g> {
    geometry: &'g WheelRail,
    frame: &'g Frame,
    /// Height of the wheel's centre in the track.
    centre: f64,
}

#[derive(Clone, Copy)]
struct Guess {
    height: f64,
    wheel: f64,
}

impl Guess {
    /// The next of a row that continues in a straight line from `before` over this one.
    fn beyond(self, before: Guess) -> Guess {
        Guess {
            height: 2.0 * self.height - before.height,
            wheel: 2.0 * self.wheel - before.wheel,
        }
    }
}

impl WheelInFrame<'_> {
    /// Height of the wheel's surface over the plane of the frame, outward from the middle, and the places where it was not found
    /// although the profile goes on. Where there is no point of the wheel, the surface opens from the last one found.
    fn heights(&self, x: &[f64], y: &[f64]) -> (Vec<Vec<f64>>, Vec<[f64; 2]>) {
        let nearest = |axis: &[f64]| axis.partition_point(|at| *at < 0.0).min(axis.len() - 1);
        let middle = [nearest(x), nearest(y)];
        // With an odd number of columns over a symmetric window the middle one is x = 0, and both halves are alike; without
        // yaw they are mirror images.
        let images = x.iter().zip(x.iter().rev()).all(|(a, b)| *a == -b);
        let mirrored = images && self.geometry.axle()[0] == 0.0 && self.frame.origin[0] == 0.0;
        let mut rows = vec![vec![f64::NAN; x.len()]; y.len()];
        let mut missed = Vec::new();
        let mut found_or_open = |at: [f64; 2], start: Guess| -> Guess {
            self.height(at[0], at[1], start).unwrap_or_else(|miss| {
                if miss.exit == SurfaceExit::StepsUsedUp {
                    missed.push(at);
                }
                Guess {
                    height: start.height + OPEN,
                    wheel: start.wheel,
                }
            })
        };
        let mut fill = |j: usize, start: Guess| -> Guess {
            let first = found_or_open([x[middle[0]], y[j]], start);
            rows[j][middle[0]] = first.height;
            let (right, left) = outward(middle[0], x.len());
            let sides = [right, if mirrored { Vec::new() } else { left }];
            for columns in sides {
                let (mut before, mut guess) = (first, first);
                for i in columns {
                    let found = found_or_open([x[i], y[j]], guess);
                    rows[j][i] = found.height;
                    if mirrored {
                        rows[j][x.len() - 1 - i] = found.height;
                    }
                    // The surface is continued in a straight line.
                    (before, guess) = (found, found.beyond(before));
                }
            }
            first
        };
        let start = fill(
            middle[1],
            Guess {
                height: 0.0,
                wheel: self.frame.wheel,
            },
        );
        let (up, down) = outward(middle[1], y.len());
        for order in [up, down] {
            let (mut before, mut guess) = (start, start);
            for j in order {
                let found = fill(j, guess);
                (before, guess) = (found, found.beyond(before));
            }
        }
        (rows, missed)
    }

    /// Where the normal through (u, v) meets the wheel, by Newton's method in the height and the parameter of the
    /// wheel's curve.
    fn height(&self, u: f64, v: f64, start: Guess) -> Result<Guess, SurfaceMissed> {
        const STEP_MAX: f64 = 1.0;
        const STEP_LAST: f64 = 1e-6;
        let [tangent, normal] = self.frame.axes();
        let axle = self.geometry.axle();
        let shift = self.geometry.placement.lateral_shift;
        let base = [
            self.frame.origin[0] + u,
            self.frame.origin[1] + v * tangent[0] - shift,
            self.frame.origin[2] + v * tangent[1] - self.centre,
        ];
        let normal = [0.0, normal[0], normal[1]];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let rise_along = dot(normal, axle);
        let mut guess = start;
        for _ in 0..30 {
            let point = [0, 1, 2].map(|k| base[k] + guess.height * normal[k]);
            let along = dot(point, axle);
            let radial = [0, 1, 2].map(|k| point[k] - along * axle[k]);
            let radius = dot(radial, radial).sqrt();
            let rise_radius = dot(normal, radial) / radius;
            let circle = self.geometry.meridian(guess.wheel);
            let (miss_along, miss_radius) = (along - circle.along, radius - circle.radius);
            let determinant = -rise_along * circle.radius_slope + circle.along_slope * rise_radius;
            let height = (-miss_radius * circle.along_slope + miss_along * circle.radius_slope)
                / determinant;
            let wheel = (miss_along * rise_radius - miss_radius * rise_along) / determinant;
            guess.height += height.clamp(-STEP_MAX, STEP_MAX);
            guess.wheel += wheel.clamp(-STEP_MAX, STEP_MAX);
            // The error falls with the square of the step.
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
}

impl WheelInFrame<'_> {
    /// The same from the origin of the frame, in steps that Newton's method can follow.
    fn height_from_origin(&self, [u, v]: [f64; 2]) -> Result<Guess, SurfaceMissed> {
        /// Length of a step in mm; the sides of the windows, where rows follow each other like this, are as long.
        const STRIDE: f64 = 2.0;
        let mut before = Guess {
            height: 0.0,
            wheel: self.frame.wheel,
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

impl WheelRail {
    /// A frame of the same directions with its origin on the rail's surface over the point `by` of the plane, `[x, y]` in
    /// mm, with the wheel's centre at the height `centre`.
    ///
    /// # Errors
    /// Rail or wheel have no point there, or none was found.
    pub fn moved(&self, frame: &Frame, by: [f64; 2], centre: f64) -> Result<Frame, SurfaceMissed> {
        let [u, v] = by;
        let [tangent, normal] = frame.axes();
        let [height, rail] = RailInFrame::new(self, frame).over(by)?;
        let surface = WheelInFrame {
            geometry: self,
            frame,
            centre,
        };
        Ok(Frame {
            origin: [
                frame.origin[0] + u,
                frame.origin[1] + v * tangent[0] + height * normal[0],
                frame.origin[2] + v * tangent[1] + height * normal[1],
            ],
            angle: frame.angle,
            rail,
            wheel: surface.height_from_origin([u, v])?.wheel,
        })
    }

    /// Parameter of the rail's curve over the place `y` in mm across the plane of a frame.
    ///
    /// # Errors
    /// The rail ends or turns away from the plane before.
    pub fn rail_over(&self, frame: &Frame, y: f64) -> Result<f64, SurfaceMissed> {
        let [_, rail] = RailInFrame::new(self, frame).over([0.0, y])?;
        Ok(rail)
    }

    /// Overlap in mm of the undeformed bodies along the normal at the origin of a frame, with the wheel's centre at the
    /// height `centre`; negative where there is a gap.
    ///
    /// # Errors
    /// The wheel has no point there, or none was found.
    pub fn overlap(&self, frame: &Frame, centre: f64) -> Result<f64, SurfaceMissed> {
        let surface = WheelInFrame {
            geometry: self,
            frame,
            centre,
        };
        Ok(-surface.height_from_origin([0.0; 2])?.height)
    }
}
