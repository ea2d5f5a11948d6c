//! Solves a wheel on a rail and says how far its profiles can be trusted: their quality under every patch, what is wrong with them and
//! what the measurement leaves open. Where an answer would mislead there is none.

pub mod before;
mod finding;
mod judge;
pub mod quality;
mod settle;
mod uncertainty;

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::geometry::contact_search::Search;
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::profile_quality::holes::{Hole, holes};
use crate::contact::monitor::Monitor;
use crate::contact::normal::profiles::ProfileContact;
use crate::contact::problem::Problem;
use crate::contact::profiles::{self, Found};
use crate::contact::solution::{Fields, Solution};
use crate::contact::tangential::operator_store::OperatorStore;
use finding::{Cause, Finding};
use judge::{FoundPatch, judge};

/// What a case says about the trust in its profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Trust {
    /// The smoothing of rail and wheel follows from their noise.
    pub auto: [bool; 2],
    /// Profiles are solved that are too rough or too coarse for an answer that can be relied on.
    pub accept_rough: bool,
}

/// Solves a problem whose region is a wheel on a rail, and judges its profiles.
///
/// # Errors
/// A named reason why there is no answer; [`SolveError::RoughProfile`] where the points of a profile allow none and rough ones are not
/// accepted.
pub(super) fn solve(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    contact: &ProfileContact,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let settled = settle::settled(problem, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let mut found = profiles::solve(operators, problem, contact, monitor)?;
    let findings = judged(&mut found, contact)?;
    let refused = findings.iter().find(|finding| finding.refused);
    if let (Some(finding), false) = (refused, contact.trust.accept_rough) {
        return Err(SolveError::RoughProfile {
            pointer: finding.pointer().to_owned(),
            reason: finding.remark().detail,
        });
    }
    let Found {
        mut solution,
        fields,
        ..
    } = found;
    let suspicious = findings.iter().any(|finding| {
        finding.of_roughness() && finding.has_evidence() && finding.share > uncertainty::HARMLESS
    });
    let changes = uncertainty::add(
        operators,
        problem,
        contact,
        suspicious,
        &mut solution,
        monitor,
    )?;
    let told = findings
        .into_iter()
        .filter(|finding| finding.is_told(changes[finding.patch]));
    let told = worst_of_each(told);
    solution.remarks.extend(settle::remarks(contact));
    solution.remarks.extend(told.iter().map(Finding::remark));
    solution
        .remarks
        .extend(uncertainty::target_below(problem, &solution));
    Ok((solution, fields))
}

/// A rough profile makes dozens of patches; of what is wrong with a body in the same way the worst place is enough.
fn worst_of_each(findings: impl Iterator<Item = Finding>) -> Vec<Finding> {
    let mut worst: Vec<Finding> = Vec::new();
    for finding in findings {
        let same = |other: &&mut Finding| finding.is_like(other);
        match worst.iter_mut().find(same) {
            None => worst.push(finding),
            Some(other) if finding.worse_than(other) => *other = finding,
            Some(_) => {}
        }
    }
    worst
}

/// Writes the quality of the profiles into every patch, and lists what is wrong with them.
fn judged(found: &mut Found, contact: &ProfileContact) -> Result<Vec<Finding>, SolveError> {
    let geometry = &contact.geometry;
    let mut findings = Vec::new();
    let mut number = 0;
    for gap in &found.wheel.patches {
        for _ in gap.field.patches() {
            let patch = &mut found.solution.patches[number];
            let [.., from, to] = patch.extent_mm;
            let place = FoundPatch {
                gap,
                centre: found.wheel.centre,
                across: [from, to],
                pressure: patch.pressure_max_mpa,
                number,
            };
            let (quality, of_patch) = judge(geometry, place, contact.contact_modulus)?;
            patch.quality = Some(quality);
            findings.extend(of_patch);
            number += 1;
        }
    }
    findings.extend(hidden(found, contact));
    Ok(findings)
}

/// Stretches without points where the bodies may touch beside the patches that were found.
fn hidden(found: &mut Found, contact: &ProfileContact) -> Vec<Finding> {
    let patches = &found.solution.patches;
    let width = patches
        .iter()
        .map(|patch| patch.extent_mm[3] - patch.extent_mm[2])
        .fold(0.0, f64::max);
    let [rail, wheel] = contact.geometry.profiles();
    let longest = rail.longest_chord().max(wheel.longest_chord());
    if longest < Hole::least(width) {
        return Vec::new();
    }
    // The search is a good part of a solve; few profiles have chords so long.
    let Ok(search) = Search::new(&contact.geometry) else {
        return Vec::new();
    };
    let mut findings = Vec::new();
    for hole in holes(&search, found.wheel.lowering, width) {
        let (profile, body) = match hole.body {
            Body::Rail => (rail, Body::Rail),
            Body::Wheel => (wheel, Body::Wheel),
        };
        let y = hole.chord.map(|s| profile.at(s).at[0]);
        let quality = |patch: &crate::contact::solution::PatchSolution| {
            patch.quality.as_ref().map(|quality| match body {
                Body::Rail => quality.rail,
                Body::Wheel => quality.wheel,
            })
        };
        let under = |own: &quality::ProfileQuality| own.y_mm[0] < y[1] && own.y_mm[1] > y[0];
        if found
            .solution
            .patches
            .iter()
            .filter_map(quality)
            .any(|own| under(&own))
        {
            continue;
        }
        let middle = 0.5 * (y[0] + y[1]);
        let distance = |patch: &crate::contact::solution::PatchSolution| {
            quality(patch).map_or(f64::INFINITY, |own| {
                (0.5 * (own.y_mm[0] + own.y_mm[1]) - middle).abs()
            })
        };
        let nearest = (0..found.solution.patches.len()).min_by(|a, b| {
            let [a, b] = [a, b].map(|k| distance(&found.solution.patches[*k]));
            a.total_cmp(&b)
        });
        let Some(number) = nearest else { continue };
        let length = hole.chord[1] - hole.chord[0];
        if let Some(quality) = &mut found.solution.patches[number].quality {
            let own = match body {
                Body::Rail => &mut quality.rail,
                Body::Wheel => &mut quality.wheel,
            };
            own.hole_mm = Some(own.hole_mm.unwrap_or(0.0).max(length));
        }
        findings.push(Finding {
            body,
            patch: number,
            y,
            pressure: 0.0,
            share: 0.0,
            left: 0.0,
            everywhere: 0.0,
            chord: y,
            chord_length: length,
            over_width: length / width,
            smoothing: profile.smoothing(),
            advised: 0.0,
            refused: hole.wide,
            cause: Cause::Hole,
        });
    }
    findings
}
