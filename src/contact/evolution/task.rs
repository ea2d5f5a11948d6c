//! A checked evolution.

use std::sync::Arc;

use serde_json::{Value, json};

use crate::contact;
use crate::contact::case::known_pair::KnownPair;
use crate::contact::case::limits::Limits;
use crate::contact::case::read::evolution::EvolutionDraft;
use crate::contact::case::read::object::join;
use crate::contact::case::wheel_task::profile_at;
use crate::contact::case::words::evolution::EvolutionWords;
use crate::contact::error::{CaseError, Fault};
use crate::contact::evaluate::many::task::several_answers;
use crate::contact::evaluate::placing::{members, put};
use crate::contact::evolution::section::sampled;
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::normal_task::NormalTask;
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

/// Sections that an event leaves, rail and wheel.
pub type Machined = [Option<Vec<[f64; 2]>>; 2];

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
    pub machined: Vec<Machined>,
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
        let values: Vec<f64> = columns.iter().map(|column| column[0]).collect();
        let first = filled(&template, &pointers, &values, None)
            .and_then(|case| contact::check(&case, limits))
            .map_err(|error| located(error, &pointers, 0))?;
        let (NormalTask::Wheel(wheel), Some(damage)) =
            (&first.problem.task, &first.run.after.damage)
        else {
            return Err(CaseError(vec![Fault::new(
                "/template/contact/type",
                "\"profiles\" is needed",
            )]));
        };
        let cost = first.cost();
        // That of the case contains the revision of the solver.
        let mut digest = blake3::Hasher::new();
        digest.update(first.label.digest.as_bytes());
        digest.update(value.to_string().as_bytes());
        let all: f64 = draft.passes.iter().sum();
        let mut evolution = Evolution {
            shares: draft.passes.iter().map(|passes| passes / all).collect(),
            machined: machined(&draft.plan)?,
            geometry: wheel.geometry.clone(),
            figures: damage.used(),
            amounts: [0.0; 2],
            mgt: 0.0,
            limits: *limits,
            digest: digest.finalize().to_hex().to_string(),
            memory_bytes: cost.own_bytes(),
            state_seconds: cost.seconds,
            template,
            pointers,
            columns,
            plan: draft.plan,
        };
        evolution.place_rail();
        evolution.check_rows()?;
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

    /// Checks of each column the rows with the least and the largest value, and the first row with the friction of each event.
    fn check_rows(&self) -> Result<(), CaseError> {
        let known = KnownPair::default();
        let [rail, wheel] = self.start();
        let friction = self
            .plan
            .events
            .iter()
            .map(|event| (0, event.friction_coefficient));
        let ends = self.columns.iter().flat_map(|column| {
            let by = |a: &usize, b: &usize| column[*a].total_cmp(&column[*b]);
            let rows = 0..column.len();
            [rows.clone().min_by(by), rows.max_by(by)]
        });
        for (row, friction) in ends.flatten().map(|row| (row, None)).chain(friction) {
            let values: Vec<f64> = self.columns.iter().map(|column| column[row]).collect();
            self.case([&rail, &wheel], &values, friction, 0.0)
                .and_then(|case| contact::check_with(&known, &case, &self.limits))
                .and_then(|checked| match several_answers(&checked) {
                    Some(fault) => Err(CaseError(vec![fault])),
                    None => Ok(()),
                })
                .map_err(|error| located(error, &self.pointers, row))?;
        }
        Ok(())
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
        let distance = extent.wheel_distance_km.unwrap_or(0.0) * 1e6;
        let [rail, wheel] = self.plan.wearing.flags();
        self.amounts = [
            if rail { axles } else { 0.0 },
            if wheel { distance } else { 0.0 },
        ];
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
        self.plan.events[event].at / self.plan.end()
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
        let mut case = filled(&self.template, &self.pointers, values, friction)?;
        for (body, points) in [("rail", rail), ("wheel", wheel)] {
            case["contact"][body] =
                json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
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
    let fault = |place: &str, detail: &str| {
        Err(CaseError(vec![Fault::new(
            format!("/template{place}"),
            detail,
        )]))
    };
    if template
        .pointer("/contact/type")
        .is_none_or(|kind| kind != "profiles")
    {
        return fault(
            "/contact/type",
            "\"profiles\" is needed, whose sections wear",
        );
    }
    for body in ["rail", "wheel"] {
        if template["contact"][body]["smoothing_mm"].is_string() {
            let detail = "\"auto\" given; a length in mm is needed, since the sections change";
            return fault(&format!("/contact/{body}/smoothing_mm"), detail);
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

/// The template with the values of a row and another coefficient of friction.
fn filled(
    template: &Value,
    pointers: &[String],
    values: &[f64],
    friction: Option<f64>,
) -> Result<Value, CaseError> {
    let mut case = template.clone();
    let columns = pointers
        .iter()
        .map(String::as_str)
        .zip(values.iter().copied());
    for (pointer, value) in columns.chain(friction.map(|mu| ("/friction/coefficient", mu))) {
        put(&mut case, &members(pointer), value.into())
            .map_err(|reason| CaseError(vec![Fault::new(pointer, reason)]))?;
    }
    Ok(case)
}

/// Faults of the case of a row, with pointers into the evolution.
fn located(CaseError(faults): CaseError, pointers: &[String], row: usize) -> CaseError {
    let moved = faults.into_iter().map(|fault| {
        let pointer = match pointers.contains(&fault.pointer) {
            true => format!("{}/{row}", join("/traffic/columns", &fault.pointer)),
            false => format!("/template{}", fault.pointer),
        };
        Fault { pointer, ..fault }
    });
    CaseError(moved.collect())
}

/// Sections that the events leave, rail and wheel.
fn machined(plan: &EvolutionWords) -> Result<Vec<Machined>, CaseError> {
    let mut faults = Vec::new();
    let events = plan.events.iter().enumerate().map(|(k, event)| {
        if event.at > plan.end() {
            let detail = format!(
                "{} given; at most {}, where the extent ends, is allowed",
                event.at,
                plan.end()
            );
            faults.push(Fault::new(format!("/events/{k}/at"), detail));
        }
        let bodies = [
            (Body::Rail, &event.grind, "grind"),
            (Body::Wheel, &event.reprofile, "reprofile"),
        ];
        bodies.map(|(body, section, name)| {
            let found = profile_at(&format!("/events/{k}/{name}"), body, section.as_ref()?);
            let found = found.map_err(|fault| faults.push(fault)).ok()?;
            Some(sampled(&found, SPACING))
        })
    });
    let machined = events.collect();
    match faults.is_empty() {
        true => Ok(machined),
        false => Err(CaseError(faults)),
    }
}
