//! A wheel at one height over its rail: every gap pressed by its overlap.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::local_gap::{GapSampling, LocalGap};
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::NormalError;
use crate::contact::normal::gap::grid::GridFineness;
use crate::contact::normal::gap::patch_grid::PatchGrid;
use crate::contact::normal::gap::preview::PreviewCache;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::NormalLoad;
use crate::contact::normal::pressure_field::computed::Edges;
use crate::contact::normal::wheel_height::gap_remarks::{cut_patches, missed_beside};
use crate::contact::normal::wheel_height::task::{Accuracy, NormalPass, WheelLoad, WheelTask};
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};

/// A gap whose overlap is less than this fraction of the deepest one is left out: its force is about the power 3/2 of this, 1e-4.
const DEPTH_SHARE_MIN: f64 = 2e-3;

/// How finely the wheel is solved at one height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fineness {
    pub(crate) detail: GapSampling,
    /// Target of the resultants' error relative to μN.
    pub(crate) target: f64,
    /// Whether edges are placed: not where a height is only looked at on the way.
    pub(crate) edges: Edges,
    /// Whether each pressure is compared with that of a coarser grid.
    pub(crate) settles: bool,
}

impl Fineness {
    /// At the first height: coarse where it is not near the one sought.
    pub(crate) fn first(wanted: NormalPass, near: bool) -> Fineness {
        let mut fineness = Fineness::fine(wanted);
        if !near {
            fineness.detail = GapSampling::Coarse;
            if matches!(wanted.accuracy, Accuracy::For(_)) {
                fineness.edges = Edges::Left;
            }
        }
        fineness
    }

    /// The same with fine gaps and edges.
    pub(crate) fn finer(self) -> Fineness {
        Fineness {
            detail: GapSampling::for_answer(self.target),
            edges: Edges::Found,
            ..self
        }
    }

    fn of_grids(self) -> GridFineness {
        let whole = GridFineness::for_answer(self.target);
        match self.detail {
            GapSampling::Coarse => GridFineness::coarse(self.target),
            GapSampling::Loose | GapSampling::Fine if self.settles => whole,
            GapSampling::Loose | GapSampling::Fine => whole.of_other_reading(),
        }
    }

    pub(crate) fn fine(wanted: NormalPass) -> Fineness {
        let target = match wanted.accuracy {
            Accuracy::About(_) => f64::INFINITY,
            Accuracy::For(target) => target,
        };
        Fineness {
            detail: GapSampling::for_answer(target),
            target,
            edges: Edges::Found,
            settles: true,
        }
    }
}

/// One gap at one height of the wheel's centre.
pub(crate) struct LoweredGap<'a> {
    gap: &'a LocalGap,
    /// Deepest overlap in mm.
    depth: f64,
    /// Height of the wheel's centre in mm.
    centre: f64,
    /// What it is solved from; empty if nothing is known.
    start: Vec<PatchGrid>,
}

impl WheelTask {
    /// The wheel at one height.
    pub(crate) fn lowered(
        &self,
        search: &ContactLocus,
        lowering: f64,
        fineness: Fineness,
        near: Option<&WheelContact>,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        let centre = search.touch - lowering;
        let gaps = search
            .gaps(lowering, fineness.detail)
            .map_err(NormalError::NoAnswer)?;
        let depths: Vec<f64> = gaps.iter().map(depth).collect();
        let least = DEPTH_SHARE_MIN * depths.iter().copied().fold(0.0, f64::max);
        let touching = gaps.iter().zip(&depths).filter(|(_, d)| **d > least);
        let patches = touching
            .map(|(gap, depth)| {
                let start = near.and_then(|near| near.start_for(gap, *depth));
                let place = LoweredGap {
                    gap,
                    depth: *depth,
                    centre,
                    start: start.unwrap_or_default(),
                };
                self.solve_gap(place, fineness, workspace, monitor)
            })
            .collect::<Result<Vec<_>, _>>()?;
        if patches.is_empty() {
            return Err(NormalError::NoAnswer(
                "wheel and rail do not overlap at this height of the wheel".to_owned(),
            ));
        }
        Ok(self.wheel(lowering, centre, patches))
    }

    /// The wheel whose patches are known.
    fn wheel(&self, lowering: f64, centre: f64, patches: Vec<GapContact>) -> WheelContact {
        let mut wheel = WheelContact {
            lowering,
            found: [0.0; 2],
            load_error: 0.0,
            force_residual: 0.0,
            centre,
            heights: 1,
            friction_share: 0.0,
            met: false,
            patches,
            remarks: Vec::new(),
        };
        let carried = self.carried(&wheel);
        wheel.found = [carried, self.slope(&wheel, carried)];
        wheel
    }

    /// One gap under the overlap it has; approaches count from the first touch of its patch along the normal.
    fn solve_gap(
        &self,
        place: LoweredGap,
        fineness: Fineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<GapContact, NormalError> {
        let LoweredGap {
            gap,
            depth,
            centre,
            start,
        } = place;
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(NormalError::Stopped(stop));
        }
        let above: Vec<Vec<f64>> = gap
            .gap
            .iter()
            .map(|row| row.iter().map(|height| height + depth).collect())
            .collect();
        let surface = GapSurface::grid(&gap.x, &gap.y, &above);
        let contact = GapTask {
            gap: surface,
            loading: NormalLoad::Approach(depth),
            contact_modulus: self.contact_modulus,
            seen: PreviewCache::default(),
        };
        let resolution = fineness.of_grids();
        let found = contact.solve_near(start, resolution, workspace, monitor)?;
        let found = contact.found(found, fineness.edges)?;
        let reached = found
            .field
            .patches()
            .iter()
            .find_map(|patch| patch.approach);
        let approach = reached.unwrap_or(depth);
        let centre = centre - (approach - depth) / gap.frame.angle.cos();
        let mut remarks = found.remarks;
        remarks.extend(missed_beside(gap, &found.field));
        if fineness.detail.is_for_answer() {
            let cut = cut_patches(&self.geometry, gap, &found.field);
            remarks.extend(cut.map_err(|miss| NormalError::NoAnswer(miss.to_string()))?);
        }
        let moved = |to: [f64; 2]| {
            let place = self.geometry.moved(&gap.frame, to, centre);
            place.map_err(|miss| NormalError::NoAnswer(miss.to_string()))
        };
        if fineness.detail.is_for_answer() {
            for patch in 0..found.field.patches().len() {
                moved(found.field.load_centre(Some(patch)))?;
            }
        }
        let middle = found.field.load_centre(None);
        Ok(GapContact {
            frame: moved(middle)?,
            approach: depth,
            field: found.field.from_origin(middle),
            report: found.report,
            remarks,
            start: found.start,
        })
    }

    /// The force that is prescribed, as it came out.
    fn carried(&self, found: &WheelContact) -> f64 {
        match self.loading {
            WheelLoad::Vertical(_) => found.vertical_force(),
            WheelLoad::Normal(_) | WheelLoad::Lowering(_) => {
                found.patches.iter().map(GapContact::normal_force).sum()
            }
        }
    }

    /// Estimated derivative of that force by the lowering.
    fn slope(&self, found: &WheelContact, carried: f64) -> f64 {
        let part = |gap: &GapContact| {
            let cos = gap.frame.angle.cos();
            let own = 2.0 * self.contact_modulus * gap.stiffness() * cos;
            match self.loading {
                WheelLoad::Vertical(_) => own * cos,
                WheelLoad::Normal(_) | WheelLoad::Lowering(_) => own,
            }
        };
        let slope: f64 = found.patches.iter().map(part).sum();
        // The power 3/2 of Hertz's contacts is a bound for anything that grows as it is pressed.
        slope.max(carried / found.lowering)
    }
}

/// Deepest overlap of a gap in mm.
pub(crate) fn depth(gap: &LocalGap) -> f64 {
    -gap.gap
        .iter()
        .flatten()
        .copied()
        .fold(f64::INFINITY, f64::min)
}
