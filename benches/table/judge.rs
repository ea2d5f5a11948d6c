//! The errors of the table at motions that were not used to make it.

use railhead_contact::rolling::methods::table::evaluate::CreepTable;
use railhead_contact::rolling::methods::table::spline::{cell, sigma, spin_factor};
use serde_json::{Value, json};

use crate::held_out::{CONTACTS, contact, name};
use crate::machine::quantile;
use crate::solver::read;

/// One held-out motion.
pub struct Judged {
    pub ratio: f64,
    pub poisson: f64,
    pub size: f64,
    pub angles: [f64; 2],
    pub errors: [f64; 4],
    pub truth: f64,
    pub contact: usize,
    pub cell: usize,
    pub bound: f64,
}

impl Judged {
    pub fn largest(&self) -> f64 {
        self.errors[..3].iter().copied().fold(0.0, f64::max)
    }
}

/// Returns all solved motions.
pub fn all(table: &CreepTable) -> Vec<Judged> {
    let mut all = Vec::new();
    for number in 0..CONTACTS {
        let Some(answers) = read(&name(number)) else {
            continue;
        };
        let (of, motions) = contact(number);
        let ellipse = table.ellipse(of.ratio, of.poisson);
        let ([c11, c22], shape) = of.scales();
        for (motion, answer) in motions.iter().zip(answers.chunks_exact(5)) {
            let found = ellipse.creep(*motion);
            let [x, y, z] = *motion;
            let sign = if z < 0.0 { -1.0 } else { 1.0 };
            let h = spin_factor(of.ratio.sqrt(), [c11, c22]);
            let size = (c11 * x).hypot(c22 * y).hypot(h * z);
            let angles = shape.angles([x.abs(), sign * y, sign * z]);
            all.push(Judged {
                ratio: of.ratio,
                poisson: of.poisson,
                size,
                angles,
                cell: cell(of.ratio.ln(), sigma(size), angles[0], angles[1]),
                errors: [
                    (found.force[0] - answer[0]).abs(),
                    (found.force[1] - answer[1]).abs(),
                    (found.force[2] - answer[2]).abs(),
                    (found.stick - answer[3]).abs(),
                ],
                truth: answer[4],
                bound: found.bound,
                contact: number,
            });
        }
    }
    all
}

fn row(name: &str, part: &[&Judged]) {
    let quantiles = |of: &dyn Fn(&Judged) -> f64| {
        let values: Vec<f64> = part.iter().map(|j| of(j)).collect();
        let [half, most, nearly, all] =
            [0.5, 0.9, 0.99, 1.0].map(|share| quantile(values.clone(), share));
        format!("{half:.4}/{most:.4}/{nearly:.4}/{all:.4}")
    };
    let within = |limit: f64| {
        100.0 * part.iter().filter(|j| j.largest() <= limit).count() as f64
            / part.len().max(1) as f64
    };
    println!(
        "| {name} | {} | {} | {} | {} | {} | {:.2} | {:.2} | {} | {} |",
        part.len(),
        quantiles(&|j| j.errors[0]),
        quantiles(&|j| j.errors[1]),
        quantiles(&|j| j.errors[2]),
        quantiles(&Judged::largest),
        within(0.004),
        within(0.01),
        quantiles(&|j| j.errors[3]),
        quantiles(&|j| j.truth),
    );
}

/// Prints the table of errors by region.
pub fn print(all: &[Judged]) {
    type Test = fn(&Judged) -> bool;
    println!(
        "| region | motions | F_x 50/90/99 %/max | F_y | M_z | largest | <= 0.004 % | <= 0.01 % | stick | truth's estimate |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let regions: [(&str, Test); 9] = [
        ("all", |_| true),
        ("a/b 0.3 to 3", |j| (0.3..3.0).contains(&j.ratio)),
        ("a/b < 0.3", |j| j.ratio < 0.3),
        ("a/b > 3", |j| j.ratio > 3.0),
        ("a/b > 5.6", |j| j.ratio > 5.6),
        ("nu 0.2 to 0.35", |j| (0.2..0.35).contains(&j.poisson)),
        ("r < 1", |j| j.size < 1.0),
        ("r 1 to 4", |j| (1.0..4.0).contains(&j.size)),
        ("r > 4", |j| j.size > 4.0),
    ];
    for (name, test) in regions {
        let part: Vec<&Judged> = all.iter().filter(|j| test(j)).collect();
        row(name, &part);
    }
    let mut worst: Vec<&Judged> = all.iter().collect();
    worst.sort_by(|a, b| b.largest().total_cmp(&a.largest()));
    for j in worst.iter().take(12) {
        println!(
            "contact {} a/b {:.3} nu {:.3} r {:.3} angles {:.3} {:.3}: {:.4} {:.4} {:.4}, stick {:.4}, truth {:.4}",
            j.contact,
            j.ratio,
            j.poisson,
            j.size,
            j.angles[0],
            j.angles[1],
            j.errors[0],
            j.errors[1],
            j.errors[2],
            j.errors[3],
            j.truth
        );
    }
}

/// Prints how the bounds of the table hold on the contacts that were not used to fit them.
pub fn print_bounds(all: &[Judged]) {
    let others: Vec<&Judged> = all.iter().filter(|j| j.contact % 2 == 1).collect();
    let held = others.iter().filter(|j| j.largest() <= j.bound).count();
    let sizes = sorted(others.iter().map(|j| j.bound));
    let times = sorted(others.iter().map(|j| j.bound / j.largest()));
    println!(
        "bounds on {} motions: hold for {:.2} %, {:.4} in the median, {:.4} at 90 %, {:.4} at 99 %; {:.1} times the error in the median",
        others.len(),
        100.0 * held as f64 / others.len() as f64,
        at(&sizes, 0.5),
        at(&sizes, 0.9),
        at(&sizes, 0.99),
        at(&times, 0.5)
    );
}

/// Bounds of the form `factor × max(indicator, floor)^power`.
#[derive(Debug, Clone, Copy)]
pub struct Law {
    pub floor: f64,
    pub power: f64,
    pub factor: f64,
}

impl Law {
    pub fn of(&self, indicator: f32) -> f64 {
        self.factor * f64::from(indicator).max(self.floor).powf(self.power)
    }

    /// Returns the JSON object of the law in the file of the table.
    pub fn described(&self) -> Value {
        json!({ "floor": self.floor, "power": self.power, "factor": self.factor })
    }

    /// Returns the law whose bound holds for this fraction of the motions with the smallest median of bound over error.
    pub fn sharpest(
        floors: &[f64],
        powers: &[f64],
        part: f64,
        motions: &[&Judged],
        indicators: &[f32],
    ) -> Law {
        let laws = floors.iter().flat_map(|floor| {
            let fitted = |power: &f64| Law::fitted(*floor, *power, part, motions, indicators);
            powers.iter().map(fitted)
        });
        let times = |law: &Law| {
            let ratios = motions
                .iter()
                .map(|j| law.of(indicators[j.cell]) / j.largest());
            at(&sorted(ratios), 0.5)
        };
        laws.min_by(|one, other| times(one).total_cmp(&times(other)))
            .expect("a law")
    }

    /// Returns the law with the factor for which the bound holds for this fraction of the motions.
    fn fitted(floor: f64, power: f64, part: f64, motions: &[&Judged], indicators: &[f32]) -> Law {
        let unit = Law {
            floor,
            power,
            factor: 1.0,
        };
        let needed = sorted(
            motions
                .iter()
                .map(|j| j.largest() / unit.of(indicators[j.cell])),
        );
        Law {
            factor: at(&needed, part),
            ..unit
        }
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn at(values: &[f64], part: f64) -> f64 {
    let last = values.len().saturating_sub(1);
    values
        .get((part * last as f64).ceil() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}
