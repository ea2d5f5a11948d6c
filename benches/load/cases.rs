//! The distinct cases of the load, and the speed of the solver alone on them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use railhead::contact::case::solver::Limits;
use railhead::contact::check;
use railhead::contact::monitor::Unmonitored;
use railhead::jobs::engine::Engine;
use serde_json::{Value, json};

use crate::machine::{median, seconds_of};

/// Sizes n of meshes of n × n cells, from which one with the wanted time is chosen.
const SIZES: [u32; 12] = [8, 10, 12, 14, 16, 18, 20, 23, 26, 29, 32, 36];

/// Returns a distinct Hertz case for each number, with default settings. Loads and creepages are spread over a range.
pub fn hertz(number: usize) -> Value {
    // Multiples of irrational numbers fill a range evenly and are all distinct.
    let spread = |step: f64| (number as f64 * step).fract();
    json!({
        "name": format!("case {number}"),
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 60_000.0 + 80_000.0 * spread(0.618_033_988_749_895) },
        "motion": {
            "creepage_x": 0.0001 + 0.003 * spread(0.414_213_562_373_095),
            "creepage_y": 0.0,
            "spin_per_mm": 0.0004
        }
    })
}

/// Returns the case on a mesh of `size` × `size` cells.
pub fn meshed(number: usize, size: u32) -> Value {
    let mut case = hertz(number);
    case["solver"] = json!({ "mesh": { "strips": size, "cells": size } });
    case
}

/// Returns the mesh size for which one case takes about `seconds`, and its actual time.
pub fn size_of(seconds: f64) -> (u32, f64) {
    let engine = Engine::contact();
    let time = |size| {
        median(
            (0..7)
                .map(|number| seconds_of(|| solve_one(&engine, &meshed(number, size))).0)
                .collect(),
        )
    };
    let times = SIZES.into_iter().map(|size| (size, time(size)));
    times
        .min_by(|a, b| {
            (a.1 / seconds)
                .ln()
                .abs()
                .total_cmp(&(b.1 / seconds).ln().abs())
        })
        .expect("there are sizes")
}

/// Returns the cases per second of the solver alone on this number of threads, measured for about `time`.
pub fn bare_rate(threads: usize, time: Duration, case: impl Fn(usize) -> Value + Sync) -> f64 {
    let (engine, next) = (Engine::contact(), AtomicUsize::new(0));
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while start.elapsed() < time {
                    solve_one(&engine, &case(next.fetch_add(1, Ordering::Relaxed)));
                }
            });
        }
    });
    next.into_inner() as f64 / start.elapsed().as_secs_f64()
}

/// Solves a case as a worker does, with the operators that the process keeps.
fn solve_one(engine: &Engine, case: &Value) {
    let problem = check(case, &Limits::default()).expect("a case");
    for slice in (engine.slices)(&problem) {
        (engine.solve)(&problem, slice, &Unmonitored).expect("a solution");
    }
}
