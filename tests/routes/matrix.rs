//! Sends every feature of a case through every route. Each answer must agree with that of the case alone, within both estimates.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::evaluate::answer::NUMBER_NAMES;
use railhead_contact::evaluate::many::{ManyTask, evaluate_at_once, solve_many};
use railhead_contact::evaluate::rows::Rows;
use railhead_contact::evaluate::varied::{Values, VariedColumn, case_of_row};
use railhead_contact::monitor::{Monitor, Unmonitored};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Map, Value, json};

use crate::features::{Feature, Motions, ROWS};

/// A way to submit a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Route {
    /// A job with a list of motions.
    List,
    /// A job with a sweep.
    Sweep,
    /// A run.
    Run,
    /// A run with rows that differ only in their motions.
    RunOfMotions,
    /// Rows solved at once by `/v1/evaluate`.
    Evaluate,
    /// Two separate wheels in the positions of those of a wheelset.
    TwoProfiles,
}

/// All routes.
pub const ROUTES: [Route; 6] = [
    Route::List,
    Route::Sweep,
    Route::Run,
    Route::RunOfMotions,
    Route::Evaluate,
    Route::TwoProfiles,
];

/// The expected outcome of a feature on a route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Each answer is that of the case alone.
    Agrees,
    /// The route has no such request.
    Absent,
    /// The request is refused with a message that contains this text.
    Refused(&'static str),
    /// Forces are those of each motion, while patches are listed with the normal force of the first motion.
    SharedPatches,
}

/// An answer in N and N mm.
#[derive(Debug, Clone)]
struct Answer {
    /// `F_x`, `F_y`, `M_z` and the normal force.
    numbers: [f64; 4],
    /// Estimated errors of the numbers, NaN where there is none.
    errors: [f64; 4],
    /// Creepages that were found for prescribed forces.
    creepages: [Option<f64>; 2],
    /// μN, and its product with √(A/π).
    scales: [f64; 2],
}

/// Error of an answer without an estimate, relative to μN. Such an answer is solved to a residual on a given mesh.
const WITHOUT_ESTIMATE: f64 = 1e-3;
/// Rounding, relative to the normal force.
const ROUNDING: f64 = 1e-6;
/// Allowed difference of the normal forces of patches that are found, relative to themselves.
const NORMAL: f64 = 2e-3;
/// Relative error of a creepage over the relative error of the force that prescribes it, for forces up to half the limit.
const CREEPAGE: f64 = 5.0;

/// The result of the matrix: a line for each feature, and failures.
#[derive(Debug, Default)]
pub struct Shown {
    pub lines: String,
    pub wrong: Vec<String>,
    /// The largest difference over the sum of both estimates.
    pub worst: f64,
    pub compared: usize,
}

impl Shown {
    /// Returns the matrix as a table.
    pub fn table(&self) -> String {
        let titles = ROUTES.map(|route| format!("{route:?}")).join(" | ");
        let mut text = format!(
            "| feature | {titles} |\n|{}\n{}",
            "---|".repeat(1 + ROUTES.len()),
            self.lines
        );
        let _ = writeln!(
            text,
            "\n{} answers compared with the case alone; largest difference over the sum of both estimates: {:.2}.\n",
            self.compared, self.worst
        );
        for why in &self.wrong {
            let _ = writeln!(text, "- {why}");
        }
        text
    }
}

/// Sends features through all routes.
pub fn matrix(features: &[Feature]) -> Shown {
    let mut shown = Shown::default();
    for feature in features {
        let _ = write!(shown.lines, "| {}", feature.name);
        let mut alone = Alone::new(feature);
        for route in ROUTES {
            let expected = feature.expected(route);
            let word = match checked(feature, &mut alone, route, expected) {
                Ok(None) => "–".to_owned(),
                Ok(Some((count, worst))) => {
                    shown.compared += count;
                    shown.worst = shown.worst.max(worst);
                    match count {
                        0 => "no numbers".to_owned(),
                        _ => format!("{worst:.2}"),
                    }
                }
                Err(why) => {
                    shown
                        .wrong
                        .push(format!("{}, {route:?}: {why}", feature.name));
                    "WRONG".to_owned()
                }
            };
            let _ = write!(shown.lines, " | {word}");
        }
        shown.lines.push_str(" |\n");
    }
    shown
}

/// Compares a route with the cases alone. Returns the number of answers, and the largest difference over both estimates.
fn checked(
    feature: &Feature,
    alone: &mut Alone,
    route: Route,
    expected: Expected,
) -> Result<Option<(usize, f64)>, String> {
    if expected == Expected::Absent {
        return Ok(None);
    }
    let found = through(feature, route);
    match (expected, found) {
        (Expected::Refused(words), Err(why)) => match why.contains(words) {
            true => Ok(Some((0, 0.0))),
            false => Err(format!("`{words}` is not in: {why}")),
        },
        (Expected::Refused(_), Ok(_)) => {
            Err("answered, although it is on the list of refused combinations".to_owned())
        }
        (_, Err(why)) => match alone.is_refused_alike(&why, route) {
            true => Ok(Some((0, 0.0))),
            false => Err(format!("refused: {why}")),
        },
        (_, Ok(rows)) => {
            let with_columns = match route {
                Route::List | Route::Sweep => feature.motions == Motions::Wheelset,
                Route::RunOfMotions => false,
                _ => true,
            };
            let mut worst: f64 = 0.0;
            for (row, found) in rows.iter().enumerate() {
                let Some(found) = found else {
                    return Err(format!("row {row} has no answer"));
                };
                let mut found = found.clone();
                let known = alone.answer(row, with_columns)?;
                if expected == Expected::SharedPatches {
                    found.numbers[3] = known.numbers[3];
                }
                let off = compare(&found, &known).map_err(|why| format!("row {row}: {why}"))?;
                worst = worst.max(off);
            }
            Ok(Some((rows.len(), worst)))
        }
    }
}

/// Returns the largest difference of two answers over the sum of their estimates.
fn compare(found: &Answer, known: &Answer) -> Result<f64, String> {
    let [limit, moment] = known.scales;
    let scales = [limit, limit, moment, known.numbers[3]];
    let mut worst: f64 = 0.0;
    for k in 0..4 {
        let [a, b] = [found, known].map(|answer| answer.numbers[k]);
        let error = |answer: &Answer| match (k, answer.errors[k].is_nan()) {
            (3, _) => NORMAL * scales[3],
            (_, true) => WITHOUT_ESTIMATE * scales[k],
            _ => answer.errors[k],
        };
        // The lateral force of a wheel includes a component of the normal forces, which exists also without friction.
        let rounding = ROUNDING * scales[k].max(known.numbers[3]);
        let allowed = error(found) + error(known) + rounding;
        let off = (a - b).abs();
        if off.is_nan() || off > allowed {
            let name = ["F_x", "F_y", "M_z", "N"][k];
            return Err(format!("{name} is {a}, alone {b}, ± {allowed}"));
        }
        worst = worst.max(if allowed > 0.0 { off / allowed } else { 0.0 });
    }
    for k in 0..2 {
        let (Some(a), Some(b)) = (found.creepages[k], known.creepages[k]) else {
            continue;
        };
        let uncertain = (found.errors[k] + known.errors[k]).max(2.0 * ROUNDING * limit);
        let allowed = CREEPAGE * uncertain / known.numbers[k].abs() * b.abs();
        let off = (a - b).abs();
        if off.is_nan() || off > allowed {
            return Err(format!("creepage {k} is {a}, alone {b}, ± {allowed}"));
        }
    }
    Ok(worst)
}

/// The cases of the rows, each solved alone on first use.
struct Alone<'a> {
    feature: &'a Feature,
    known: BTreeMap<(usize, bool), Answer>,
}

impl Alone<'_> {
    fn new(feature: &Feature) -> Alone<'_> {
        Alone {
            feature,
            known: BTreeMap::new(),
        }
    }

    fn answer(&mut self, row: usize, with_columns: bool) -> Result<Answer, String> {
        let key = (row, with_columns && !self.feature.columns.is_empty());
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let case = self.feature.case_of_row(row, with_columns);
        let answer = answers(&solved(&case).map_err(|why| format!("alone: {why}"))?)
            .into_iter()
            .next()
            .ok_or("alone: no answer")?;
        self.known.insert(key, answer.clone());
        Ok(answer)
    }
}

impl Alone<'_> {
    /// Returns whether one of the cases alone is refused for the same reason, apart from its numbers. Evaluated rows report only that they have no
    /// answer.
    fn is_refused_alike(&mut self, why: &str, route: Route) -> bool {
        let words =
            |text: &str| text.replace(|c: char| c.is_ascii_digit() || "+-.".contains(c), "");
        let keys = (0..ROWS).flat_map(|row| [(row, false), (row, true)]);
        keys.into_iter().any(|(row, with_columns)| {
            let refusal = self.answer(row, with_columns).err();
            refusal.is_some_and(|refusal| {
                let is_row = why.starts_with(&format!("row {row} is "));
                route == Route::Evaluate && is_row || words(&refusal).ends_with(&words(why))
            })
        })
    }
}

/// Solves a case as a job does.
fn solved(case: &Value) -> Result<Solution, String> {
    let checked = contact::check(case, &Limits::default()).map_err(|error| error.to_string())?;
    let solved = contact::solve_with(&Arc::new(OperatorStore::default()), &checked, &Unmonitored);
    solved
        .map(|(solution, _)| solution)
        .map_err(|error| error.to_string())
}

/// Returns the answers of a solution, motion by motion.
fn answers(solution: &Solution) -> Vec<Answer> {
    let sum = |of: &dyn Fn(usize) -> f64| (0..solution.patches.len()).map(of).sum::<f64>();
    let area = sum(&|k| solution.patches[k].area_mm2);
    let positions = solution
        .wheelset
        .as_ref()
        .map_or(1, |all| all.positions.len());
    let totals = solution.total.iter().enumerate();
    totals
        .map(|(motion, total)| {
            let of_position = |k: usize| {
                let Some(wheelset) = &solution.wheelset else {
                    return true;
                };
                let position = &wheelset.positions[motion];
                position.left.patches.contains(&k) || position.right.patches.contains(&k)
            };
            let normal = sum(&|k| match of_position(k) {
                true => solution.patches[k].normal_force_n,
                false => 0.0,
            });
            let limit = sum(&|k| {
                let patch = &solution.patches[k];
                patch.friction_limit_n.unwrap_or(0.3 * patch.normal_force_n)
            }) / positions as f64;
            let error = total.error_estimate;
            let of = |of: fn(&railhead_contact::solution::words::answer::ErrorEstimate) -> f64| {
                error.as_ref().map_or(f64::NAN, of)
            };
            let point = solution.patches[0].points.get(motion);
            Answer {
                numbers: [
                    total.force_x_n,
                    total.force_y_n,
                    total.moment_z_n_mm,
                    normal,
                ],
                errors: [
                    of(|error| error.force_x_n),
                    of(|error| error.force_y_n),
                    of(|error| error.moment_z_n_mm),
                    0.0,
                ],
                creepages: [
                    point.map(|point| point.motion.creepage_x),
                    point.map(|point| point.motion.creepage_y),
                ],
                scales: [limit, limit * (area / std::f64::consts::PI).sqrt()],
            }
        })
        .collect()
}

/// Returns the answers of a route, with `None` for rows that are left to the solver, or the reason for a refusal.
fn through(feature: &Feature, route: Route) -> Result<Vec<Option<Answer>>, String> {
    match route {
        Route::List => of_motions(feature, false),
        Route::Sweep => of_motions(feature, true),
        Route::Run => run(feature, true),
        Route::RunOfMotions => run(feature, false),
        Route::Evaluate => evaluated(feature),
        Route::TwoProfiles => two_profiles(feature),
    }
}

/// Returns the answers of one job with all motions.
fn of_motions(feature: &Feature, sweep: bool) -> Result<Vec<Option<Answer>>, String> {
    let mut case = feature.case.clone();
    match feature.motions {
        Motions::Wheelset => {
            let each =
                (0..ROWS).map(|row| feature.case_of_row(row, false)["motion"]["wheelset"].clone());
            case["motion"]["wheelset"] = each.collect();
            for (pointer, values) in &feature.columns {
                let name = pointer
                    .strip_prefix("/contact/")
                    .expect("a place of the wheelset");
                case["contact"][name] = json!({ "values": values });
            }
        }
        Motions::Creepages if sweep => {
            let mut swept: Map<String, Value> =
                case["motion"].as_object().expect("a motion").clone();
            for (pointer, values) in &feature.motion_columns {
                let name = pointer.rsplit('/').next().expect("a name");
                swept.insert(name.to_owned(), json!({ "values": values }));
            }
            case["motion"] = json!({ "sweep": swept });
        }
        Motions::Creepages => {
            case["motion"] = (0..ROWS)
                .map(|row| feature.case_of_row(row, false)["motion"].clone())
                .collect();
        }
    }
    let solution = solved(&case)?;
    Ok(answers(&solution).into_iter().map(Some).collect())
}

fn run(feature: &Feature, with_columns: bool) -> Result<Vec<Option<Answer>>, String> {
    let operators = Arc::new(OperatorStore::default());
    let columns = feature.varied_columns(with_columns);
    let task = ManyTask {
        case: &feature.case_of_row(0, with_columns),
        columns: &columns,
        profiles: &BTreeMap::new(),
        known: &KnownPair::default(),
        limits: &Limits::default(),
        time_limit: Duration::from_secs(600),
    };
    let solve = |checked: &CheckedCase, monitor: &dyn Monitor| {
        contact::solve_with(&operators, checked, monitor).map(|(solution, _)| solution)
    };
    let answer = solve_many(&task, &solve, &Unmonitored).map_err(|error| error.to_string())?;
    let mut reasons = (0..ROWS).map(|row| answer.reason(row));
    if let Some(why) = reasons.find(|why| !why.is_empty()) {
        return Err(why);
    }
    let rows = (0..ROWS).map(|row| {
        let of = |name: &str| answer.column(name).get(row).copied();
        let number = |name: &str| of(name).unwrap_or(f64::NAN);
        let error = number("error_estimate");
        Some(Answer {
            numbers: ["force_x_n", "force_y_n", "moment_z_n_mm", "normal_force_n"].map(number),
            errors: [error, error, number("moment_error_estimate"), 0.0],
            creepages: ["creepage_x", "creepage_y"].map(of),
            scales: [f64::NAN; 2],
        })
    });
    Ok(rows.collect())
}

fn evaluated(feature: &Feature) -> Result<Vec<Option<Answer>>, String> {
    let operators = Arc::new(OperatorStore::default());
    let case = feature.case_of_row(0, true);
    let columns = feature.varied_columns(true);
    let checked = contact::check(&case, &Limits::default()).map_err(|error| error.to_string())?;
    let task = ManyTask {
        case: &case,
        columns: &columns,
        profiles: &BTreeMap::new(),
        known: &KnownPair::default(),
        limits: &Limits::default(),
        time_limit: Duration::from_secs(600),
    };
    let solve = |checked: &CheckedCase, monitor: &dyn Monitor| {
        contact::solve_with(&operators, checked, monitor).map(|(solution, _)| solution)
    };
    let step = || Ok::<_, ()>(());
    let answer = evaluate_at_once(&task, &checked, &solve, &Unmonitored, step);
    let answer = answer.map_err(|error| format!("{error:?}"))?;
    let columns: BTreeMap<_, _> = answer.columns().into_iter().collect();
    // The answer of the table has neither the normal force nor the error of the moment.
    let patches = match columns.contains_key("normal_force_n") {
        true => Vec::new(),
        false => {
            let columns = feature.varied_columns(true);
            let rows = Rows::new(&case, &checked, &columns);
            let rows = rows.ok_or("the rows are evaluated")?;
            rows.answers().map(|row| row.numbers).collect()
        }
    };
    let rows = (0..ROWS).map(|row| {
        let status = answer.status[row];
        if !status.has_answer() {
            return Err(format!("row {row} is {}", status.name()));
        }
        let of = |name: &str| columns.get(name).map(|column| column[row]);
        let number = |name: &str| of(name).unwrap_or(f64::NAN);
        let error = number("error_estimate");
        let place = |name: &str| NUMBER_NAMES.iter().position(|known| *known == name);
        let of_patch = |name: &str| match patches.get(row).zip(place(name)) {
            Some((numbers, place)) => numbers[place],
            None => number(name),
        };
        let normal = of_patch("normal_force_n");
        let of_moment = of_patch("moment_error_estimate");
        let [x, y, z] = ["force_x_n", "force_y_n", "moment_z_n_mm"].map(number);
        Ok(Some(Answer {
            numbers: [x, y, z, normal],
            errors: [error, error, of_moment, 0.0],
            creepages: ["creepage_x", "creepage_y"].map(of),
            scales: [f64::NAN; 2],
        }))
    });
    rows.collect()
}

/// Solves both wheels of a wheelset separately, each under the vertical force that it carries there, and returns the sums of their forces.
fn two_profiles(feature: &Feature) -> Result<Vec<Option<Answer>>, String> {
    let mut found = Vec::new();
    for row in 0..ROWS {
        let case = feature.case_of_row(row, true);
        let whole = solved(&case)?;
        let position = &whole.wheelset.as_ref().ok_or("no wheelset")?.positions[0];
        let sides = [("left", &position.left), ("right", &position.right)].map(|(side, wheel)| {
            let mut single = case.clone();
            single["contact"]["type"] = json!("profiles");
            single["contact"]["side"] = json!(side);
            single["contact"]["roll_rad"] = json!(position.roll_rad);
            single["load"] = json!({ "vertical_force_n": wheel.force_z_n.abs() });
            single["motion"]["wheelset"] = json!({
                "speed_mm_per_s": case["motion"]["wheelset"]["speed_mm_per_s"],
                "angular_velocity_rad_per_s": position.angular_velocity_rad_per_s,
                "lateral_velocity_mm_per_s": case["motion"]["wheelset"]["lateral_velocity_mm_per_s"].as_f64().unwrap_or(0.0),
            });
            solved(&single).map(|solution| answers(&solution)[0].clone())
        });
        let [left, right] = sides;
        let (left, right) = (left?, right?);
        // Moments of the wheels are about different origins.
        let known = answers(&whole)[0].clone();
        let plus = |k: usize| left.numbers[k] + right.numbers[k];
        found.push(Some(Answer {
            numbers: [plus(0), plus(1), known.numbers[2], plus(3)],
            errors: [0, 1, 2, 3].map(|k| left.errors[k] + right.errors[k]),
            creepages: [None; 2],
            scales: [f64::NAN; 2],
        }));
    }
    Ok(found)
}

impl Feature {
    /// Returns the case of a row, with the motion of the row and, if `with_columns`, its other numbers.
    pub fn case_of_row(&self, row: usize, with_columns: bool) -> Value {
        let columns = self.varied_columns(with_columns);
        case_of_row(&self.case, &columns, &BTreeMap::new(), row).expect("places of the case")
    }

    fn varied_columns(&self, with_columns: bool) -> Vec<VariedColumn> {
        let mut columns = varied(&self.motion_columns);
        if with_columns {
            columns.extend(varied(&self.columns));
        }
        columns
    }
}

fn varied(columns: &[(&'static str, [f64; ROWS])]) -> Vec<VariedColumn> {
    let columns = columns.iter();
    columns
        .map(|(pointer, values)| VariedColumn {
            pointer: (*pointer).to_owned(),
            values: Values::Numbers(values.to_vec()),
        })
        .collect()
}
