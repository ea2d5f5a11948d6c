//! Makes the table of creep forces, and checks it with motions that were not used to make it.
//!
//! `cargo bench --bench table -- generate` recomputes `table.bin` and `tests/data/creep_held_out.json`: 219 240 nodes and 6 000 held-out motions, in
//! 36 minutes of processor time. Solved parts are stored in `target/table` (`RAILHEAD_TABLE_FOLDER`), so that an interrupted run continues. `--
//! report` prints errors and bounds from the held-out motions and solves the missing ones. `-- recompute` solves 200 random nodes and 200 random
//! motions again and compares them. `-- speed` prints times of the table and of `fastsim`.

use std::path::Path;

use railhead_contact::case::digest::SOLVER_REVISION;
use railhead_contact::rolling::methods::table::file::table;
use railhead_contact::rolling::methods::table::spline::{CELLS, RATIOS};
use serde_json::json;

mod assemble;
mod bound;
mod fit;
mod held_out;
mod judge;
#[path = "../machine.rs"]
mod machine;
mod nodes;
#[path = "../random.rs"]
#[allow(dead_code, reason = "other benches use more of it")]
mod random;
mod solver;
mod speed;

/// Bounds are fitted for this fraction of half of the contacts, so that they hold for 99 % of the others.
const HELD: f64 = 0.992;
/// Candidate floors and powers of the bounds by indicators. Those with the smallest median of bound over error on that half are used.
const FLOORS: [f64; 9] = [
    0.00003, 0.00005, 0.0001, 0.0002, 0.0003, 0.0005, 0.0007, 0.001, 0.0015,
];
const POWERS: [f64; 5] = [0.25, 0.5, 0.7, 0.85, 1.0];

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    match arguments.first().map(String::as_str) {
        Some("generate") => {
            nodes::solve_all();
            held_out::solve_all();
            write();
        }
        Some("report") => {
            held_out::solve_all();
            let all = judge::all(table());
            judge::print(&all);
            judge::print_bounds(&all);
        }
        Some("recompute") => {
            nodes::recompute(200, table());
            held_out::recompute(200, table());
        }
        Some("speed") => speed::print(),
        _ => {}
    }
}

/// Writes the file of the table and the sample of the tests.
fn write() {
    let values = assemble::values();
    let indicators = bound::indicators(&values);
    let without = judge::all(&fit::table(&values, &vec![0.0; CELLS]));
    let half: Vec<_> = without.iter().filter(|j| j.contact % 2 == 0).collect();
    let laws: Vec<judge::Law> = bound::PARTS
        .iter()
        .map(|part| {
            let own: Vec<_> = half
                .iter()
                .copied()
                .filter(|j| part.contains(&bound::size_of(j.cell)))
                .collect();
            judge::Law::sharpest(&FLOORS, &POWERS, HELD, &own, &indicators)
        })
        .collect();
    let bounds: Vec<f32> = (indicators.iter().enumerate())
        .map(|(cell, indicator)| laws[bound::part_of(cell)].of(*indicator) as f32)
        .collect();
    judge::print_bounds(&judge::all(&fit::table(&values, &bounds)));
    let about = json!({
        "solver_revision": SOLVER_REVISION,
        "targets": (0..RATIOS).map(nodes::target).collect::<Vec<f64>>(),
        "held_out": { "contacts": held_out::CONTACTS, "motions": held_out::MOTIONS, "target": held_out::TARGET },
        "bound": { "held": HELD, "laws": laws.iter().map(judge::Law::described).collect::<Vec<_>>() },
    });
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let file = root.join("src/contact/rolling/methods/table/table.bin");
    std::fs::write(file, fit::file(&about, &values, &bounds)).expect("a file");
    std::fs::write(
        root.join("tests/data/creep_held_out.json"),
        held_out::sample(),
    )
    .expect("a file");
}
