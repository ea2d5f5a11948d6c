//! A remark in an answer, with the patch, motion or member that it applies to, and the merging of repeated remarks.

use std::collections::BTreeMap;

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::finite::Finite;
use crate::remark::kind::{AsFigure, Figure, Severity};
use crate::remark::list::Remark;

/// Maximum number of motions with the same remark whose figures are kept. For further motions only the index is kept.
const KEPT_MAX: usize = 4;

/// A remark on a result: its code, its location, a sentence, and the values in it by name.
#[none_is_absent(nullable)]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RemarkEntry {
    /// The kind of remark; `/v1/remarks` lists them all.
    #[schema(example = "friction-unusual")]
    pub code: String,
    /// How much attention it needs.
    pub severity: Severity,
    /// Index of the patch that it applies to, from 0; absent if it applies to all.
    pub patch: Option<usize>,
    /// Index of the motion that it applies to, from 0; absent if it applies to all.
    pub point: Option<usize>,
    /// Further motions with the same remark but their own values, as ranges `[first, last]`.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    #[schema(required = false)]
    pub also_at_points: Vec<[usize; 2]>,
    /// JSON pointer (RFC 6901) to the part of the case that it applies to, if there is one.
    pub pointer: Option<String>,
    /// One sentence.
    pub detail: String,
    /// Values in the sentence by name; the name includes the unit.
    #[serde(flatten)]
    pub figures: BTreeMap<String, Figure>,
}

impl AsFigure for f64 {
    fn figure(&self) -> Option<Figure> {
        self.is_finite().then_some(Figure::Number(*self))
    }
}

impl AsFigure for usize {
    fn figure(&self) -> Option<Figure> {
        Some(Figure::Number(*self as f64))
    }
}

impl AsFigure for String {
    fn figure(&self) -> Option<Figure> {
        Some(Figure::Word(self.clone()))
    }
}

impl<T: AsFigure> AsFigure for Option<T> {
    fn figure(&self) -> Option<Figure> {
        self.as_ref().and_then(AsFigure::figure)
    }
}

impl From<Remark> for RemarkEntry {
    fn from(remark: Remark) -> RemarkEntry {
        RemarkEntry {
            code: remark.code().to_owned(),
            severity: remark.severity(),
            patch: None,
            point: None,
            also_at_points: Vec::new(),
            pointer: None,
            detail: remark.detail(),
            figures: remark.figures(),
        }
    }
}

// Figures are finite, see [`AsFigure`].
impl Finite for RemarkEntry {
    fn not_finite(&self) -> Option<String> {
        None
    }
}

impl Remark {
    /// Returns the remark for one patch.
    pub fn at_patch(self, patch: usize) -> RemarkEntry {
        RemarkEntry {
            patch: Some(patch),
            ..self.into()
        }
    }

    /// Returns the remark for one motion.
    pub fn at_point(self, point: usize) -> RemarkEntry {
        RemarkEntry {
            point: Some(point),
            ..self.into()
        }
    }

    /// Returns the remark for a member of the case.
    pub fn at_pointer(self, pointer: &str) -> RemarkEntry {
        RemarkEntry {
            pointer: Some(pointer.to_owned()),
            ..self.into()
        }
    }
}

impl RemarkEntry {
    /// Returns the codes of remarks, each once, separated by blanks.
    pub fn codes<'a>(remarks: impl IntoIterator<Item = &'a RemarkEntry>) -> String {
        let mut codes: Vec<&str> = Vec::new();
        for remark in remarks {
            if !codes.contains(&&*remark.code) {
                codes.push(&remark.code);
            }
        }
        codes.join(" ")
    }

    /// Whether it applies to this motion.
    pub fn holds_at(&self, point: usize) -> bool {
        let among = |range: &[usize; 2]| (range[0]..=range[1]).contains(&point);
        self.point.is_none_or(|own| own == point) || self.also_at_points.iter().any(among)
    }

    /// Whether it equals another remark, apart from `also_at_points`.
    fn says(&self, other: &RemarkEntry) -> bool {
        self.is_like(other) && self.point == other.point && self.figures == other.figures
    }

    /// Whether it has the kind, patch and pointer of another remark.
    fn is_like(&self, other: &RemarkEntry) -> bool {
        self.code == other.code && self.patch == other.patch && self.pointer == other.pointer
    }
}

/// Returns remarks without repetitions. Of remarks that differ only in motion and figures the first [`KEPT_MAX`] are kept, and the first lists
/// the motions of the others.
pub fn merged(remarks: impl IntoIterator<Item = RemarkEntry>) -> Vec<RemarkEntry> {
    let mut kept: Vec<RemarkEntry> = Vec::new();
    // For each kind, patch and pointer: the index of the first remark in `kept`, and the number of kept remarks.
    let mut groups: Vec<(usize, usize)> = Vec::new();
    for mut remark in remarks {
        let of_kind = |(first, _): &&mut (usize, usize)| kept[*first].is_like(&remark);
        let Some((first, count)) = groups.iter_mut().find(of_kind) else {
            groups.push((kept.len(), 1));
            kept.push(remark);
            continue;
        };
        let ranges = std::mem::take(&mut remark.also_at_points);
        let numbered = remark.point.filter(|_| *count >= KEPT_MAX);
        let known = |known: &RemarkEntry| {
            let among = |point| known.is_like(&remark) && known.holds_at(point);
            known.says(&remark) || numbered.is_some_and(among)
        };
        if !kept.iter().any(known) {
            match numbered {
                Some(point) => add(&mut kept[*first].also_at_points, [point, point]),
                None => {
                    *count += 1;
                    kept.push(remark);
                }
            }
        }
        for range in ranges {
            add(&mut kept[*first].also_at_points, range);
        }
    }
    kept
}

/// Adds a range of motions to ranges in increasing order, unless they include it.
fn add(ranges: &mut Vec<[usize; 2]>, [first, end]: [usize; 2]) {
    if ranges.iter().any(|own| own[0] <= first && end <= own[1]) {
        return;
    }
    match ranges.last_mut() {
        Some(last) if last[1] + 1 == first => last[1] = end,
        _ => ranges.push([first, end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missed(point: usize, estimate: f64) -> RemarkEntry {
        Remark::TargetMissed {
            relative_to: "μN",
            estimate: Some(estimate),
            target: 0.001,
        }
        .at_point(point)
    }

    #[test]
    fn every_remark_comes_back_from_json_as_it_was() {
        for remark in Remark::examples() {
            for entry in [
                remark.clone().at_patch(3),
                remark.clone().at_pointer("/contact"),
                remark.at_point(0),
            ] {
                let text = serde_json::to_string(&entry).unwrap();
                assert_eq!(serde_json::from_str::<RemarkEntry>(&text).unwrap(), entry);
            }
        }
    }

    #[test]
    fn figures_stand_beside_the_code_by_name() {
        let json = serde_json::to_value(missed(2, 0.01)).unwrap();
        assert_eq!(json["code"], "target-missed");
        assert_eq!(json["severity"], "warning");
        assert_eq!(
            (&json["point"], &json["estimate"], &json["target"]),
            (&2.into(), &0.01.into(), &0.001.into())
        );
        assert!(json.get("patch").is_none() && json.get("pointer").is_none());
    }

    #[test]
    fn a_figure_that_is_no_number_is_left_out() {
        let entry = missed(0, f64::NAN);
        assert!(!entry.figures.contains_key("estimate"), "{entry:?}");
        let text = serde_json::to_string(&entry).unwrap();
        assert_eq!(serde_json::from_str::<RemarkEntry>(&text).unwrap(), entry);
    }

    #[test]
    fn repetitions_are_merged_and_no_motion_is_lost() {
        let twice = Remark::GapRough {}.at_patch(0);
        let many = (0..1000).filter(|k| *k != 500).map(|k| missed(k, k as f64));
        let found = merged([twice.clone(), twice.clone()].into_iter().chain(many));
        assert_eq!(found.len(), 1 + KEPT_MAX);
        assert_eq!(found[0], twice);
        assert_eq!(found[1].also_at_points, [[4, 499], [501, 999]]);
        for point in 0..1001 {
            let said = found[1..].iter().any(|remark| remark.holds_at(point));
            assert_eq!(said, point < 1000 && point != 500, "{point}");
        }
        assert!(serde_json::to_string(&found).unwrap().len() < 2000);
        // Merging again, with some of the same, changes nothing.
        let some = [missed(0, 0.0), missed(3, 3.0), missed(700, 700.0)];
        let again = merged(found.iter().cloned().chain(some));
        assert_eq!(again, found);
        assert_eq!(merged(found.iter().chain(&found).cloned()), found);
    }

    #[test]
    fn remarks_of_different_places_stay_apart() {
        let all: Vec<_> = (0..20).map(|k| Remark::GapRough {}.at_patch(k)).collect();
        assert_eq!(merged(all.clone()), all);
    }
}
