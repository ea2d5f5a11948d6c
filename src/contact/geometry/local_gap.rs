//! The gap of one patch in its own frame: the wheel as surface of revolution over the rail as cylinder.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::frame::SurfaceMissed;
use crate::contact::geometry::rail_in_frame::RailInFrame;
use crate::contact::geometry::wheel_in_frame::WheelInFrame;
use crate::contact::geometry::wheel_rail::WheelRail;

/// How closely a gap is sampled: along x, where it is as smooth as the wheel is round, less closely than across, where it has the detail
/// of the profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GapSampling {
    /// Enough for the force at a height of the wheel, to some tenths of a per cent.
    Coarse,
    /// Enough for the answer at a loose target, unless the profiles have so many points there that more samples are needed to see them all.
    Loose,
    /// Enough for the answer.
    Fine,
}

/// From this target of the resultants' error, relative to μN, on gaps are sampled as [`GapSampling::Loose`]. On 1000 rows of
/// `cargo bench --bench wheels -- rows` forces differ from those of fine samples by 0.00001 of μN in the median, 0.0013 in one of a hundred and
/// 0.007 at most.
const LOOSE_FROM: f64 = 0.01;

/// Most points of one profile in a window that is sampled as [`GapSampling::Loose`]: two samples a point. Chosen by judgement; how
/// much it matters was not measured.
const POINTS_LOOSE: usize = 40;

impl GapSampling {
    /// For an answer with a target of the resultants' error, relative to μN; infinite where there is none.
    pub(crate) fn for_answer(target: f64) -> GapSampling {
        if target.is_finite() && target >= LOOSE_FROM {
            GapSampling::Loose
        } else {
            GapSampling::Fine
        }
    }

    /// Is it enough for an answer?
    pub(crate) fn is_for_answer(self) -> bool {
        self != GapSampling::Coarse
    }

    /// Samples along and across a window over which the profiles have so many points.
    fn samples(self, points: usize) -> [usize; 2] {
        match self {
            GapSampling::Loose if points > POINTS_LOOSE => GapSampling::Fine.samples(points),
            GapSampling::Coarse | GapSampling::Loose => [9, 81],
            GapSampling::Fine => [9, 161],
        }
    }
}

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
        detail: GapSampling,
    ) -> Result<LocalGap, String> {
        let [columns, rows] = detail.samples(points_within(geometry, &frame, window[1]));
        let [x, y] = [(window[0], columns), (window[1], rows)].map(|([low, high], count)| {
            // Measured from the middle, so that a symmetric window has symmetric coordinates.
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let at = |k: usize| (2.0 * k as f64 - (count - 1) as f64) / (count - 1) as f64;
            (0..count)
                .map(|k| middle + half * at(k))
                .collect::<Vec<f64>>()
        });
        let rail = RailInFrame::new(geometry, &frame);
        let (y, heights) = rail.heights(&y);
        if y.len() < rows / 2 {
            return Err(match rail.end_within(window[1]) {
                Some(end) => geometry.cut_off([end, frame.wheel]),
                None => format!(
                    "the patch at y = {:.2} mm on the rail bends too much for a plane of contact",
                    geometry.on_rail(frame.rail)[0]
                ),
            });
        }
        let (wheel, missed) = WheelInFrame::new(geometry, &frame, centre).heights(&x, &y);
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

/// Most points of one of the profiles about a frame's origin, as far as the farther end of a range across.
fn points_within(geometry: &WheelRail, frame: &Frame, [low, high]: [f64; 2]) -> usize {
    let reach = low.abs().max(high.abs());
    let [rail, wheel] = geometry.profiles();
    let points = [(rail, frame.rail), (wheel, frame.wheel)].map(|(profile, at)| {
        let [first, last] = profile.points().numbers([at - reach, at + reach]);
        last - first
    });
    points[0].max(points[1])
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
        let surface = WheelInFrame::new(self, frame, centre);
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
        let surface = WheelInFrame::new(self, frame, centre);
        Ok(-surface.height_from_origin([0.0; 2])?.height)
    }
}
