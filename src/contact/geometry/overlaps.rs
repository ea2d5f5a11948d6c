//! Which overlaps of wheel and rail are patches: near ones share a gap, bent ones are cut where they are thin.
//!
//! Whether neighbouring overlaps share a gap is a matter of thresholds, and the force changes where one is crossed. So that no force
//! jumps while a height is sought, this is decided once, for a lowering near the one that is expected ([`ContactLocus::grouped_near`]), and
//! holds for every height. The pressure found at rest may show patches of one gap that must not share a frame
//! ([`ContactLocus::regrouped`]); the height is then sought once more with a cut between them.

use crate::contact::geometry::contact_locus::{ContactLocus, STEP};
use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::grouping::{
    Group, Grouping, LoadedLines, LoadedPatch, Overlap, SHARED_GAP_ANGLE, SHARED_GAP_DISTANCE,
    group_of, sharing_a_frame,
};
use crate::contact::geometry::locus_lines::LocusPoint;

/// An overlap is cut where it is thinner than this fraction of the lobes on both sides. By Hertz's law two bodies touch where they
/// overlap by more than half of the deepest overlap, so that a lobe may be cut where it is thin. 0.25 and 0.5 change none
/// of 60 states of the worn pair of `cargo bench --bench worn`.
const VALLEY_DEPTH: f64 = 0.35;
/// A cut overlap ends, for its gap, where it is thinner than this fraction of its depth. 0.3 and 0.55 change none of the same states.
const THIN_OVERLAP: f64 = 0.4;

/// Lowering in mm at which overlaps are divided among gaps; others are this one times a power of [`GROUPED_RATIO`]. Loads that lower the wheel by 0.05 to
/// 0.2 mm, as all usual ones do, share one division, so that forces do not jump along a sweep of loads or heights either.
const GROUPED_AT: f64 = 0.1;
/// Ratio of neighbouring lowerings at which overlaps are divided anew.
const GROUPED_RATIO: f64 = 4.0;
/// Groups merge where the overlap between them is deeper than this fraction of the lobes on both sides. 0.4 and 0.8 change none of
/// the same states.
const MERGED: f64 = 0.6;
/// A frame that was inclined as the rail under the load is inclined anew if that has changed by more than this, in rad: it turns forces by 0.5 %.
const LOADED_ANGLE: f64 = 0.005;

impl ContactLocus<'_> {
    /// The same with the overlaps divided among gaps, at every height, as near the lowering that is given in mm.
    #[must_use]
    pub fn grouped_near(self, lowering: f64) -> Self {
        // A smaller lowering, if the contact would reach the end of a profile at this one.
        const HALVINGS: i32 = 12;
        let rung = (lowering / GROUPED_AT).log(GROUPED_RATIO).round();
        let start = GROUPED_AT * GROUPED_RATIO.powf(rung);
        let at = |halvings: i32| start * 0.5_f64.powi(halvings);
        let found = (0..HALVINGS).find_map(|k| self.divided(at(k), None).ok());
        ContactLocus {
            grouping: found.map(|found| grouping_of(&found)),
            ..self
        }
    }

    /// A grouping in which the patches of every gap may share a frame, and every gap that was cut for that has the inclination of the rail
    /// where it carries its load; `None` if that is so already. `loaded` are the patches under pressure, gap by gap, and `lowering` the
    /// height in mm at which they were found.
    pub(crate) fn regrouped(&self, loaded: &[Vec<LoadedPatch>], lowering: f64) -> Option<Grouping> {
        let mut grouping = match &self.grouping {
            Some(known) => known.clone(),
            None => grouping_of(&self.overlaps(lowering).ok()?),
        };
        let mut changed = false;
        for patches in loaded {
            let parts = sharing_a_frame(patches);
            let whole = group_of(patches);
            let Some(k) = grouping.of(whole.lines) else {
                continue;
            };
            let angles = grouping.groups[k].loaded.zip(whole.loaded);
            let turned = angles
                .is_some_and(|(known, found)| (known.angle - found.angle).abs() > LOADED_ANGLE);
            if parts.len() > 1 || turned {
                let groups = parts.into_iter().map(group_of);
                grouping.groups.splice(k..=k, groups);
                changed = true;
            }
        }
        changed.then_some(grouping)
    }

    /// The number of the line nearest to a parameter of the rail in mm.
    pub(crate) fn line_at(&self, rail: f64) -> usize {
        let apart = |k: &usize| (self.lines[*k].rail - rail).abs();
        let lines = 0..self.lines.len();
        lines
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))
            .unwrap_or(0)
    }

    /// The lines that overlap, gap by gap.
    pub(crate) fn overlaps(&self, lowering: f64) -> Result<Vec<Overlap>, String> {
        self.divided(lowering, self.grouping.as_ref())
    }

    /// The same, divided among gaps as was decided, where that decision covers them.
    fn divided(&self, lowering: f64, grouping: Option<&Grouping>) -> Result<Vec<Overlap>, String> {
        let inside = |k: &usize| self.lines[*k].clearance < lowering;
        let places: Vec<usize> = (0..self.lines.len()).filter(inside).collect();
        let mut found: Vec<Overlap> = Vec::new();
        for run in places.chunk_by(|a, b| self.adjoin(*a, *b)) {
            let (first, last) = (run[0], run[run.len() - 1]);
            if first == 0 || !self.adjoin(first - 1, first) {
                return Err(self.cut_off(first));
            }
            if !self.adjoin(last, last + 1) {
                return Err(self.cut_off(last));
            }
            let whole = Overlap {
                ends: [first, last],
                cut: [false; 2],
                near: [false; 2],
                loaded: None,
            };
            let lobes = match grouping {
                None => self.lobes(whole, lowering),
                Some(grouping) => self.cut_as(grouping, whole, lowering),
            };
            for overlap in lobes {
                match found.last_mut() {
                    Some(before) if self.share_a_gap(*before, overlap, lowering, grouping) => {
                        before.ends[1] = overlap.ends[1];
                        before.cut[1] = overlap.cut[1];
                    }
                    _ => found.push(overlap),
                }
            }
        }
        for k in 1..found.len() {
            found[k - 1].near[1] = true;
            found[k].near[0] = true;
        }
        for overlap in &mut found {
            overlap.loaded = grouping.and_then(|grouping| grouping.loaded(overlap.ends));
        }
        Ok(found)
    }

    /// An overlap cut between the groups that it is part of, each time where it is thinnest.
    fn cut_as(&self, grouping: &Grouping, whole: Overlap, lowering: f64) -> Vec<Overlap> {
        let [first, last] = whole.ends;
        let (depths, _) = self.depths(whole, lowering);
        let mut lobes = vec![whole];
        for pair in grouping.groups.windows(2) {
            let ends = [pair[0].lines[1], pair[1].lines[0]];
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            let apart = pair[0].loaded.is_some() && pair[1].loaded.is_some();
            // Beside an overlap nothing is cut: groups end there by themselves.
            if low <= first || high >= last {
                continue;
            }
            let thinnest = (low..=high)
                .min_by(|a, b| depths[a - first].total_cmp(&depths[b - first]))
                .unwrap_or(low);
            let deepest = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
            let [from, to] = lobes[lobes.len() - 1].ends;
            if thinnest <= from || thinnest >= to {
                continue;
            }
            let sides = depths.split_at(thinnest - first);
            if !apart && depths[thinnest - first] > MERGED * deepest(sides.0).min(deepest(sides.1))
            {
                continue;
            }
            if let Some(rest) = lobes.pop() {
                let (mut before, mut after) = (rest, rest);
                (before.ends[1], before.cut[1]) = (thinnest, true);
                (after.ends[0], after.cut[0]) = (thinnest, true);
                lobes.extend([before, after]);
            }
        }
        lobes
    }

    /// Whether two neighbouring overlaps share a gap: as a known grouping says, else by how near they are.
    fn share_a_gap(
        &self,
        one: Overlap,
        other: Overlap,
        lowering: f64,
        grouping: Option<&Grouping>,
    ) -> bool {
        let known =
            grouping.and_then(|grouping| Some(grouping.of(one.ends)? == grouping.of(other.ends)?));
        known.unwrap_or_else(|| self.are_near(one, other, lowering))
    }

    /// An overlap that bends, such as one of tread and flange together, cut where it is thin between two lobes of
    /// different inclination: where the overlap along the normal is so small, nothing touches.
    fn lobes(&self, whole: Overlap, lowering: f64) -> Vec<Overlap> {
        let [first, last] = whole.ends;
        let (depths, main) = self.depths(whole, lowering);
        let angles: Vec<f64> = (first..=last)
            .map(|k| self.inclination(&self.lines[k]).angle)
            .collect();
        let (after, before) = ((main..depths.len()).collect(), (0..=main).rev().collect());
        let mut valleys = Vec::new();
        for outward in [after, before] as [Vec<usize>; 2] {
            let (mut valley, mut other) = (main, None);
            for k in outward {
                if depths[k] < depths[valley] {
                    valley = k;
                }
                if depths[valley] <= VALLEY_DEPTH * depths[k]
                    && (angles[k] - angles[main]).abs() > SHARED_GAP_ANGLE
                    && other.is_none_or(|(deepest, _)| depths[k] > deepest)
                {
                    other = Some((depths[k], valley));
                }
            }
            valleys.extend(other.map(|(_, valley)| first + valley));
        }
        let Some(valley) = valleys.first().copied() else {
            return vec![whole];
        };
        let low = Overlap {
            ends: [first, valley],
            cut: [whole.cut[0], true],
            ..whole
        };
        let high = Overlap {
            ends: [valley, last],
            cut: [true, whole.cut[1]],
            ..whole
        };
        [self.lobes(low, lowering), self.lobes(high, lowering)].concat()
    }

    /// Are the lines at these places, one after the other, neighbours in space?
    fn adjoin(&self, k: usize, next: usize) -> bool {
        next == k + 1
            && next < self.lines.len()
            && self.lines[next].y - self.lines[k].y < 1.5 * STEP
    }

    /// The lines of an overlap with the one on either side.
    pub(crate) fn around(&self, [first, last]: [usize; 2]) -> &[LocusPoint] {
        &self.lines[first - 1..=last + 1]
    }

    /// The frame of an overlap: where it carries pressure, if that is known.
    pub(crate) fn frame_of(&self, overlap: Overlap, lowering: f64) -> Frame {
        let [first, last] = overlap.ends;
        let lines = |loaded: &LoadedLines| [loaded.lines[0].max(first), loaded.lines[1].min(last)];
        let overlaps = |loaded: &LoadedLines| {
            let [low, high] = lines(loaded);
            (low..=high).any(|k| self.lines[k].clearance < lowering)
        };
        match overlap.loaded.filter(overlaps) {
            None => self.frame(self.around(overlap.ends), lowering),
            Some(loaded) => Frame {
                angle: loaded.angle,
                ..self.frame(self.around(lines(&loaded)), lowering)
            },
        }
    }

    /// How deep the bodies overlap along the normal, line by line, and where most.
    fn depths(&self, overlap: Overlap, lowering: f64) -> (Vec<f64>, usize) {
        let [first, last] = overlap.ends;
        let depth = |line: &LocusPoint| (lowering - line.clearance) * self.inclination(line).cos;
        let depths: Vec<f64> = self.lines[first..=last].iter().map(depth).collect();
        let deeper = |a: &usize, b: &usize| depths[*a].total_cmp(&depths[*b]);
        let main = (0..depths.len()).max_by(deeper).unwrap_or(0);
        (depths, main)
    }

    /// The lines beyond which an overlap touches nothing that belongs to its gap, toward another gap; none where there is no
    /// other gap. A cut overlap gets thin before its end, a whole one ends where the bodies do not overlap any more. One whose patches are known ends
    /// next to them.
    pub(crate) fn limits(&self, overlap: Overlap, lowering: f64) -> [Option<LocusPoint>; 2] {
        if let Some(loaded) = overlap.loaded {
            let [low, high] = loaded.limits();
            let limits = [low.max(overlap.ends[0]), high.min(overlap.ends[1])];
            let limit = |side: usize| self.lines[limits[side]];
            return [0, 1]
                .map(|side| (overlap.cut[side] || overlap.near[side]).then(|| limit(side)));
        }
        let (depths, main) = self.depths(overlap, lowering);
        let thin = |k: &usize| depths[*k] <= THIN_OVERLAP * depths[main];
        let thin_ends = [
            (0..=main).rev().find(thin).unwrap_or(0),
            (main..depths.len()).find(thin).unwrap_or(depths.len() - 1),
        ];
        [0, 1].map(|side| match (overlap.cut[side], overlap.near[side]) {
            (true, _) => Some(self.lines[overlap.ends[0] + thin_ends[side]]),
            (false, true) => Some(self.lines[overlap.ends[side]]),
            (false, false) => None,
        })
    }

    fn are_near(&self, one: Overlap, other: Overlap, lowering: f64) -> bool {
        let apart = self.lines[other.ends[0]].rail - self.lines[one.ends[1]].rail;
        let angle = |overlap: Overlap| self.frame(self.around(overlap.ends), lowering).angle;
        !one.cut[1]
            && apart.abs() <= SHARED_GAP_DISTANCE
            && (angle(one) - angle(other)).abs() <= SHARED_GAP_ANGLE
    }

    fn cut_off(&self, line: usize) -> String {
        let line = self.lines[line];
        self.geometry.cut_off([line.rail, line.wheel])
    }
}

fn grouping_of(overlaps: &[Overlap]) -> Grouping {
    let group = |overlap: &Overlap| Group {
        lines: overlap.ends,
        loaded: None,
    };
    Grouping {
        groups: overlaps.iter().map(group).collect(),
    }
}
