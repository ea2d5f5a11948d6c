//! The list of all remarks, in groups by subject. A new remark is added to its group and nowhere else: the entry has its code,
//! severity, figures and sentence, and the explanation that clients read at `/v1/remarks`.
//!
//! Codes never change. A figure's name ends in its unit and must differ from the members of
//! `RemarkEntry`. A figure may be a number, a count, a pair, a word or optional.

use std::collections::BTreeMap;

use crate::remark::kind::{AsFigure, Figure, RemarkKind, Severity, remarks, short};
use crate::remark::list::motions::motion_remarks;
use crate::remark::list::normal::{case_remarks, normal_remarks, wheel_remarks};
use crate::remark::list::profile_quality::profile_remarks;

mod motions;
mod normal;
mod profile_quality;

// Each macro adds its group and calls the next one; the last declares the enum.
case_remarks! { profile_remarks, wheel_remarks, normal_remarks, motion_remarks, remarks; }

#[cfg(test)]
mod tests {
    //! The list of remarks is complete and in order.

    use std::collections::BTreeSet;

    use crate::remark::entry::RemarkEntry;
    use crate::remark::list::Remark;

    #[test]
    fn every_code_is_listed_once_and_documented() {
        let kinds = Remark::kinds();
        assert_eq!(kinds.len(), Remark::examples().len());
        let codes: BTreeSet<_> = kinds.iter().map(|kind| kind.code).collect();
        assert_eq!(codes.len(), kinds.len(), "a code stands twice");
        for kind in kinds {
            let words = kind.code.split('-');
            let kebab =
                |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase());
            assert!(
                words.into_iter().all(kebab),
                "{} is no kebab-case",
                kind.code
            );
            for text in [kind.meaning, kind.advice] {
                assert!(
                    text.len() > 15 && text.ends_with('.'),
                    "{}: {text}",
                    kind.code
                );
            }
            assert!(
                kind.example.len() > 15 && !kind.example.ends_with('.'),
                "{}: {}",
                kind.code,
                kind.example
            );
        }
    }

    #[test]
    fn figures_have_names_of_their_own() {
        let members = serde_json::to_value(RemarkEntry {
            patch: Some(0),
            point: Some(0),
            also_at_points: vec![[1, 2]],
            pointer: Some(String::new()),
            ..Remark::GapRough {}.into()
        });
        let members = members.unwrap();
        for (kind, example) in Remark::kinds().iter().zip(Remark::examples()) {
            assert!(
                kind.figures.iter().all(|name| members.get(name).is_none()),
                "{} has a figure named as a member of every remark",
                kind.code
            );
            let given = example.figures();
            let left_out = kind.figures.len() - given.len();
            // Of optional figures at least one is shown.
            assert!(
                left_out == 0 || !given.is_empty(),
                "{}: {given:?}",
                kind.code
            );
        }
    }
}
