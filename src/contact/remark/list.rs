//! The list of all remarks, in groups by subject. A new remark is added to its group and nowhere else: the entry has its code,
//! severity, figures and sentence, and the explanation that clients read at `/v1/remarks`.
//!
//! Codes never change. A figure's name ends in its unit and must differ from the members of
//! `RemarkEntry`. A figure may be a number, a count, a pair, a word or optional.

mod case;
mod motions;
mod normal;
mod profile_quality;
mod wheel_on_rail;

use std::collections::BTreeMap;

use crate::contact::remark::kind::short;
use crate::contact::remark::kind::{AsFigure, Figure};
use crate::contact::remark::kind::{RemarkKind, Severity};
use crate::contact::remark::list::case::case_remarks;
use crate::contact::remark::list::motions::motion_remarks;
use crate::contact::remark::list::normal::normal_remarks;
use crate::contact::remark::list::profile_quality::profile_remarks;
use crate::contact::remark::list::wheel_on_rail::wheel_remarks;
use crate::contact::remark::table::remarks;

// Each macro adds its group and calls the next one; the last declares the enum.
case_remarks! { profile_remarks, wheel_remarks, normal_remarks, motion_remarks, remarks; }

#[cfg(test)]
mod tests;
