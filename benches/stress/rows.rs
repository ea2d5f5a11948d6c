//! The table, evaluated rows and many rows: random contacts and motions checked against laws, the solver, and each other.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::evaluate::answer::{RowStatus, RowsAnswer};
use railhead_contact::evaluate::many::{ManyTask, solve_many};
use railhead_contact::evaluate::rows::Rows;
use railhead_contact::evaluate::varied::{Values, VariedColumn, case_of_row};
use railhead_contact::monitor::{Monitor, Unmonitored};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use serde_json::{Value, json};

use crate::contacts::reversed;
use crate::random::Random;

/// Number of templates of each class, and of rows of each template.
const TABLE: [usize; 2] = [40, 50];
const EVALUATE: [usize; 2] = [60, 400];
const RUNS: [usize; 2] = [24, 12];
/// One row of the table in this number is also solved.
const SOLVED_EVERY: usize = 20;
/// Allowed difference between two answers to the same question, relative to μN, due to the last bits of its numbers.
const SAME: f64 = 1e-9;
/// Allowed difference for the simplified theory, whose rows share the mesh of a circle.
const SAME_FASTSIM: f64 = 3e-3;

/// Results of a class: rows, rows with an answer, further figures, and failures.
#[derive(Default)]
struct Class {
    rows: usize,
    answered: usize,
    /// Rows that were also solved, rows whose bound holds, and the largest difference over the bound.
    solved: usize,
    held: usize,
    worst: f64,
    broken: Vec<String>,
}

/// Rows over one template: random numbers for loads, shapes, friction and motions over decades.
struct Draw {
    template: Value,
    columns: Vec<VariedColumn>,
}

impl Draw {
    fn new(random: &mut Random, method: &str, rows: usize) -> Draw {
        let ratio = random.decades(0.12, 8.0);
        let size = random.decades(0.5, 10.0);
        let poisson = random.between(0.0, 0.5);
        let modulus = random.decades(1e3, 3e5);
        let friction = random.decades(0.005, 1.0);
        let load = random.decades(10.0, 3e5);
        // The creepage of saturation, and the spin with the same effect, for C = 4.
        let unit = friction * load / (4.0 * modulus * size * size);
        let mut column = |pointer: &str, draw: &mut dyn FnMut(&mut Random) -> f64| VariedColumn {
            pointer: pointer.to_owned(),
            values: Values::Numbers((0..rows).map(|_| draw(random)).collect()),
        };
        let mut creepage = |random: &mut Random| match random.below(8) {
            0 => 0.0,
            _ => random.sign() * unit * random.decades(1e-4, 30.0),
        };
        let mut spin = |random: &mut Random| match random.below(4) {
            0 => 0.0,
            _ => random.sign() * unit / size * random.decades(1e-3, 10.0),
        };
        let columns = vec![
            column("/load/normal_force_n", &mut |random| {
                load * random.between(0.5, 2.0)
            }),
            column("/contact/a_mm", &mut |random| {
                size * ratio.sqrt() * random.between(0.95, 1.05)
            }),
            column("/friction/coefficient", &mut |random| {
                friction * random.between(0.2, 2.0)
            }),
            column("/motion/creepage_x", &mut creepage),
            column("/motion/creepage_y", &mut creepage),
            column("/motion/spin_per_mm", &mut spin),
        ];
        let mut template = json!({
            "material": { "shear_modulus_mpa": modulus, "poisson_ratio": poisson },
            "friction": { "coefficient": friction },
            "contact": { "type": "ellipse", "a_mm": size, "b_mm": size / ratio.sqrt() },
            "load": { "normal_force_n": load },
            "motion": { "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": 0.0 },
            "solver": { "method": method, "target_error": 0.005 },
            "outputs": ["resultants"],
        });
        for column in &columns {
            if let Some(place) = template.pointer_mut(&column.pointer) {
                *place = column.values.value(0);
            }
        }
        Draw { template, columns }
    }

    fn case(&self, row: usize) -> Value {
        case_of_row(&self.template, &self.columns, &BTreeMap::new(), row).expect("the places exist")
    }

    fn of(&self, pointer: &str, row: usize) -> f64 {
        let column = self.columns.iter().find(|column| column.pointer == pointer);
        match &column.expect("a column").values {
            Values::Numbers(numbers) => numbers[row],
            Values::Texts(_) => unreachable!("all columns are numbers"),
        }
    }

    fn limit(&self, row: usize) -> f64 {
        self.of("/friction/coefficient", row) * self.of("/load/normal_force_n", row)
    }

    /// Returns c = √(ab) of a row in mm.
    fn length(&self, row: usize) -> f64 {
        let across = self
            .template
            .pointer("/contact/b_mm")
            .and_then(Value::as_f64);
        (self.of("/contact/a_mm", row) * across.expect("a number")).sqrt()
    }

    /// Returns the answers of all evaluated rows.
    fn evaluated(&self) -> Result<RowsAnswer, String> {
        let checked =
            contact::check(&self.template, &Limits::default()).map_err(|e| e.to_string())?;
        let rows = Rows::new(&self.template, &checked, &self.columns);
        Ok(rows.ok_or("the rows are left to the solver")?.evaluate())
    }
}

/// Returns the table of all three classes. Rows that broke a law are listed below it.
pub fn table(seed: u64) -> String {
    let mut text = String::from(
        "## The table, rows at once, many rows\n\nEllipses a/b 0.12 to 8, ν 0 to ½, loads, friction, creepages and spin over decades, with none of a motion's parts in some. *Laws*: \
         finite numbers, forces within μN and their bound, friction takes power, the reversed motion has the reversed answer; a row by the table \
         equals its case solved alone, and rows of a run equal their cases to the last bit, whatever stands beside them, faulty rows included. *Bound held*: \
         the difference from `boundary_element` is at most the bound and the solver's own estimate.\n\n\
         | rows | tried | answered | solved as well | bound held | largest difference over it | broken |\n|---|---|---|---|---|---|---|\n",
    );
    let mut troubles = String::new();
    for (name, work) in [
        ("table", by_table as fn(u64) -> Class),
        ("evaluate", evaluated),
        ("runs", runs),
    ] {
        let class = catch_unwind(AssertUnwindSafe(|| work(seed))).unwrap_or_else(|_| Class {
            broken: vec!["crashes".to_owned()],
            ..Class::default()
        });
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {:.2} | {} |",
            class.rows,
            class.answered,
            class.solved,
            class.held,
            class.worst,
            class.broken.len()
        );
        for why in class.broken.iter().take(20) {
            let _ = writeln!(troubles, "- {name}: {why}");
        }
    }
    format!("{text}\n{troubles}")
}

/// Checks cases with `"method": "table"`, some of them also against the solver.
fn by_table(seed: u64) -> Class {
    let mut class = Class::default();
    let mut random = Random(seed ^ 0x7AB1E);
    for _ in 0..TABLE[0] {
        let draw = Draw::new(&mut random, "table", TABLE[1]);
        for row in 0..TABLE[1] {
            class.rows += 1;
            let Some([force, estimate, power]) = alone(&draw.case(row), &mut class) else {
                continue;
            };
            class.answered += 1;
            let limit = draw.limit(row);
            if force[0].hypot(force[1]) > limit + 1.5 * estimate[0] || power[0] < -1e-9 * limit {
                class
                    .broken
                    .push(format!("{force:?} N of {limit} N: {}", draw.case(row)));
            }
            let reversed = reversed(&draw.case(row));
            if let Some([other, ..]) = alone(&reversed, &mut class)
                && (0..2).any(|k| (force[k] + other[k]).abs() > SAME * limit)
            {
                class
                    .broken
                    .push(format!("reversed {other:?}, {force:?}: {reversed}"));
            }
            if class.rows % SOLVED_EVERY == 0 {
                let mut solved = draw.case(row);
                solved["solver"]["method"] = json!("boundary_element");
                if let Some([truth, own, _]) = alone(&solved, &mut class) {
                    let allowed = estimate[0] + own[0];
                    let difference = (0..2)
                        .map(|k| (force[k] - truth[k]).abs())
                        .fold(0.0, f64::max);
                    class.solved += 1;
                    class.held += usize::from(difference <= allowed);
                    class.worst = class.worst.max(difference / allowed);
                }
            }
        }
    }
    class
}

/// Returns the forces, the larger of their estimates for both, and the power of a single case. Records a case without an answer and returns `None`.
fn alone(case: &Value, class: &mut Class) -> Option<[[f64; 2]; 3]> {
    let solved = contact::check(case, &Limits::default())
        .map_err(|error| error.to_string())
        .and_then(|checked| {
            contact::solve(&checked, &Unmonitored).map_err(|error| error.to_string())
        });
    match solved {
        Ok((solution, _)) => {
            let total = &solution.total[0];
            let estimate = total
                .error_estimate
                .map_or(0.0, |e| e.force_x_n.max(e.force_y_n));
            let power = solution.patches[0].points[0].friction_power_n;
            let found = [
                [total.force_x_n, total.force_y_n],
                [estimate; 2],
                [power; 2],
            ];
            let finite = found.iter().flatten().all(|number| number.is_finite());
            if !finite {
                class.broken.push(format!("not finite: {case}"));
            }
            finite.then_some(found)
        }
        Err(error) => {
            class.broken.push(format!("{error}: {case}"));
            None
        }
    }
}

/// Compares evaluated rows, by the table and by the simplified theory, with single cases.
fn evaluated(seed: u64) -> Class {
    let mut class = Class::default();
    let mut random = Random(seed ^ 0xE7A1);
    for number in 0..EVALUATE[0] {
        let method = ["table", "auto", "fastsim"][number % 3];
        let draw = Draw::new(&mut random, method, EVALUATE[1]);
        class.rows += EVALUATE[1];
        let answer = match draw.evaluated() {
            Ok(answer) => answer,
            Err(error) => {
                class.broken.push(format!("{error}: {}", draw.template));
                continue;
            }
        };
        for row in 0..EVALUATE[1] {
            let force = [
                answer.column("force_x_n")[row],
                answer.column("force_y_n")[row],
            ];
            let has = matches!(answer.status[row], RowStatus::Ok | RowStatus::TargetMissed);
            class.answered += usize::from(has);
            let limit = draw.limit(row);
            let above = if method == "fastsim" {
                1e-9 * limit
            } else {
                1.5 * answer.column("error_estimate")[row]
            };
            let lawful = force[0].hypot(force[1]) <= limit + above
                && answer.column("friction_power_n")[row] >= -1e-9 * limit
                && answer.column("moment_z_n_mm")[row].abs() <= 2.0 * limit * draw.length(row);
            if has != force.iter().all(|force| force.is_finite()) || has && !lawful {
                class
                    .broken
                    .push(format!("row {row}, {force:?} N: {}", draw.case(row)));
            }
            if has && method != "auto" && row % 40 == 0 {
                let single = alone(&draw.case(row), &mut class);
                let same = if method == "fastsim" {
                    SAME_FASTSIM
                } else {
                    SAME
                };
                let differs = |[other, ..]: [[f64; 2]; 3]| {
                    (0..2).any(|k| (force[k] - other[k]).abs() > same * limit)
                };
                if single.is_none_or(differs) {
                    class.broken.push(format!(
                        "alone it is {single:?}, {force:?}: {}",
                        draw.case(row)
                    ));
                }
            }
        }
    }
    class
}

/// Checks runs with faulty rows among valid ones: every row has the answer of its case alone.
fn runs(seed: u64) -> Class {
    let mut class = Class::default();
    let mut random = Random(seed ^ 0x9005);
    for number in 0..RUNS[0] {
        let method = ["auto", "boundary_element", "fastsim", "table"][number % 4];
        let mut draw = Draw::new(&mut random, method, RUNS[1]);
        draw.template["solver"]["target_error"] = json!(0.02);
        let faulty = 1 + random.below(RUNS[1] - 1);
        if let Values::Numbers(numbers) = &mut draw.columns[1].values {
            numbers[faulty] = [-1.0, 0.0, 1e9][random.below(3)];
        }
        class.rows += RUNS[1];
        let all = solved(&draw.template, &draw.columns);
        let backward: Vec<VariedColumn> = (draw.columns.clone().into_iter())
            .map(|mut column| {
                if let Values::Numbers(numbers) = &mut column.values {
                    numbers.reverse();
                }
                column
            })
            .collect();
        let reversed = solved(&draw.template, &backward);
        for row in 0..RUNS[1] {
            let has = all.status[row].has_answer();
            class.answered += usize::from(has);
            let bits = |answer: &RowsAnswer, row: usize| -> Vec<u64> {
                answer
                    .numbers
                    .iter()
                    .map(|(_, column)| column[row].to_bits())
                    .collect()
            };
            let image = RUNS[1] - 1 - row;
            let refused = all.status[row] == RowStatus::Refused;
            if (row == faulty) != refused
                || all.status[row] != reversed.status[image]
                || bits(&all, row) != bits(&reversed, image)
            {
                class.broken.push(format!(
                    "row {row} is {:?}, in another order {:?}: {}",
                    all.status[row],
                    reversed.status[image],
                    draw.case(row)
                ));
            }
        }
    }
    class
}

fn solved(template: &Value, columns: &[VariedColumn]) -> RowsAnswer {
    let operators = Arc::new(OperatorStore::default());
    let task = ManyTask {
        case: template,
        columns,
        profiles: &BTreeMap::new(),
        known: &KnownPair::default(),
        limits: &Limits::default(),
        time_limit: Duration::from_secs(60),
    };
    let solve = |checked: &CheckedCase, monitor: &dyn Monitor| {
        contact::solve_with(&operators, checked, monitor).map(|(solution, _)| solution)
    };
    solve_many(&task, &solve, &Unmonitored).expect("never stopped")
}
