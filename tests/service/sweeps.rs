//! Tests that long sweeps continue after their last slice when the process ends, with the same result.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use railhead::contact;
use railhead::contact::case::solver::Limits;
use railhead::contact::monitor::{Monitor, Unmonitored};
use railhead::contact::solution::words::answer::{PatchFields, Solution};
use railhead::jobs::engine::Engine;
use railhead::jobs::{FailureKind, Options, State};
use serde_json::{Value, json};
use uuid::Uuid;

use crate::batches::small_loaded;
use crate::lab::{Gate, Lab};
use crate::store::open_beside;
use crate::support::{Service, files_below, long_case};

/// Returns a case that is slow according to its estimate and is therefore cut into slices. It is fast in fact, since all cells slip.
pub fn sliced_case(name: &str, motions: u32) -> Value {
    let mut case = long_case(name, motions);
    case["motion"] = json!({ "sweep": {
        "creepage_x": { "from": 0.01, "to": 0.3, "points": motions }
    } });
    case["solver"] = json!({ "method": "boundary_element", "mesh": { "strips": 32, "cells": 32 } });
    case
}

/// A service whose solver cuts every sweep after each second motion and counts slices. From the third slice on, a case named `held` waits until the
/// gate opens.
struct Shop {
    lab: Lab,
    solved: Arc<AtomicUsize>,
}

impl Shop {
    async fn open(change: impl FnOnce(&mut Options)) -> Shop {
        let real = Engine::contact();
        let (solved, gate) = (Arc::<AtomicUsize>::default(), Gate::default());
        let (count, holds) = (solved.clone(), gate.clone());
        let engine = Engine {
            slices: Arc::new(|checked| {
                let motions = checked.problem.motions.len();
                let cuts = (0..motions).step_by(2);
                cuts.map(|from| from..(from + 2).min(motions)).collect()
            }),
            solve: Arc::new(move |checked, slice, monitor: &dyn Monitor| {
                if checked.label.name.as_deref() == Some("held") && slice.start >= 4 {
                    holds.hold(monitor)?;
                }
                let answer = (real.solve)(checked, slice, monitor)?;
                count.fetch_add(1, Ordering::SeqCst);
                Ok(answer)
            }),
            ..Engine::contact()
        };
        let own = |options: &mut Options| {
            options.slice = Duration::from_millis(10);
            // Some parts are stored in the table and others outside it.
            options.small_result_max_bytes = 4000;
            change(options);
        };
        let lab = Lab::of(gate, engine, own).await;
        lab.jobs.start().unwrap();
        Shop { lab, solved }
    }

    fn solved(&self) -> usize {
        self.solved.load(Ordering::SeqCst)
    }

    /// Returns the number of files of stored results.
    fn files(&self) -> usize {
        files_below(&self.lab.folder.path().join("results")).len()
    }

    async fn until_slices(&self, id: Uuid, done: f64) {
        while self.lab.get(id).await.progress < done {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    }

    async fn answer(&self, id: Uuid) -> (Value, PatchFields) {
        let fields = self.lab.jobs.patch_fields(id, 0, None).await.unwrap();
        let solution = self.lab.jobs.solution(id).await.unwrap();
        (timeless(solution), fields)
    }
}

/// Returns a sweep of this many motions on a coarse mesh.
fn sweep(name: &str, motions: u32) -> Value {
    let mut sweep = long_case(name, motions);
    sweep["solver"]["mesh"] = json!({ "strips": 6, "cells": 6 });
    sweep["outputs"] = json!(["resultants", "zones", "tractions"]);
    sweep
}

/// Returns a solution without its times.
fn timeless(mut solution: Solution) -> Value {
    let patches = solution.patches.iter_mut();
    for point in patches.flat_map(|patch| &mut patch.points) {
        point.solver.seconds = 0.0;
    }
    serde_json::to_value(solution).unwrap()
}

#[tokio::test]
async fn a_sweep_goes_on_after_a_restart_and_solves_no_slice_twice() {
    let mut shop = Shop::open(|_| {}).await;
    let whole = shop.lab.submit(sweep("whole", 11)).await;
    shop.lab.succeeds_at_once(whole).await;
    assert_eq!(shop.solved(), 6);
    shop.lab.jobs.sweep_expired().await.unwrap();
    let files = shop.files();
    let expected = shop.answer(whole).await;

    let held = shop.lab.submit(sweep("held", 11)).await;
    shop.until_slices(held, 4.0 / 11.0).await;
    shop.lab.jobs.shutdown(Duration::ZERO).await;
    assert_eq!(
        shop.files(),
        files + 2 * 2,
        "two parts lie outside the table"
    );
    assert_eq!(shop.solved(), 6 + 2);
    shop.lab.gate.set_open(true);
    shop.lab.reopen(Duration::ZERO).await;
    let job = shop.lab.get(held).await;
    assert_eq!((job.state, job.attempt), (State::Queued, 0));
    assert!(
        (job.progress - 4.0 / 11.0).abs() < 1e-12,
        "{}",
        job.progress
    );
    shop.lab.jobs.start().unwrap();
    shop.lab.succeeds_at_once(held).await;
    assert_eq!(shop.solved(), 12, "two slices were there already");
    let mut found = shop.answer(held).await;
    // The name belongs to the question and not to the answer. All other members belong to both.
    assert_eq!(found.0["patches"], expected.0["patches"]);
    found.0["case_digest"] = expected.0["case_digest"].clone();
    assert_eq!(found, expected);
    shop.lab.jobs.sweep_expired().await.unwrap();
    assert_eq!(shop.files(), 2 * files, "parts go with the whole");
    shop.lab.end().await;
}

#[tokio::test]
async fn a_sweep_that_ends_before_its_time_leaves_no_parts() {
    let shop = Shop::open(|_| {}).await;
    for ends_by_itself in [false, true] {
        let options = railhead::jobs::model::SubmitOptions {
            ends_within: ends_by_itself.then_some(Duration::from_secs(1)),
            ..Default::default()
        };
        let submitted = shop
            .lab
            .jobs
            .submit_with(sweep("held", 11), options.into())
            .await;
        let id = submitted.unwrap().0.id;
        if !ends_by_itself {
            shop.until_slices(id, 0.3).await;
            assert!(shop.files() > 0);
            shop.lab.jobs.cancel(id).await.unwrap();
        }
        let job = shop.lab.wait(id).await;
        let expected = match ends_by_itself {
            true => State::Failed,
            false => State::Cancelled,
        };
        assert_eq!(job.state, expected, "{:?}", job.failure);
    }
    shop.lab.jobs.sweep_expired().await.unwrap();
    assert_eq!(shop.files(), 0);
    shop.lab.end().await;
}

#[tokio::test]
async fn the_time_limit_counts_every_slice_and_every_process() {
    let limit = Duration::from_millis(600);
    let mut shop = Shop::open(|options| options.time_limit = limit).await;
    let id = shop.lab.submit(sweep("held", 11)).await;
    shop.until_slices(id, 4.0 / 11.0).await;
    let about = open_beside(shop.lab.folder.path()).await;
    let spent = about.slices(id).await.unwrap()[1].spent;
    assert!(spent > Duration::ZERO && spent < limit, "{spent:?}");
    // The slices stored by the first process have used up the time limit.
    shop.lab.options.time_limit = spent;
    shop.lab.reopen(Duration::ZERO).await;
    shop.lab.gate.set_open(true);
    shop.lab.jobs.start().unwrap();
    let job = shop.lab.wait(id).await;
    let failure = job.failure.unwrap();
    assert_eq!(failure.kind, FailureKind::OutOfTime);
    assert!(failure.detail.contains("4 of 11"), "{}", failure.detail);
    assert_eq!(shop.solved(), 2);
    shop.lab.end().await;
}

#[tokio::test]
async fn short_jobs_pass_a_sweep_at_its_cuts_and_it_still_goes_on() {
    let shop = Shop::open(|options| options.slice = Duration::from_micros(1)).await;
    let long = shop.lab.submit(sweep("long", 400)).await;
    shop.until_slices(long, 1e-6).await;
    let (mut passed, mut progress) = (0, Vec::new());
    for number in 0..20 {
        let short = small_loaded("short", 50_000 + number);
        let id = shop.lab.submit(short).await;
        shop.lab.wait(id).await;
        let job = shop.lab.get(long).await;
        passed += usize::from(!job.state.ended());
        progress.push(job.progress);
    }
    assert!(passed > 2, "{progress:?}");
    assert!(
        progress.is_sorted() && progress[0] < progress[19],
        "{progress:?}"
    );
    shop.lab.succeeds_at_once(long).await;
    assert!(shop.solved() >= 200 + 20);
    shop.lab.end().await;
}

#[tokio::test]
async fn parts_that_cannot_be_read_are_solved_again() {
    let shop = Shop::open(|options| options.small_result_max_bytes = 0).await;
    let id = shop.lab.submit(sweep("held", 7)).await;
    shop.until_slices(id, 4.0 / 7.0).await;
    std::fs::remove_dir_all(shop.lab.folder.path().join("results")).unwrap();
    shop.lab.gate.set_open(true);
    let job = shop.lab.wait(id).await;
    assert_eq!(job.state, State::Succeeded);
    assert_eq!(shop.solved(), 4 + 4);
    assert_eq!(shop.lab.jobs.solution(id).await.unwrap().total.len(), 7);
    shop.lab.end().await;
}

/// Returns the result of a job without its times.
async fn timeless_result(service: &Service, id: &str) -> Value {
    let mut result = service.get(&format!("/v1/jobs/{id}/result")).await;
    for patch in result["patches"].as_array_mut().unwrap() {
        for point in patch["points"].as_array_mut().unwrap() {
            point["solver"]["seconds"] = json!(0);
        }
    }
    result
}

#[tokio::test]
async fn a_killed_process_costs_a_sweep_no_more_than_the_slice_it_was_at() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--cache", "false", "--log", "info,railhead::jobs=debug"];
    let service = Service::start(folder.path(), &flags);
    let question = sliced_case("killed", 150);
    let problem = contact::check(&question, &Limits::default()).unwrap();
    let slices = contact::slices::slices(&problem).len();
    assert!(slices > 5, "{slices}");
    let id = service.submit(&question).await;
    service.until_logged("slice stored", 2).await;
    let before = service.get(&format!("/v1/jobs/{id}")).await;
    assert!(
        before["progress"].as_f64().unwrap() > 1.5 / slices as f64,
        "{before}"
    );
    service.kill();

    // The table has the progress that the killed process did not report.
    let store = open_beside(folder.path()).await;
    let stored = store.slices(id.parse().unwrap()).await.unwrap().len();
    store.close().await;
    assert!((2..slices).contains(&stored), "{stored} of {slices}");

    let service = Service::start(folder.path(), &flags);
    let after = service.get(&format!("/v1/jobs/{id}")).await;
    let kept = stored as f64 / slices as f64;
    assert!(after["progress"].as_f64().unwrap() > 0.9 * kept, "{after}");
    let job = service.until(&id, "succeeded").await;
    assert_eq!(job["attempt"], 1, "each stored slice begins the count anew");
    assert_eq!(service.logged("slice stored"), slices - stored);
    let found = timeless_result(&service, &id).await;
    let (solution, _) = contact::solve(&problem, &Unmonitored).unwrap();
    let expected = timeless(solution);
    for part in ["patches", "total", "remarks"] {
        let zeroed = |value: &Value| {
            value
                .to_string()
                .replace("\"seconds\":0.0", "\"seconds\":0")
        };
        assert_eq!(zeroed(&found[part]), zeroed(&expected[part]), "{part}");
    }
    let cancelled = service.submit(&sliced_case("cancelled", 400)).await;
    service
        .until_logged("slice stored", slices - stored + 1)
        .await;
    service.cancel(&cancelled).await;
    service.until(&cancelled, "cancelled").await;
}
