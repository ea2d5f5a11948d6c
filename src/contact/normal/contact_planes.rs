//! Planes of contact of a wheel on a rail.

use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::reference_curve::{ContactPlane, Nearest, ReferenceCurve};
use crate::normal::on_curve::CurveContact;

/// Largest distance in mm of patches that share a plane of contact. CONTACT separates patches that are 8 mm apart.
const SHARED_PLANE_DISTANCE: f64 = 12.0;
/// Largest inclination in rad of patches that share a plane of contact. CONTACT separates patches that are inclined by 30°.
const SHARED_PLANE_ANGLE: f64 = 0.5;

/// A run of strips in contact.
#[derive(Debug, Clone, Copy)]
struct StripRun {
    /// Arc lengths of its ends in mm.
    ends: [f64; 2],
    /// Mean angle in rad, weighted with the pressures.
    angle: f64,
}

impl StripRun {
    /// Distance from another run in mm.
    fn apart(&self, other: &StripRun) -> f64 {
        (self.ends[0] - other.ends[1]).max(other.ends[0] - self.ends[1])
    }

    fn inclined(&self, other: &StripRun) -> f64 {
        (self.angle - other.angle).abs()
    }
}

impl CurveContact {
    /// Planes of contact for the patches and for overlaps without pressure. Close neighbours with a small inclination share a plane. Each plane passes through the mean
    /// of the overlap, weighted with its square over the area, at the mean angle there.
    pub(crate) fn planes(&self, curve: &ReferenceCurve, locus: &ContactLocus) -> Vec<ContactPlane> {
        let [first, last] = curve.range();
        let overlaps = curve.overlaps(self.centre);
        let pressed = self.grid.runs(&self.pressure).into_iter();
        let pressed: Vec<StripRun> = pressed.map(|run| self.strip_run(run)).collect();
        let free = overlaps.iter().filter_map(|overlap| {
            let ends = [overlap[0].place.s, overlap[overlap.len() - 1].place.s];
            let apart = |run: &StripRun| run.ends[1] < ends[0] || run.ends[0] > ends[1];
            let gap = |near: &&Nearest| near.wheel.gap;
            let deepest = overlap.iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
            pressed.iter().all(apart).then_some(StripRun {
                ends,
                angle: deepest.place.angle,
            })
        });
        let mut groups: Vec<Vec<StripRun>> = Vec::new();
        for run in pressed.iter().copied().chain(free) {
            // Of the possible groups, the one with the closest inclination.
            let fits = |group: &&mut Vec<StripRun>| {
                let near = |other: &StripRun| other.apart(&run) <= SHARED_PLANE_DISTANCE;
                let inclined = group.iter().map(|other| other.inclined(&run));
                group.iter().any(near) && inclined.fold(0.0, f64::max) <= SHARED_PLANE_ANGLE
            };
            let nearest = groups
                .iter_mut()
                .filter(fits)
                .min_by(|a, b| a[0].inclined(&run).total_cmp(&b[0].inclined(&run)));
            match nearest {
                Some(group) => group.push(run),
                None => groups.push(vec![run]),
            }
        }
        groups.iter_mut().for_each(|group| {
            group.sort_by(|a, b| a.ends[0].total_cmp(&b.ends[0]));
        });
        groups.sort_by(|a, b| a[0].ends[0].total_cmp(&b[0].ends[0]));
        let ends = |group: &[StripRun]| [group[0].ends[0], group[group.len() - 1].ends[1]];
        let ends: Vec<[f64; 2]> = groups.iter().map(|group| ends(group)).collect();
        let between = |k: usize| 0.5 * (ends[k][1] + ends[k + 1][0]);
        let plane = |k: usize| {
            let low = match k {
                0 => f64::NEG_INFINITY,
                _ => between(k - 1),
            };
            let high = match k + 1 == ends.len() {
                true => f64::INFINITY,
                false => between(k),
            };
            let mut rails = [low, high].map(|s| curve.at(s.clamp(first, last)).rail);
            rails.sort_by(f64::total_cmp);
            let middle = curve.at(0.5 * (ends[k][0] + ends[k][1]));
            let mean = locus.mean_overlap(locus.touch - self.centre, rails);
            let [rail, angle] = mean.unwrap_or([middle.rail, middle.angle]);
            ContactPlane {
                origin: curve.at_rail(rail),
                angle,
                range: [low, high],
            }
        };
        (0..groups.len()).map(plane).collect()
    }

    /// The ends and the angle of a run of strips.
    fn strip_run(&self, [first, last]: [usize; 2]) -> StripRun {
        let nx = self.grid.x.len();
        let half = 0.5 * self.grid.step[1];
        let [low, high] = [first, last].map(|j| self.grid.places[j].s);
        let (mut load, mut angle) = (0.0, 0.0);
        for j in first..=last {
            let own: f64 = self.pressure[j * nx..(j + 1) * nx].iter().sum();
            load += own;
            angle += own * self.grid.places[j].angle;
        }
        StripRun {
            ends: [low - half, high + half],
            angle: angle / load,
        }
    }
}
