//! The answer of an evolution: records, losses, uncertainties and limits.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_1_SQRT_2;

use crate::case::words::contact::GAUGE_HEIGHT;
use crate::case::words::evolution::WearLosses;
use crate::case::words::subsurface::DamageModel;
use crate::error::SolveError;
use crate::evolution::pass::Pass;
use crate::evolution::section::{distance, lengths};
use crate::evolution::task::Evolution;
use crate::geometry::profile::{Body, Profile, Reading};
use crate::geometry::wheel_rail::{Placement, RailPlace, Side, WheelRail};
use crate::geometry::wheelset_pose::PairOfRails;
use crate::monitor::Monitor;
use crate::normal::wheel::KinematicsTask;
use crate::numerics::quadrature::halton;
use crate::numerics::roots::bounds;
use crate::remark::entry::RemarkEntry;
use crate::remark::kind::{Figure, Severity, percent, short};
use crate::remark::list::Remark;
use crate::solution::words::evolution::{
    BodyState, CondensedTraffic, ContactRange, EvolutionAnswer, EvolutionRecord, EvolutionState,
    LimitReached, StateContact, WearUncertainty, WornBody,
};
use crate::wheelset::kinematics::level_radii;

/// Depth below the tread in mm at which the thickness of the flange is measured.
const FLANGE_DEPTH: f64 = 10.0;
/// Amplitude in mm for which EN 15302 defines the conicity.
const AMPLITUDE: f64 = 3.0;
/// Reach and step in mm of the shifts at which the radius difference is sampled.
const SHIFTS: [f64; 2] = [8.0, 0.1];
/// Number of samples of the wear coefficients.
const SAMPLES: u32 = 2000;

/// The record of a state.
///
/// # Errors
/// The monitor stopped the work.
pub(crate) fn record(
    task: &Evolution,
    state: &EvolutionState,
    states: Vec<StateContact>,
    remarks: Vec<RemarkEntry>,
    monitor: &dyn Monitor,
) -> Result<EvolutionRecord, SolveError> {
    let [rail, wheel] = [0, 1].map(|k| with_uncertainty(task, state, k));
    Ok(EvolutionRecord {
        progress: task.progress(state.share),
        events_done: state.events_done,
        losses: losses(&state.bodies),
        conicity: conicity(task, &state.bodies, monitor)?,
        contact: range(&states),
        states,
        remarks,
        rail,
        wheel,
    })
}

/// Returns the warnings of the states of a traffic, each code once. The sentence and the figures name the first state with this warning, and the
/// share of the traffic that has it.
pub(crate) fn warnings(traffic: &CondensedTraffic, passes: &[Pass]) -> Vec<RemarkEntry> {
    let mut found: Vec<(RemarkEntry, usize, f64)> = Vec::new();
    for (k, pass) in passes.iter().enumerate() {
        let (share, mut own) = (traffic.states[k].share, BTreeSet::new());
        for remark in &pass.remarks {
            if remark.severity != Severity::Warning || !own.insert(&remark.code) {
                continue;
            }
            match found.iter_mut().find(|known| known.0.code == remark.code) {
                Some(known) => known.2 += share,
                None => found.push((remark.clone(), k, share)),
            }
        }
    }
    let of_traffic = |(mut remark, state, share): (RemarkEntry, usize, f64)| {
        let names = traffic.pointers.iter().map(|pointer| {
            let name = pointer.rsplit('/').next();
            name.unwrap_or_default()
        });
        let values = names.zip(&traffic.states[state].values);
        let values: Vec<String> = values
            .map(|(name, v)| format!("{name} {}", short(v)))
            .collect();
        remark.detail = format!(
            "state {state} ({}), {} % of the traffic in all: {}",
            values.join(", "),
            percent(share),
            remark.detail
        );
        (remark.patch, remark.point) = (None, None);
        remark.also_at_points.clear();
        remark.pointer = remark.pointer.map(|pointer| format!("/template{pointer}"));
        let figures = [("state", state as f64), ("traffic_share", share)];
        let figures = figures.map(|(name, value)| (name.to_owned(), Figure::Number(value)));
        remark.figures.extend(figures);
        remark
    };
    found.into_iter().map(of_traffic).collect()
}

fn with_uncertainty(task: &Evolution, state: &EvolutionState, k: usize) -> WornBody {
    let body = &state.bodies[k];
    let worn = body.worn.worn_area_mm2;
    let over = |area: f64| if worn > 0.0 { area / worn } else { 0.0 };
    let lengths = lengths(&body.worn.points_mm);
    let changed = body.step_change_mm.iter().zip(lengths);
    WornBody {
        uncertainty: WearUncertainty {
            steps: over(changed.map(|(depth, length)| depth.abs() * length).sum()),
            states: if worn > 0.0 {
                state.traffic.error[k]
            } else {
                0.0
            },
            contact: over(body.contact_mm2),
            coefficients: coefficients(task, &body.regimes_mm2),
        },
        ..body.worn.clone()
    }
}

/// Factors of the worn area that bound 90 % of the samples of the wear coefficients.
///
/// Archard's coefficients are sampled within their ranges, uniformly in their logarithm and independently in each regime, at the points of Halton's
/// sequence. The wear map has no published scatter, so that its factor is given in the plan. The sections are those of the mean coefficients.
fn coefficients(task: &Evolution, areas: &[f64; 3]) -> [f64; 2] {
    let all: f64 = areas.iter().sum();
    if task.plan.wear_model != DamageModel::ArchardWear || all <= 0.0 {
        let factor = task.plan.coefficient_factor;
        return [1.0 / factor, factor];
    }
    let figures = task.figures.archard;
    let ranges = [figures.mild, figures.severe, figures.seizure];
    let mut samples: Vec<f64> = (1..=SAMPLES)
        .map(|k| {
            let places = [2, 3, 5].map(|base| halton(k, base));
            let part = |r: usize| areas[r] * (ranges[r][1] / ranges[r][0]).powf(places[r] - 0.5);
            (0..3).map(part).sum::<f64>() / all
        })
        .collect();
    samples.sort_by(f64::total_cmp);
    [0.05, 0.95].map(|share| samples[(share * f64::from(SAMPLES - 1)).round() as usize])
}

fn losses(bodies: &[BodyState; 2]) -> WearLosses {
    let [rail, wheel] = bodies;
    let loss = |body: &BodyState, from: [f64; 2], direction: [f64; 2]| {
        let now = distance(&body.worn.points_mm, from, direction);
        Some(now? - distance(&body.start_mm, from, direction)?)
    };
    let [top, _] = bounds(rail.start_mm.iter().map(|at| at[1]));
    // W2 is measured at the gauge face.
    let gauge = [-1e3, top + GAUGE_HEIGHT];
    let face = distance(&rail.start_mm, gauge, [1.0, 0.0]);
    let below = [0.0, 1e3];
    let tread = distance(&wheel.start_mm, below, [0.0, -1.0]);
    WearLosses {
        height_mm: loss(rail, [0.0, top - 1e3], [0.0, 1.0]),
        gauge_face_mm: loss(rail, gauge, [1.0, 0.0]),
        gauge_corner_mm: face.and_then(|y| loss(rail, [y - 1e3, top], [FRAC_1_SQRT_2; 2])),
        tread_mm: loss(wheel, below, [0.0, -1.0]),
        flange_mm: tread.and_then(|off| loss(wheel, [0.0, 1e3 - off + FLANGE_DEPTH], [-1.0, 0.0])),
    }
}

/// The conicity at [`AMPLITUDE`] of a track with these sections on both sides; `None` if it has none.
fn conicity(
    task: &Evolution,
    bodies: &[BodyState; 2],
    monitor: &dyn Monitor,
) -> Result<Option<f64>, SolveError> {
    let Some(mut rails) = pair_of_rails(task, bodies) else {
        return Ok(None);
    };
    let [reach, step] = SHIFTS;
    let asked = KinematicsTask {
        reach,
        step,
        amplitudes: Vec::new(),
    };
    match level_radii(&mut rails, &asked, monitor) {
        Ok(radii) => Ok(radii.conicity(AMPLITUDE).ok().map(|found| found.conicity)),
        Err(SolveError::NormalProblem { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn pair_of_rails(task: &Evolution, bodies: &[BodyState; 2]) -> Option<PairOfRails> {
    let profile = |body: Body, own: &BodyState| {
        let reading = Reading {
            mirror_y: Some(false),
            mirror_z: Some(false),
            smoothing: 0.0,
        };
        Profile::new(body, &own.worn.points_mm, reading).ok()
    };
    let rail = profile(Body::Rail, &bodies[0])?;
    let wheel = profile(Body::Wheel, &bodies[1])?;
    let on = |side: Side| {
        let placement = Placement {
            rail: RailPlace::Origin(task.geometry.rail_origin()),
            side,
            ..task.geometry.placement
        };
        WheelRail::new(rail.clone(), wheel.clone(), placement).ok()
    };
    Some(PairOfRails::new([on(Side::Left)?, on(Side::Right)?]))
}

fn range(states: &[StateContact]) -> ContactRange {
    let mut range = ContactRange::default();
    for state in states {
        if state.failure.is_some() {
            range.unsolved_share += state.share;
            continue;
        }
        let pressures = state.patches.iter().map(|patch| patch.pressure_max_mpa);
        let pressure = pressures.fold(0.0, f64::max);
        range.pressure_max_mpa = range.pressure_max_mpa.max(pressure);
        range.y_over_q_max = range.y_over_q_max.max(state.y_over_q);
        range.pressure_mean_mpa += state.share * pressure;
        range.y_over_q_mean += state.share * state.y_over_q;
        let t_gamma: f64 = state.patches.iter().map(|patch| patch.t_gamma_n).sum();
        range.t_gamma_mean_n += state.share * t_gamma;
    }
    let solved = 1.0 - range.unsolved_share;
    if solved > 0.0 {
        range.pressure_mean_mpa /= solved;
        range.y_over_q_mean /= solved;
        range.t_gamma_mean_n /= solved;
    }
    range
}

impl Evolution {
    /// The answer of a finished evolution, from all its records.
    pub fn answer(&self, state: &EvolutionState, records: Vec<EvolutionRecord>) -> EvolutionAnswer {
        EvolutionAnswer {
            limits: self.limits_reached(&records),
            traffic: state.traffic.clone(),
            steps: state.steps,
            steps_rejected: state.rejected,
            solves: state.solves,
            damage_parameters: self.figures.clone(),
            remarks: self.remarks(state, &records),
            records,
        }
    }

    fn remarks(&self, state: &EvolutionState, records: &[EvolutionRecord]) -> Vec<RemarkEntry> {
        let largest = |of: fn(&ContactRange) -> f64| {
            let all = records.iter().map(|record| of(&record.contact));
            all.fold(0.0, f64::max)
        };
        let largest_mpa = largest(|c| c.pressure_max_mpa);
        let hardness_mpa = self.figures.hardness_mpa;
        let unsolved_share = largest(|c| c.unsolved_share);
        let traffic_error = state.traffic.error[0].max(state.traffic.error[1]);
        let tolerance_asked = self.plan.accuracy.states_tolerance;
        let factor = self.plan.coefficient_factor;
        let ended_early = state.ended_early.clone();
        let found = [
            (self.plan.wear_model != DamageModel::ArchardWear)
                .then_some(Remark::CoefficientScatterStated { factor }),
            (largest_mpa > hardness_mpa).then_some(Remark::PressureAboveHardness {
                largest_mpa,
                hardness_mpa,
            }),
            (traffic_error > tolerance_asked).then_some(Remark::TrafficCoarse {
                traffic_error,
                tolerance_asked,
            }),
            (unsolved_share > 0.0).then_some(Remark::StatesUnsolved { unsolved_share }),
            ended_early.map(|reason| Remark::EvolutionEndedEarly {
                reason,
                done_share: state.share,
            }),
        ];
        let own = found.into_iter().flatten().map(RemarkEntry::from);
        let mut all: Vec<RemarkEntry> = own.collect();
        for (k, record) in records.iter().enumerate() {
            for remark in &record.remarks {
                if all.iter().all(|known| known.code != remark.code) {
                    let mut remark = remark.clone();
                    remark.detail = format!("record {k}, {}", remark.detail);
                    all.push(remark);
                }
            }
        }
        all
    }

    fn limits_reached(&self, records: &[EvolutionRecord]) -> Vec<LimitReached> {
        let limits = self.plan.limits.named().into_iter().enumerate();
        let reached = limits.filter_map(|(k, (name, limit))| {
            let limit_mm = limit?;
            let at = |factor: &dyn Fn(&WearUncertainty) -> f64| {
                // Between two records at the same time, maintenance removes a known depth of material.
                let (mut machined, mut last) = (0.0, None);
                let losses = records.iter().filter_map(|record| {
                    let body = if k < 3 { &record.rail } else { &record.wheel };
                    let (_, loss) = record.losses.named()[k];
                    let (share, loss) = (record.progress.share, loss?);
                    if let Some((at, before)) = last.replace((share, loss))
                        && at == share
                    {
                        machined += loss - before;
                    }
                    let worn = (loss - machined) * factor(&body.uncertainty);
                    Some([share, machined + worn])
                });
                let losses: Vec<[f64; 2]> = losses.collect();
                crossing(&losses, limit_mm).map(|share| self.progress(share))
            };
            let open = |own: &WearUncertainty| own.steps.hypot(own.states).hypot(own.contact);
            Some(LimitReached {
                loss: name.to_owned(),
                limit_mm,
                reached: at(&|_| 1.0),
                earliest: at(&|own| own.coefficients[1] * (1.0 + open(own))),
                latest: at(&|own| own.coefficients[0] * (1.0 - open(own)).max(0.0)),
            })
        });
        reached.collect()
    }
}

/// The abscissa at which a line through points first reaches a limit.
fn crossing(points: &[[f64; 2]], limit: f64) -> Option<f64> {
    let pair = points.windows(2).find(|pair| pair[1][1] >= limit)?;
    let [[from, low], [to, high]] = [pair[0], pair[1]];
    if low >= limit {
        return Some(from);
    }
    Some(from + (to - from) * (limit - low) / (high - low))
}
