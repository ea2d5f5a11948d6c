//! Writes `docs/accuracy-and-speed.md` and its pictures: error against run time, the cost of targets and whether they are met, scaling with the
//! number of cells, and the savings by skipped work. Everything is measured in one run on one thread.
//!
//! Run it with `cargo bench --bench report`. Times are thread times, in units of one 500 × 500 f64 LU (faer, factorised in place) of the same run.
//! Without the reference cases of `tests/data`, nothing is written.

#[path = "../drawing.rs"]
#[allow(dead_code, reason = "other pictures use the rest")]
mod drawing;
#[path = "../examples.rs"]
mod examples;
#[path = "../machine.rs"]
mod machine;

mod allocations;
mod gap_runs;
mod gaps;
mod meshes;
mod plot;
mod questions;
mod savings;
mod scaling;
mod targets;

use std::fmt::Write as _;
use std::path::Path;

use machine::lu_seconds;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;

const HEAD: &str = "# Accuracy and speed

Written by `cargo bench --bench report`; do not edit. Everything was measured in one run of one thread, on a machine that other
processes may have used as well.

**Error** of a case: the largest of the errors of F_x and F_y relative to μN and of M_z relative to μN√(A/π), against CONTACT's
solutions extrapolated to infinitely many elements (`tests/data/README.md`; their own uncertainty is 0.0001 to 0.0014).
**1 LU**: one 500 × 500 f64 LU factorisation of faer in place, the unit of machine speed: ";

fn main() {
    // `cargo test --benches` also runs this program, and then it measures nothing.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let mut text = HEAD.to_owned();
    let _ = writeln!(
        text,
        "{:.2} ms here. It is timed again beside what it measures, because the machine does not keep its speed.\n",
        1e3 * lu_seconds()
    );
    let cases = questions::hertz_cases();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("docs");
    let pictures = folder.join("accuracy-and-speed");
    std::fs::create_dir_all(&pictures).expect("a folder for the pictures");
    text.push_str(&targets::section(&cases));
    text.push_str(&meshes::section(&cases, lu_seconds(), &pictures));
    text.push_str(&gaps::section());
    text.push_str(&gap_runs::section(lu_seconds(), &pictures));
    text.push_str(&savings::section());
    text.push_str(&scaling::section(lu_seconds(), &pictures));
    let path = folder.join("accuracy-and-speed.md");
    std::fs::write(&path, text).expect("the report can be written");
    println!("{}", path.display());
}
