//! Prints where `liu_hsu` converges, by rule, mesh and region. Only whole rows are timed.

use std::time::Instant;

use convergence_domain::{count, motions};
use railhead_contact::mesh::Grading;
use railhead_contact::rolling::slip_rules::Rule;
use regions::REGIONS;

#[allow(
    dead_code,
    reason = "only the sweep is used here; the tests use the rest"
)]
#[path = "../tests/physics/convergence_domain.rs"]
mod convergence_domain;
#[allow(
    dead_code,
    reason = "only the sweep is used here; the tests use the rest"
)]
#[path = "../tests/physics/regions.rs"]
mod regions;

fn main() {
    // Every second motion, to match the published counts of the same sweep.
    let motions: Vec<[f64; 3]> = motions().into_iter().step_by(2).collect();
    println!(
        "rule | cells | region | guess 1 | guess 2 | 1 then 2 | all three | guess 1: divisions + steps, \
         diverged/repeats/other | guess 2 | seconds"
    );
    for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
        for (strips, grading, name) in [
            (5, Grading::uniform(5), "5 x 5 equal"),
            (10, Grading::uniform(10), "10 x 10 equal"),
            (12, Grading::cosine(12), "12 x 12 cosine"),
        ] {
            for (region_name, region) in REGIONS {
                let start = Instant::now();
                let counts = count(region, rule, (strips, &grading), &motions);
                println!(
                    "{} | {name} | {region_name} | {} | {:.1}",
                    rule.name(),
                    counts.row(),
                    start.elapsed().as_secs_f64()
                );
            }
        }
    }
}
