//! Runs of lines that overlap, and which of them share a gap.

/// Overlaps nearer to each other than this along the rail, in mm, share one gap, because they influence each other. CONTACT, too,
/// separates patches that are 8 mm or 30° apart.
pub(crate) const SHARED_GAP_DISTANCE: f64 = 8.0;

/// Patches farther apart than this along the rail, in mm, never share a frame. Patches are narrower than their overlaps, so that those of
/// overlaps 8 mm apart may be up to half as far again apart.
pub(crate) const SHARED_FRAME_DISTANCE: f64 = 1.5 * SHARED_GAP_DISTANCE;
/// Overlaps nearer than [`SHARED_GAP_DISTANCE`] share a gap if their inclinations differ by less than this, in rad.
pub(crate) const SHARED_GAP_ANGLE: f64 = 0.5;

/// Lines that overlap: the first and the last one, and what lies beyond either end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overlap {
    pub(crate) ends: [usize; 2],
    /// The overlap goes on beyond this end, in another gap.
    pub(crate) cut: [bool; 2],
    /// Another gap lies on this side, next to this one or farther away.
    pub(crate) near: [bool; 2],
    /// Where it carries pressure, if that is known.
    pub(crate) loaded: Option<LoadedLines>,
}

/// Lines that share a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Group {
    /// The first and the last one.
    pub(crate) lines: [usize; 2],
    /// Where they carry pressure, if that was found.
    pub(crate) loaded: Option<LoadedLines>,
}

/// The part of a group that was found to carry pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoadedLines {
    /// The first and the last line.
    pub(crate) lines: [usize; 2],
    /// Mean inclination of the rail in rad, weighted with the pressure.
    pub(crate) angle: f64,
}

impl LoadedLines {
    /// The lines at which its gap ends toward other gaps at the latest: half of its width away from it.
    pub(crate) fn limits(&self) -> [usize; 2] {
        let [low, high] = self.lines;
        let beside = (high - low).div_ceil(2);
        [low.saturating_sub(beside), high + beside]
    }
}

/// Which lines share a gap, as it was decided at one height of the wheel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grouping {
    /// The lines of every gap, from smaller to larger y.
    pub(crate) groups: Vec<Group>,
}

impl Grouping {
    /// The group with which an overlap has most lines in common.
    pub(crate) fn of(&self, [first, last]: [usize; 2]) -> Option<usize> {
        let common = |k: &usize| {
            let [low, high] = self.groups[*k].lines;
            (high.min(last) + 1).saturating_sub(low.max(first))
        };
        let most = (0..self.groups.len()).max_by_key(common)?;
        (common(&most) > 0).then_some(most)
    }

    /// Where the group to which an overlap belongs carries pressure, if that is known.
    pub(crate) fn loaded(&self, ends: [usize; 2]) -> Option<LoadedLines> {
        self.groups[self.of(ends)?].loaded
    }
}

/// A patch that was found to carry pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoadedPatch {
    /// Parameters of the rail at its ends in mm, from smaller to larger y of the track.
    pub(crate) rail: [f64; 2],
    /// The lines nearest to its ends.
    pub(crate) lines: [usize; 2],
    /// Mean inclination of the rail in rad, weighted with the pressure.
    pub(crate) angle: f64,
    /// Normal force in N.
    pub(crate) force: f64,
}

/// The group of patches that share a frame.
pub(crate) fn group_of(patches: &[LoadedPatch]) -> Group {
    let force: f64 = patches.iter().map(|patch| patch.force).sum();
    let turned = patches.iter().map(|patch| patch.force * patch.angle);
    let lines = [patches[0].lines[0], patches[patches.len() - 1].lines[1]];
    Group {
        lines,
        loaded: Some(LoadedLines {
            lines,
            angle: turned.sum::<f64>() / force,
        }),
    }
}

/// The patches of one gap, in order of y, divided into those that may share a frame: neighbours are no more than
/// [`SHARED_FRAME_DISTANCE`] apart, and no two are inclined to each other by more than [`SHARED_GAP_ANGLE`].
pub(crate) fn sharing_a_frame(patches: &[LoadedPatch]) -> Vec<&[LoadedPatch]> {
    let angles = patches.iter().map(|patch| patch.angle);
    let low = angles.clone().fold(f64::INFINITY, f64::min);
    let high = angles.fold(f64::NEG_INFINITY, f64::max);
    // The parameters of a rail on the right run against y.
    let sense = (patches[0].rail[1] - patches[0].rail[0]).signum();
    let apart = |k: &usize| {
        let (before, after) = patches.split_at(*k);
        let ends = before.iter().map(|patch| sense * patch.rail[1]);
        sense * after[0].rail[0] - ends.fold(f64::NEG_INFINITY, f64::max)
    };
    let widest = (1..patches.len()).max_by(|a, b| apart(a).total_cmp(&apart(b)));
    let Some(k) = widest.filter(|k| apart(k) > 0.0) else {
        return vec![patches];
    };
    if apart(&k) <= SHARED_FRAME_DISTANCE && high - low <= SHARED_GAP_ANGLE {
        return vec![patches];
    }
    let (before, after) = patches.split_at(k);
    [sharing_a_frame(before), sharing_a_frame(after)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(from: f64, to: f64, angle: f64) -> LoadedPatch {
        LoadedPatch {
            rail: [from, to],
            lines: [0, 0],
            angle,
            force: 1.0,
        }
    }

    fn sizes(patches: &[LoadedPatch]) -> Vec<usize> {
        let parts = sharing_a_frame(patches);
        parts.iter().map(|part| part.len()).collect()
    }

    #[test]
    fn patches_far_apart_or_inclined_to_each_other_have_frames_of_their_own() {
        let near = [patch(0.0, 6.0, 0.0), patch(10.0, 12.0, 0.3)];
        assert_eq!(sizes(&near), [2]);
        let far = [patch(0.0, 6.0, 0.0), patch(18.5, 20.0, 0.1)];
        assert_eq!(sizes(&far), [1, 1]);
        let inclined = [patch(0.0, 6.0, 0.0), patch(8.0, 9.0, -0.6)];
        assert_eq!(sizes(&inclined), [1, 1]);
        // The first and the last of a chain decide, and it is cut where it is widest.
        let chain = [
            patch(0.0, 6.0, 0.0),
            patch(8.0, 9.0, 0.3),
            patch(12.0, 13.0, 0.6),
        ];
        assert_eq!(sizes(&chain), [2, 1]);
        // One within the other lies at no distance from it.
        let nested = [
            patch(0.0, 20.0, 0.0),
            patch(5.0, 8.0, 0.1),
            patch(22.0, 23.0, 0.1),
        ];
        assert_eq!(sizes(&nested), [3]);
        let mirrored = [patch(20.0, 18.5, 0.1), patch(6.0, 0.0, 0.0)];
        assert_eq!(sizes(&mirrored), [1, 1]);
    }
}
