//! A checked evolution.

use std::sync::Arc;

use serde_json::{Value, json};

use crate::contact;
use crate::contact::case::known_pair::KnownPair;
use crate::contact::case::limits::Limits;
use crate::contact::case::read::evolution::EvolutionDraft;
use crate::contact::case::wheel_task::profile_at;
use crate::contact::case::words::damage::DamageWords;
use crate::contact::case::words::evolution::EvolutionWords;
use crate::contact::error::{CaseError, Fault};
use crate::contact::evaluate::many::task::several_answers;
use crate::contact::evaluate::placing::{members, put};
use crate::contact::evolution::section::sampled;
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::post::damage::figures::DamageTask;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::words::damage::DamageFiguresUsed;
use crate::contact::solution::words::evolution::Progress;

/// Distance of the points of the sections in mm: a twentieth of a narrow patch, and what measured sections have at the gauge corner.
pub const SPACING: f64 = 0.25;
/// Steps of an evolution of usual length.
const STEPS_USUAL: f64 = 50.0;
/// Target of the contacts' forces where the template has none: wear coefficients are known far less well.
const TARGET: f64 = 0.02;
/// Wheel load in N of a million gross tonnes on an axle with one wheel of that load on each rail.
const NEWTONS_PER_MGT: f64 = 1e9 * 9.80665 / 2.0;

/// State shared by the solves of an evolution.
#[derive(Debug, Default)]
pub struct SolveContext {
    /// Threads that solve the states of a step, the calling one included; 0 counts as 1.
    pub threads: usize,
    /// Operators of patches of one shape.
    pub operators: Arc<OperatorStore>,
    /// Profiles that were read last.
    pub known: Arc<KnownPair>,
}

/// A checked evolution.
#[derive(Debug, Clone)]
pub struct Evolution {
    /// A case whose sections and traffic are put in.
    template: Value,
    /// Places of the columns.
    pub pointers: Vec<String>,
    /// Their values, column by column.
    pub columns: Vec<Vec<f64>>,
    /// Shares of the rows, their sum 1.
    pub shares: Vec<f64>,
    /// The plan.
    pub plan: EvolutionWords,
    /// Sections that events leave, rail and wheel, in the order of the events.
    pub machined: Vec<[Option<Vec<[f64; 2]>>; 2]>,
    /// Rail and wheel at the start.
    pub geometry: WheelRail,
    /// Figures of wear and damage.
    pub figures: DamageFiguresUsed,
    /// Axles, and distance of the wheel in mm, over the extent.
    pub amounts: [f64; 2],
    /// Million gross tonnes over the extent.
    mgt: f64,
    limits: Limits,
    digest: String,
    /// Of a state.
    memory_bytes: u64,
    state_seconds: f64,
}

impl Evolution {
    /// Checks an evolution whose columns are named by JSON pointers into the template.
    ///
    /// # Errors
    /// Every fault, with its JSON pointer.
    pub fn check(value: &Value, limits: &Limits) -> Result<Evolution, CaseError> {
        let draft = EvolutionDraft::read(value)?;
        let template = template(&draft)?;
        let (pointers, columns): (Vec<String>, Vec<Vec<f64>>) = draft.columns.into_iter().unzip();
        let all: f64 = draft.passes.iter().sum();
        let mut evolution = Evolution {
            template,
            pointers,
            columns,
            shares: draft.passes.iter().map(|passes| passes / all).collect(),
            plan: draft.plan,
            machined: Vec::new(),
            geometry: first_geometry(&draft.template, limits)?,
            figures: DamageTask::new(&DamageWords {
                models: Vec::new(),
                parameters: None,
                across: true,
            })
            .used(),
            amounts: [0.0; 2],
            mgt: 0.0,
            limits: *limits,
            digest: String::new(),
            memory_bytes: 0,
            state_seconds: 0.0,
        };
        evolution.place_rail();
        let first = evolution.check_rows(limits)?;
        if let Some(damage) = &first.run.after.damage {
            evolution.figures = damage.used();
        }
        let cost = first.cost();
        (evolution.memory_bytes, evolution.state_seconds) = (cost.own_bytes(), cost.seconds);
        // That of the case contains the revision of the solver.
        let mut digest = blake3::Hasher::new();
        digest.update(first.label.digest.as_bytes());
        digest.update(value.to_string().as_bytes());
        evolution.digest = digest.finalize().to_hex().to_string();
        evolution.read_events()?;
        evolution.weigh()?;
        Ok(evolution)
    }

    /// The rail stays where its gauge puts it at the start, and the wheel on its flange back, however they wear.
    fn place_rail(&mut self) {
        let contact = &mut self.template["contact"];
        if let Some(contact) = contact.as_object_mut() {
            contact.remove("gauge_mm");
            contact.remove("gauge_height_mm");
        }
        contact["rail_origin_mm"] = self.geometry.rail_origin().into();
        contact["flange_back_position_mm"] = self.geometry.placement.flange_back_position.into();
    }

    /// Checks the first row, and of each column the rows with the least and the largest value.
    fn check_rows(&self, limits: &Limits) -> Result<CheckedCase, CaseError> {
        let known = KnownPair::default();
        let [rail, wheel] = self.start();
        let mut rows = vec![0];
        for column in &self.columns {
            let by = |a: &usize, b: &usize| column[*a].total_cmp(&column[*b]);
            rows.extend((0..column.len()).min_by(by));
            rows.extend((0..column.len()).max_by(by));
        }
        let mut first = None;
        let friction = self
            .plan
            .events
            .iter()
            .map(|event| event.friction_coefficient);
        let rows = rows.into_iter().map(|row| (row, None));
        let rows = rows.chain(friction.flatten().map(|friction| (0, Some(friction))));
        for (row, friction) in rows {
            let values: Vec<f64> = self.columns.iter().map(|column| column[row]).collect();
            let case = self.case([&rail, &wheel], &values, friction, 0.0);
            let checked = case.and_then(|case| contact::check_with(&known, &case, limits));
            let checked = checked.map_err(|CaseError(faults)| {
                let own = |fault: &Fault| self.pointers.iter().position(|p| *p == fault.pointer);
                let moved = faults.into_iter().map(|fault| {
                    let pointer = match own(&fault) {
                        Some(k) => {
                            let name = self.pointers[k].replace('~', "~0").replace('/', "~1");
                            format!("/traffic/columns/{name}/{row}")
                        }
                        None => format!("/template{}", fault.pointer),
                    };
                    Fault { pointer, ..fault }
                });
                CaseError(moved.collect())
            })?;
            if let Some(fault) = several_answers(&checked) {
                let pointer = format!("/template{}", fault.pointer);
                return Err(CaseError(vec![Fault { pointer, ..fault }]));
            }
            first.get_or_insert(checked);
        }
        first.ok_or_else(|| CaseError(vec![Fault::new("/traffic/columns", "there are no rows")]))
    }

    fn read_events(&mut self) -> Result<(), CaseError> {
        let (mut faults, mut machined) = (Vec::new(), Vec::new());
        let end = self.end();
        for (k, event) in self.plan.events.iter().enumerate() {
            if event.at > end {
                let detail = format!(
                    "{} given; at most {end}, where the extent ends, is allowed",
                    event.at
                );
                faults.push(Fault::new(format!("/events/{k}/at"), detail));
            }
            let bodies = [
                (Body::Rail, &event.grind, "grind"),
                (Body::Wheel, &event.reprofile, "reprofile"),
            ];
            machined.push(bodies.map(|(body, section, name)| {
                let section = section.as_ref()?;
                match profile_at(&format!("/events/{k}/{name}"), body, section) {
                    Ok(profile) => Some(sampled(&profile, SPACING)),
                    Err(fault) => {
                        faults.push(fault);
                        None
                    }
                }
            }));
        }
        self.machined = machined;
        match faults.is_empty() {
            true => Ok(()),
            false => Err(CaseError(faults)),
        }
    }

    /// The extent in the unit that events are given in.
    fn end(&self) -> f64 {
        let extent = &self.plan.extent;
        let rail = extent.mgt.or(extent.axle_passes);
        rail.or(extent.wheel_distance_km).unwrap_or(0.0)
    }

    /// Axles and tonnes over the extent.
    fn weigh(&mut self) -> Result<(), CaseError> {
        let place = "/load/vertical_force_n";
        let column = self.pointers.iter().position(|pointer| pointer == place);
        let fixed = self.template.pointer(place).and_then(Value::as_f64);
        let load = |row: usize| column.map(|k| self.columns[k][row]).or(fixed);
        let mean: Option<f64> = self
            .shares
            .iter()
            .enumerate()
            .map(|(row, share)| Some(share * load(row)?))
            .sum();
        let extent = &self.plan.extent;
        let axles = match (extent.mgt, extent.axle_passes, mean) {
            (Some(mgt), _, Some(mean)) => mgt * NEWTONS_PER_MGT / mean,
            (Some(_), _, None) => {
                let detail = "given for a traffic without vertical_force_n; give axle_passes";
                return Err(CaseError(vec![Fault::new("/extent/mgt", detail)]));
            }
            (None, axles, _) => axles.unwrap_or(0.0),
        };
        self.mgt = axles * mean.unwrap_or(0.0) / NEWTONS_PER_MGT;
        self.amounts = [axles, extent.wheel_distance_km.unwrap_or(0.0) * 1e6];
        Ok(())
    }

    /// Hexadecimal digest of the evolution and of the solver.
    #[must_use]
    pub fn digest(&self) -> String {
        self.digest.clone()
    }

    /// Memory in bytes that one thread takes to solve a state.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// Rough solve time in s on one core: two solves of each state for each step that the records need.
    #[must_use]
    pub fn expected_seconds(&self) -> f64 {
        let states = self
            .shares
            .len()
            .min(self.plan.accuracy.states_max as usize);
        2.0 * states as f64 * f64::from(self.plan.records).max(STEPS_USUAL) * self.state_seconds
    }

    /// Rail and wheel at the start.
    #[must_use]
    pub fn start(&self) -> [Vec<[f64; 2]>; 2] {
        self.geometry
            .profiles()
            .map(|profile| sampled(profile, SPACING))
    }

    /// Share of the extent at which an event happens.
    #[must_use]
    pub fn share_of_event(&self, event: usize) -> f64 {
        self.plan.events[event].at / self.end()
    }

    /// How far an evolution has come at a share of its extent.
    #[must_use]
    pub fn progress(&self, share: f64) -> Progress {
        let [rail, wheel] = self.plan.wearing.flags();
        Progress {
            share,
            mgt: (rail && self.mgt > 0.0).then_some(share * self.mgt),
            axle_passes: rail.then_some(share * self.amounts[0]),
            wheel_distance_km: wheel.then_some(share * self.amounts[1] * 1e-6),
        }
    }

    /// The case of these values on these sections, with another coefficient of friction and a wheel whose radius has changed by `radius` mm.
    ///
    /// # Errors
    /// A column leads nowhere in the template.
    pub fn case(
        &self,
        [rail, wheel]: [&[[f64; 2]]; 2],
        values: &[f64],
        friction: Option<f64>,
        radius: f64,
    ) -> Result<Value, CaseError> {
        let mut case = self.template.clone();
        let section = |points: &[[f64; 2]]| json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
        case["contact"]["rail"] = section(rail);
        case["contact"]["wheel"] = section(wheel);
        let columns = self
            .pointers
            .iter()
            .map(String::as_str)
            .zip(values.iter().copied());
        for (pointer, value) in columns.chain(friction.map(|mu| ("/friction/coefficient", mu))) {
            put(&mut case, &members(pointer), value.into())
                .map_err(|reason| CaseError(vec![Fault::new(pointer, reason)]))?;
        }
        let free = "/motion/wheelset/free_rolling_radius_mm";
        if let Some(value) = case.pointer_mut(free)
            && let Some(given) = value.as_f64()
        {
            *value = (given + radius).into();
        }
        Ok(case)
    }

    /// Checks and prepares a case.
    ///
    /// # Errors
    /// Its faults.
    pub fn checked(&self, context: &SolveContext, case: &Value) -> Result<CheckedCase, CaseError> {
        contact::check_with(&context.known, case, &self.limits)
    }
}

/// The template with the outputs that wear needs.
fn template(draft: &EvolutionDraft) -> Result<Value, CaseError> {
    let mut template = draft.template.clone();
    let fault = |pointer: &str, detail: String| Err(CaseError(vec![Fault::new(pointer, detail)]));
    if !template.is_object() {
        return fault("/template", "an object is needed".to_owned());
    }
    let kind = template
        .pointer("/contact/type")
        .cloned()
        .unwrap_or_default();
    if kind != "profiles" {
        return fault(
            "/template/contact/type",
            format!("{kind} given; \"profiles\" is needed, whose sections wear"),
        );
    }
    for body in ["rail", "wheel"] {
        if template["contact"][body]["smoothing_mm"].is_string() {
            return fault(
                &format!("/template/contact/{body}/smoothing_mm"),
                "\"auto\" given; a length in mm is needed, since the sections change".to_owned(),
            );
        }
    }
    let mut damage =
        json!({ "models": ["t_gamma", draft.plan.wear_model, "wlrm"], "across": true });
    if let Some(own) = template.pointer("/damage/parameters") {
        damage["parameters"] = own.clone();
    }
    template["damage"] = damage;
    template["outputs"] = json!(["resultants", "damage"]);
    if template.get("solver").is_none() {
        template["solver"] = json!({ "target_error": TARGET });
    }
    // The quality of the given points is judged at the first contact only; later points are computed.
    template["contact"]["accept_rough_profiles"] = true.into();
    Ok(template)
}

/// Rail and wheel as the template has them.
fn first_geometry(template: &Value, limits: &Limits) -> Result<WheelRail, CaseError> {
    let mut case = template.clone();
    for (pointer, value) in [
        ("/motion", json!({ "creepage_x": 0.0 })),
        ("/load", json!({ "vertical_force_n": 1e3 })),
    ] {
        put(&mut case, &members(pointer), value)
            .map_err(|reason| CaseError(vec![Fault::new(pointer, reason)]))?;
    }
    for name in ["outputs", "damage", "solver", "thermal", "subsurface"] {
        case.as_object_mut().map(|case| case.remove(name));
    }
    let checked = contact::check(&case, limits).map_err(|CaseError(faults)| {
        let moved = faults.into_iter().map(|fault| Fault {
            pointer: format!("/template{}", fault.pointer),
            ..fault
        });
        CaseError(moved.collect())
    })?;
    match &checked.problem.task {
        NormalTask::Wheel(task) => Ok(task.geometry.clone()),
        _ => Err(CaseError(vec![Fault::new(
            "/template/contact/type",
            "\"profiles\" is needed",
        )])),
    }
}
