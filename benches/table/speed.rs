//! Measures the time of a value by the table and by the simplified theory, in one process.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::evaluate::rows::Rows;
use railhead_contact::evaluate::varied::{Values, VariedColumn};
use railhead_contact::rolling::methods::table::file::table;
use serde_json::json;

use crate::held_out::{CONTACTS, MOTIONS, contact};
use crate::machine::seconds_of;
use crate::random::Random;

/// Number of values of a measurement. The best of `RUNS` runs counts.
const VALUES: usize = 100_000;
const RUNS: usize = 7;

pub fn print() {
    let inputs: Vec<_> = (0..CONTACTS)
        .flat_map(|number| {
            let (contact, motions) = contact(number);
            motions.into_iter().map(move |motion| (contact, motion))
        })
        .collect();
    let all = || inputs.iter().cycle().take(VALUES);
    let table = table();
    let ns = best(|| {
        all()
            .map(|(c, m)| table.ellipse(c.ratio, c.poisson).creep(*m).force[0])
            .sum()
    });
    println!("table, another ellipse each time: {ns:.0} ns a value with its bound");
    let one = table.ellipse(1.3, 0.28);
    let ns = best(|| all().map(|(_, m)| one.creep(*m).force[0]).sum());
    println!("table, one ellipse: {ns:.0} ns");
    let ns = best(|| all().map(|(_, m)| one.slopes(*m)[0][0]).sum());
    println!("table, one ellipse, derivatives: {ns:.0} ns");
    assert_eq!(inputs.len(), CONTACTS * MOTIONS);
    for (name, radii) in [("radii of their own", true), ("the same radii", false)] {
        let [by_table, by_fastsim] = ["table", "fastsim"].map(|method| ns_of_row(method, radii));
        println!(
            "rows with {name}: table {by_table:.0} ns a row, Hertz and bound included, fastsim {by_fastsim:.0} ns ({:.1} times)",
            by_fastsim / by_table
        );
    }
}

/// Returns the time in ns of a row with its own load, creepages and spin.
fn ns_of_row(method: &str, radii: bool) -> f64 {
    let random = &mut Random(7);
    let mut column = |pointer: &str, low: f64, high: f64| VariedColumn {
        pointer: pointer.to_owned(),
        values: Values::Numbers((0..VALUES).map(|_| random.between(low, high)).collect()),
    };
    let mut columns = vec![
        column("/load/normal_force_n", 2e4, 1.2e5),
        column("/motion/creepage_x", -2e-3, 2e-3),
        column("/motion/creepage_y", -2e-3, 2e-3),
        column("/motion/spin_per_mm", -1e-3, 1e-3),
        column("/friction/coefficient", 0.1, 0.5),
    ];
    if radii {
        columns.push(column("/contact/rolling_mm", 300.0, 600.0));
        columns.push(column("/contact/lateral_mm", 80.0, 980.0));
    }
    let mut case = json!({
        "material": { "shear_modulus_mpa": 82_000.0, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 },
        "load": { "normal_force_n": 8e4 },
        "motion": { "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": 0.0 },
        "solver": { "method": method },
        "outputs": ["resultants"],
    });
    for column in &columns {
        if let Some(place) = case.pointer_mut(&column.pointer) {
            *place = column.values.value(0);
        }
    }
    let checked = contact::check(&case, &Limits::default()).expect("a sound case");
    let rows = Rows::new(&case, &checked, &columns).expect("sound rows");
    best(|| rows.evaluate().column("friction_power_n").iter().sum())
}

/// Returns the time in ns of one of [`VALUES`] values, in the best of several runs.
fn best(work: impl Fn() -> f64) -> f64 {
    let run = |_| {
        let (seconds, sum) = seconds_of(&work);
        assert!(!sum.is_infinite());
        seconds * 1e9 / VALUES as f64
    };
    (0..RUNS).map(run).fold(f64::INFINITY, f64::min)
}
