//! A checked evolution.

use std::sync::Arc;

use serde_json::{Value, json};

use crate::case::rail_pair::KnownPair;
use crate::case::solver::Limits;
use crate::case::wheel_task::profile_at;
use crate::case::words::evolution::{EvolutionEvent, EvolutionWords, TrafficColumn};
use crate::error::{CaseError, Fault};
use crate::evaluate::many::several_answers;
use crate::evaluate::varied::{column_pointer, in_template, members, put};
use crate::evolution::section::sampled;
use crate::geometry::profile::Body;
use crate::geometry::wheel_rail::WheelRail;
use crate::normal::footprint::NormalTask;
use crate::numerics::quadrature::{PRIMES, samples};
use crate::problem::checked_case;
use crate::rolling::operator_store::OperatorStore;
use crate::solution::words::damage::DamageFiguresUsed;
use crate::solution::words::evolution::Progress;

/// Usual number of steps of an evolution.
const STEPS_USUAL: f64 = 50.0;
/// Default of the target error of forces. Wear coefficients are known far less accurately.
const TARGET: f64 = 0.02;
/// Sum of the wheel loads in N on one rail per million gross tonnes, half of the weight.
const NEWTONS_PER_MGT: f64 = 1e9 * 9.80665 / 2.0;

/// Sections and friction with which a state is solved.
#[derive(Debug, Clone, Copy)]
pub struct Sections<'a> {
    /// Rail and wheel.
    pub points: [&'a [[f64; 2]]; 2],
    /// Coefficient of friction that replaces that of the state.
    pub friction: Option<f64>,
    /// Change of the wheel's radius in mm.
    pub radius: f64,
}

/// An event with the target sections of rail and wheel.
pub type PlannedEvent = (EvolutionEvent, [Option<Vec<[f64; 2]>>; 2]);

/// State shared by the solves of an evolution.
#[derive(Debug, Default)]
pub struct SolveContext {
    /// Number of threads that solve the states of a step, including the calling one. 0 is treated as 1.
    pub threads: usize,
    /// Cache of operators.
    pub operators: Arc<OperatorStore>,
    /// Cache of the last profiles.
    pub known: Arc<KnownPair>,
}

/// A checked evolution.
#[derive(Debug, Clone)]
pub struct Evolution {
    /// A case into which sections and traffic are inserted.
    template: Value,
    /// JSON pointers of the columns.
    pub pointers: Vec<String>,
    /// Their values, column by column.
    pub columns: Vec<Vec<f64>>,
    /// Shares of the rows in the traffic, with the sum 1.
    pub shares: Vec<f64>,
    /// The plan: bodies that wear, extent, limits and accuracy.
    pub plan: EvolutionWords,
    /// The events in order.
    pub events: Vec<PlannedEvent>,
    /// Rail and wheel at the start.
    pub geometry: WheelRail,
    /// Parameters of wear and damage.
    pub figures: DamageFiguresUsed,
    /// Number of axles, and distance of the wheel in mm, over the extent.
    pub amounts: [f64; 2],
    /// Million gross tonnes over the extent.
    mgt: f64,
    /// Limits of the service.
    pub limits: Limits,
    /// Hexadecimal digest of the evolution and the solver.
    pub digest: String,
    /// Memory in bytes that one thread needs to solve a state.
    pub memory_bytes: u64,
    state_seconds: f64,
}

impl Evolution {
    /// Checks an evolution whose columns are named by JSON pointers into the template.
    ///
    /// # Errors
    /// Returns all faults with their JSON pointers.
    pub fn check(value: &Value, limits: &Limits) -> Result<Evolution, CaseError> {
        let mut plan = EvolutionWords::read(value)?;
        let template = template(&plan)?;
        let passes = std::mem::take(&mut plan.traffic.passes);
        let mut bases = PRIMES.into_iter();
        let mut values = |column| match column {
            TrafficColumn::Numbers(values) => values,
            TrafficColumn::Distribution(of) => {
                let normal = of.mean.zip(of.standard_deviation);
                let base = bases.next().unwrap_or(PRIMES[0]);
                samples([of.min, of.max], normal, plan.traffic.samples, base)
            }
        };
        let columns = std::mem::take(&mut plan.traffic.columns).into_iter();
        let columns = columns.map(|(pointer, column)| (pointer, values(column)));
        let (pointers, columns): (Vec<String>, Vec<Vec<f64>>) = columns.unzip();
        let first: Vec<f64> = columns.iter().map(|column| column[0]).collect();
        let first = filled(&template, &pointers, &first, None)
            .and_then(|case| crate::check(&case, limits))
            .map_err(|error| located(error, &pointers, 0, None))?;
        let (NormalTask::Wheel(wheel), Some(damage)) =
            (&first.problem.task, &first.run.after.damage)
        else {
            return Err(not_profiles());
        };
        let cost = first.cost();
        // The digest of the case includes the revision of the solver.
        let mut digest = blake3::Hasher::new();
        digest.update(first.label.digest.as_bytes());
        digest.update(value.to_string().as_bytes());
        let all: f64 = passes.iter().sum();
        let mut evolution = Evolution {
            shares: passes.iter().map(|passes| passes / all).collect(),
            events: events(&mut plan)?,
            geometry: wheel.geometry.clone(),
            figures: damage.figures.clone(),
            amounts: [0.0; 2],
            mgt: 0.0,
            limits: *limits,
            digest: digest.finalize().to_hex().to_string(),
            memory_bytes: cost.own_bytes(),
            state_seconds: cost.seconds,
            template,
            pointers,
            columns,
            plan,
        };
        evolution.place_rail();
        evolution.check_rows()?;
        evolution.weigh()?;
        Ok(evolution)
    }

    /// Fixes the initial positions of the rail by its gauge and of the wheel by its flange back, so that wear does not change them.
    fn place_rail(&mut self) {
        let contact = &mut self.template["contact"];
        for name in ["gauge_mm", "gauge_height_mm"] {
            contact.as_object_mut().map(|contact| contact.remove(name));
        }
        contact["rail_origin_mm"] = self.geometry.rail_origin().into();
        contact["flange_back_position_mm"] = self.geometry.placement.flange_back_position.into();
    }

    /// Checks the rows with the least and the largest value of each column, and the first row with the friction of each event.
    fn check_rows(&self) -> Result<(), CaseError> {
        let known = KnownPair::default();
        let [rail, wheel] = self.start();
        let events = self.events.iter();
        let friction = events.map(|(event, _)| (0, event.friction_coefficient, None));
        let columns = self.columns.iter().zip(&self.pointers);
        let ends = columns.flat_map(|(column, pointer)| {
            let by = |a: &usize, b: &usize| column[*a].total_cmp(&column[*b]);
            let rows = 0..column.len();
            let ends = [rows.clone().min_by(by), rows.max_by(by)];
            ends.map(|row| Some((row?, None, Some(pointer))))
        });
        for (row, friction, tested) in ends.flatten().chain(friction) {
            let values: Vec<f64> = self.columns.iter().map(|column| column[row]).collect();
            let on = Sections {
                points: [&rail, &wheel],
                friction,
                radius: 0.0,
            };
            self.case(on, &values)
                .and_then(|case| crate::check_with(&known, &case, &self.limits))
                .and_then(|checked| several_answers(&checked).map_or(Ok(()), |f| Err(f.into())))
                .map_err(|error| located(error, &self.pointers, row, tested))?;
        }
        Ok(())
    }

    /// Computes axles and tonnes over the extent.
    fn weigh(&mut self) -> Result<(), CaseError> {
        let place = "/load/vertical_force_n";
        let column = self.pointers.iter().position(|pointer| pointer == place);
        let fixed = self.template.pointer(place).and_then(Value::as_f64);
        let load = |row: usize| column.map(|k| self.columns[k][row]).or(fixed);
        let loads = self.shares.iter().enumerate();
        let loads = loads.map(|(row, share)| Some(share * load(row)?));
        let mean: Option<f64> = loads.sum();
        let extent = &self.plan.extent;
        let axles = match (extent.mgt, mean) {
            (None, _) => extent.axle_passes.unwrap_or(0.0),
            (Some(mgt), Some(mean)) => mgt * NEWTONS_PER_MGT / mean,
            (Some(_), None) => {
                let detail = "given for a traffic without vertical_force_n; give axle_passes";
                return Err(Fault::new("/extent/mgt", detail).into());
            }
        };
        self.mgt = axles * mean.unwrap_or(0.0) / NEWTONS_PER_MGT;
        let distance = extent.wheel_distance_km.unwrap_or(0.0) * 1e6;
        let [rail, wheel] = self.plan.wearing.flags();
        let worn = [(rail, axles), (wheel, distance)];
        self.amounts = worn.map(|(wears, amount)| if wears { amount } else { 0.0 });
        Ok(())
    }

    /// Rough estimate of the solve time in s on one core, with two solves of each state per step.
    pub fn expected_seconds(&self) -> f64 {
        let states = f64::from(self.plan.accuracy.states_max).min(self.shares.len() as f64);
        2.0 * states * f64::from(self.plan.records).max(STEPS_USUAL) * self.state_seconds
    }

    /// Rail and wheel at the start.
    pub(crate) fn start(&self) -> [Vec<[f64; 2]>; 2] {
        self.geometry.profiles().map(sampled)
    }

    /// Share of the extent at which an event happens.
    pub(crate) fn share_of_event(&self, event: usize) -> f64 {
        self.events[event].0.at / self.plan.end()
    }

    /// The progress of the evolution at a share of its extent.
    pub(crate) fn progress(&self, share: f64) -> Progress {
        let [rail, wheel] = self.plan.wearing.flags();
        Progress {
            share,
            mgt: (rail && self.mgt > 0.0).then_some(share * self.mgt),
            axle_passes: rail.then_some(share * self.amounts[0]),
            wheel_distance_km: wheel.then_some(share * self.amounts[1] * 1e-6),
        }
    }

    /// The case with these values on these sections.
    ///
    /// # Errors
    /// Returns a fault if a column points nowhere in the template.
    pub(crate) fn case(&self, on: Sections, values: &[f64]) -> Result<Value, CaseError> {
        let mut case = filled(&self.template, &self.pointers, values, on.friction)?;
        for (body, points) in ["rail", "wheel"].into_iter().zip(on.points) {
            case["contact"][body] =
                json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
        }
        let free = "/motion/wheelset/free_rolling_radius_mm";
        if let Some(value) = case.pointer_mut(free)
            && let Some(given) = value.as_f64()
        {
            *value = (given + on.radius).into();
        }
        Ok(case)
    }
}

fn not_profiles() -> CaseError {
    let detail = "\"profiles\" is needed, because its sections wear";
    Fault::new("/template/contact/type", detail).into()
}

/// The fault of a section with a guard rail, which cannot wear.
fn guard_rail(section: &str) -> Fault {
    let detail = "given for an evolution; only a running rail and a wheel wear, leave it out";
    Fault::new(format!("{section}/guard_rail_points_mm"), detail)
}

/// The template with the outputs that wear needs.
fn template(plan: &EvolutionWords) -> Result<Value, CaseError> {
    let mut template = plan.template.clone();
    if template["contact"]["type"] != "profiles" {
        return Err(not_profiles());
    }
    for body in ["rail", "wheel"] {
        if template["contact"][body]["smoothing_mm"].is_string() {
            let pointer = format!("/template/contact/{body}/smoothing_mm");
            let detail = "\"auto\" given; a length in mm is needed, since the sections change";
            return Err(Fault::new(pointer, detail).into());
        }
        if !template["contact"][body]["guard_rail_points_mm"].is_null() {
            return Err(guard_rail(&format!("/template/contact/{body}")).into());
        }
    }
    if template["solver"]["method"] == "table" {
        let detail = "\"table\" given; a method with values per cell is needed, because wear is computed from them";
        return Err(Fault::new("/template/solver/method", detail).into());
    }
    let mut damage = json!({ "models": ["t_gamma", plan.wear_model, "wlrm"], "across": true });
    if let Some(own) = template.pointer("/damage/parameters") {
        damage["parameters"] = own.clone();
    }
    template["damage"] = damage;
    template["outputs"] = json!(["resultants", "damage"]);
    if template.get("solver").is_none() {
        template["solver"] = json!({ "target_error": TARGET });
    }
    // The points of later steps are computed, so that their quality must not make a solve fail.
    template["contact"]["accept_rough_profiles"] = true.into();
    Ok(template)
}

/// The template with the values of a row and another coefficient of friction.
fn filled(
    template: &Value,
    pointers: &[String],
    values: &[f64],
    friction: Option<f64>,
) -> Result<Value, CaseError> {
    let mut case = template.clone();
    let columns = pointers.iter().map(String::as_str);
    let friction = friction.map(|mu| ("/friction/coefficient", mu));
    for (pointer, value) in columns.zip(values.iter().copied()).chain(friction) {
        let put = put(&mut case, &members(pointer), value.into());
        put.map_err(|reason| Fault::new(pointer, reason))?;
    }
    Ok(case)
}

/// Converts the pointers of the faults of a row to pointers into the evolution. A fault outside all columns gets the pointer of the column `tested`.
fn located(
    error: CaseError,
    pointers: &[String],
    row: usize,
    tested: Option<&String>,
) -> CaseError {
    in_template(error, |pointer| {
        let column = pointers.iter().find(|known| *known == pointer).or(tested)?;
        Some(format!("/traffic{}/{row}", column_pointer(column)))
    })
}

/// The events in order, with their target sections.
fn events(plan: &mut EvolutionWords) -> Result<Vec<PlannedEvent>, CaseError> {
    let mut faults = Vec::new();
    let end = plan.end();
    let given = std::mem::take(&mut plan.events).into_iter().enumerate();
    let planned = given.map(|(k, event)| {
        if event.at > end {
            let at = event.at;
            let detail = format!("{at} given; at most {end}, where the extent ends, is allowed");
            faults.push(Fault::new(format!("/events/{k}/at"), detail));
        }
        let bodies = [
            (Body::Rail, &event.grind, "grind"),
            (Body::Wheel, &event.reprofile, "reprofile"),
        ];
        let sections = bodies.map(|(body, section, name)| {
            let (section, pointer) = (section.as_ref()?, format!("/events/{k}/{name}"));
            if section.guard_rail_points_mm.is_some() {
                faults.push(guard_rail(&pointer));
            }
            let found = profile_at(&pointer, body, section);
            let found = found.map_err(|fault| faults.push(fault)).ok()?;
            if let Some(remark) = checked_case::other_body(&found, body) {
                faults.push(Fault::new(pointer, remark.detail()));
            }
            Some(sampled(&found))
        });
        (event, sections)
    });
    let mut planned: Vec<PlannedEvent> = planned.collect();
    planned.sort_by(|(a, _), (b, _)| a.at.total_cmp(&b.at));
    match faults.is_empty() {
        true => Ok(planned),
        false => Err(CaseError(faults)),
    }
}
