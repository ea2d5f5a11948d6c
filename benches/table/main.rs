//! The table of creep forces: makes it, and judges it against motions that it was not made from.
//!
//! `cargo bench --bench table -- nodes` solves the nodes that are missing in `target/table`, `-- motions` the motions that are held out.

extern crate railhead_contact as railhead;

#[path = "../stress/random.rs"]
mod random;
mod assemble;
mod held_out;
mod judge;
mod nodes;
mod solver;

use railhead::contact::rolling::methods::table::evaluate::CreepTable;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["nodes", "even"] => nodes::solve_all(true),
        ["nodes"] => nodes::solve_all(false),
        ["motions"] => held_out::solve_all(),
        ["try", ratio, nu, column, target] => nodes::trial(
            ratio.parse().expect("a node"),
            nu.parse().expect("a node"),
            column.parse().expect("a node"),
            target.parse().expect("a target"),
        ),
        ["judge"] => {
            let table = CreepTable::new(&assemble::values());
            judge::print(&judge::all(&table));
        }
        _ => {}
    }
}
