//! Tests a full or unwritable disk: no data are lost, and the problems are clear.

use std::path::PathBuf;
use std::process::Command;

use railhead::contact::case::solver::Limits;
use reqwest::Method;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::batches::{small, small_loaded};
use crate::errors::assert_problem;
use crate::server::Answer;
use crate::support::{Service, case, endless_case, large_case, loaded, pause, railhead, skip};
use crate::sweeps::sliced_case;

/// A small file system that is unmounted when dropped.
struct Disk {
    folder: TempDir,
}

impl Disk {
    /// Mounts a file system. Returns `None` if this process is not allowed to.
    fn mount(options: &str) -> Option<Disk> {
        let folder = tempfile::tempdir().unwrap();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", options, "none"])
            .arg(folder.path())
            .output();
        let mounted = mounted.is_ok_and(|out| out.status.success());
        if !mounted {
            skip("this process may not mount a file system");
        }
        mounted.then_some(Disk { folder })
    }

    fn data_dir(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// Starts a service with one worker and without a cache on this disk.
    fn serve(&self, flags: &[&str]) -> Service {
        let own = ["--cache", "false", "--workers", "1"];
        Service::start(&self.data_dir(), &[&own[..], flags].concat())
    }

    fn remount(&self, options: &str) {
        let mut mount = Command::new("mount");
        let mount = mount.args(["-o", &format!("remount,{options}")]);
        assert!(mount.arg(self.folder.path()).status().unwrap().success());
    }

    /// Uses all the space that is left.
    fn fill(&self) -> PathBuf {
        self.fill_but(0)
    }

    /// Uses all the space but this many bytes.
    fn fill_but(&self, spare: u64) -> PathBuf {
        use std::io::Write;
        let path = self.folder.path().join("ballast");
        let mut file = std::fs::File::create(&path).unwrap();
        for size in [1 << 16, 1 << 10, 1] {
            while file.write_all(&vec![1; size]).is_ok() {}
        }
        let taken = file.metadata().unwrap().len();
        file.set_len(taken.saturating_sub(spare)).unwrap();
        path
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let path = self.folder.path();
        let gone = Command::new("umount").arg("-l").arg(path).status();
        assert!(gone.is_ok_and(|status| status.success()));
    }
}

async fn submit(service: &Service, case: &Value) -> Answer {
    service.post("/v1/jobs", case).await
}

async fn ready(service: &Service) -> Answer {
    service.ask("/readyz").await
}

/// Submits jobs until the service refuses one. Returns the accepted jobs and the refusal.
async fn submit_until_refused(service: &Service) -> (Vec<String>, Answer) {
    let mut accepted = Vec::new();
    for number in 0..5000 {
        let answer = submit(service, &loaded(50_000 + number)).await;
        match answer.status {
            202 => accepted.push(answer.json["id"].as_str().unwrap().to_owned()),
            _ => return (accepted, answer),
        }
    }
    panic!("nothing was refused");
}

async fn all_succeed(service: &Service, accepted: &[String]) {
    for id in accepted {
        let job = service.until(id, "succeeded").await;
        assert_eq!(job["attempt"], 1, "no attempt was lost: {job}");
        service.get(&format!("/v1/jobs/{id}/result")).await;
    }
}

#[tokio::test]
async fn a_full_disk_refuses_what_comes_and_loses_nothing_it_has() {
    let disk = or_skip!(Disk::mount("size=24m"));
    let service = disk.serve(&[]);
    let large = service.submit(&large_case("large", 150)).await;
    service.until(&large, "running").await;
    let ballast = disk.fill();
    let (mut accepted, refusal) = submit_until_refused(&service).await;
    assert_problem(&refusal, 507, "storage-full", "full");
    assert!(refusal.header("retry-after").is_some());
    assert_problem(&ready(&service).await, 507, "storage-full", "");
    let cases = json!([case("a"), case("b")]);
    let batch = service.post("/v1/batches", &cases).await;
    assert_problem(&batch, 507, "storage-full", "");
    // A result that is ready now waits for space and is kept.
    service.until_logged("could not be written yet", 1).await;
    let state = service.get(&format!("/v1/jobs/{large}")).await["state"].clone();
    assert_eq!(state, "running", "what is known can still be read");

    std::fs::remove_file(ballast).unwrap();
    service.until_ready().await;
    accepted.push(large);
    all_succeed(&service, &accepted).await;
    service.submit(&case("after")).await;
    let list = service.get("/v1/jobs?limit=1000").await;
    let known = list["jobs"].as_array().unwrap().len();
    assert_eq!(known, accepted.len() + 1, "no more than were acknowledged");
}

/// Sends a batch with an idempotency key.
async fn send_batch(service: &Service, key: &str, cases: &[Value]) -> Answer {
    let request = service.request(Method::POST, "/v1/batches").json(cases);
    Answer::to(request.header("Idempotency-Key", key)).await
}

#[tokio::test]
async fn a_batch_that_fills_the_disk_leaves_nothing_and_its_key_is_free_at_once() {
    let disk = or_skip!(Disk::mount("size=32m"));
    let service = disk.serve(&[]);
    let cases: Vec<Value> = (0..2000)
        .map(|number| small_loaded(&number.to_string(), 50_000 + number))
        .collect();
    let bytes: usize = cases.iter().map(|case| case.to_string().len() + 1).sum();
    // The remaining space suffices for the staged cases and some of the rows.
    let ballast = disk.fill_but(bytes as u64 * 2 + (1 << 20));
    let refusal = send_batch(&service, "k", &cases).await;
    assert_problem(&refusal, 507, "storage-full", "");
    let list = service.get("/v1/jobs?limit=1000").await;
    assert_eq!(list["jobs"], json!([]), "nothing is listed");
    std::fs::remove_file(ballast).unwrap();
    let again = send_batch(&service, "k", &cases).await.is(202);
    let path = again.location();
    let ended = service.get(&format!("{path}?wait=600")).await;
    assert_eq!(ended["states"]["succeeded"], json!(cases.len()), "{ended}");
    // A job is counted just after its end is stored.
    let name = "\nrailhead_jobs_ended_total{state=\"succeeded\"} ";
    let mut solved = 0;
    while solved < cases.len() {
        let metrics = service.ask("/metrics").await.text;
        let (_, value) = metrics.split_once(name).expect("the sample is there");
        solved = value.lines().next().unwrap().parse().unwrap();
        pause().await;
    }
    assert_eq!(solved, cases.len(), "those of the refused batch were not");
}

#[tokio::test]
async fn a_service_starts_on_a_full_disk_and_serves_what_it_has() {
    // After a kill on the full disk a start has most to do. After an orderly shutdown there are the fewest files.
    for killed in [true, false] {
        starts_on_a_full_disk(killed).await;
    }
}

async fn starts_on_a_full_disk(killed: bool) {
    let disk = or_skip!(Disk::mount("size=16m"));
    let service = disk.serve(&["--shutdown-grace-s", "0"]);
    let solved = service.submit(&case("solved")).await;
    service.until(&solved, "succeeded").await;
    let running = service.submit(&endless_case("running")).await;
    service.until(&running, "running").await;
    let (accepted, ballast);
    if killed {
        ballast = disk.fill();
        accepted = submit_until_refused(&service).await.0;
        service.kill();
    } else {
        service.stop().await;
        (accepted, ballast) = (Vec::new(), disk.fill());
    }
    let service = disk.serve(&[]);
    service.get(&format!("/v1/jobs/{solved}/result")).await;
    if killed {
        // After an orderly shutdown the service still has the space that was reserved for its start.
        assert_problem(&ready(&service).await, 507, "storage-full", "");
        let answer = submit(&service, &case("refused")).await;
        assert_problem(&answer, 507, "storage-full", "");
    }
    std::fs::remove_file(ballast).unwrap();
    service.until_ready().await;
    service.until(&running, "running").await;
    for id in &accepted {
        service.until(id, "succeeded").await;
    }
    let after = service.submit(&case("after")).await;
    all_succeed(&service, &[after]).await;
}

#[tokio::test]
async fn a_full_disk_costs_a_sweep_no_slice() {
    let disk = or_skip!(Disk::mount("size=16m"));
    let service = disk.serve(&["--log", "info,railhead_jobs=debug"]);
    let question = sliced_case("long", 150);
    let problem = railhead::contact::check(&question, &Limits::default()).unwrap();
    let slices = railhead::contact::slices::slices(&problem).len();
    let id = service.submit(&question).await;
    service.until_logged("slice stored", 1).await;
    let ballast = disk.fill();
    service.until_logged("could not be written yet", 2).await;
    let stored = service.logged("slice stored");
    assert!(stored < slices, "{stored} of {slices}");
    std::fs::remove_file(ballast).unwrap();
    all_succeed(&service, &[id]).await;
    assert_eq!(
        service.logged("slice stored"),
        slices,
        "each was solved once"
    );
}

#[test]
fn a_read_only_disk_is_named_at_the_start() {
    let disk = or_skip!(Disk::mount("size=1m"));
    disk.remount("ro");
    let mut serve = railhead();
    let serve = serve.arg("serve").arg("--data-dir").arg(disk.data_dir());
    let refused = serve.output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    let text = String::from_utf8(refused.stderr).unwrap();
    assert!(text.contains("Read-only file system"), "{text}");
    let folder = disk.data_dir().display().to_string();
    assert!(text.contains(&folder), "{text}");
}

/// Returns whether the service reports failing storage.
async fn failing(service: &Service) -> bool {
    let metrics = service.ask("/metrics").await.text;
    metrics.contains("\nrailhead_storage_failing 1\n")
}

#[tokio::test]
async fn results_without_room_are_told_although_the_table_takes_data() {
    let disk = or_skip!(Disk::mount("size=64k"));
    let folder = tempfile::tempdir().unwrap();
    let results = folder.path().join("results");
    std::os::unix::fs::symlink(disk.folder.path(), results).unwrap();
    let service = Service::start(folder.path(), &["--cache", "false", "--workers", "1"]);
    let large = service.submit(&large_case("large", 150)).await;
    service.until_logged("could not be written yet", 2).await;
    let mut accepted = vec![large];
    for number in 0..10 {
        let small = submit(&service, &case(&format!("small {number}"))).await;
        assert_eq!(small.status, 202, "the table has room: {}", small.text);
        accepted.push(small.json["id"].as_str().unwrap().to_owned());
        assert_problem(&ready(&service).await, 507, "storage-full", "");
        assert!(failing(&service).await);
    }
    disk.remount("size=16m");
    service.until_ready().await;
    assert!(!failing(&service).await);
    all_succeed(&service, &accepted).await;
}

#[tokio::test]
async fn a_body_that_fills_the_disk_is_told_until_there_is_room() {
    let disk = or_skip!(Disk::mount("size=32m"));
    let service = disk.serve(&[]);
    let job = service.submit(&small("the template")).await;
    service.until(&job, "succeeded").await;
    let rows: String = (0..200_000)
        .map(|row| format!("{}\n", 50_000 + row))
        .collect();
    let table = format!("/load/normal_force_n\n{rows}");
    let send = async || {
        let request = service.request(Method::POST, &format!("/v1/runs?template={job}"));
        let request = request.header("Content-Type", "text/csv");
        Answer::to(request.body(table.clone())).await
    };
    let ballast = disk.fill_but(256 << 10);
    assert_problem(&send().await, 507, "storage-full", "");
    for _ in 0..10 {
        assert_problem(&ready(&service).await, 507, "storage-full", "");
        assert!(failing(&service).await);
    }
    std::fs::remove_file(ballast).unwrap();
    service.until_ready().await;
    assert!(!failing(&service).await);
}

/// Prevents a process from writing files, or allows it again.
fn limit_files(service: &Service, limit: &str) {
    let limited = Command::new("prlimit")
        .arg(format!("--pid={}", service.id()))
        .arg(format!("--fsize={limit}:unlimited"))
        .status();
    assert!(limited.unwrap().success());
}

#[tokio::test]
async fn a_disk_that_takes_nothing_is_told_from_a_full_one() {
    let folder = tempfile::tempdir().unwrap();
    // A write beyond the limit must be an error, as on a faulty disk, and must not end the process.
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; exec \"$0\" \"$@\""]);
    shell.arg(env!("CARGO_BIN_EXE_railhead"));
    let flags = ["--cache", "false", "--workers", "1"];
    let service = Service::start_as(&mut shell, "serve", folder.path(), &flags);
    let first = service.submit(&large_case("large", 150)).await;
    service.until(&first, "running").await;
    limit_files(&service, "0");
    let refusal = submit(&service, &case("refused")).await;
    assert_problem(&refusal, 503, "storage-unwritable", "cannot be written");
    assert_problem(&ready(&service).await, 503, "storage-unwritable", "");
    service.get(&format!("/v1/jobs/{first}")).await;
    assert!(failing(&service).await);
    service.until_logged("could not be written yet", 1).await;
    limit_files(&service, "unlimited");
    service.until_ready().await;
    all_succeed(&service, &[first]).await;
    service.submit(&case("after")).await;
    assert_eq!(service.logged("the disk accepts writes again"), 1);
}

#[tokio::test]
async fn a_table_locked_by_another_process_is_waited_for_and_then_told() {
    let (folder, service) = Service::fresh(&[]);
    let before = service.submit(&case("before")).await;
    service.until(&before, "succeeded").await;
    let other = rusqlite::Connection::open(folder.path().join("jobs.db")).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let refusal = submit(&service, &case("refused")).await;
    assert_problem(&refusal, 503, "storage-unwritable", "");
    service.get(&format!("/v1/jobs/{before}/result")).await;
    other.execute_batch("ROLLBACK").unwrap();
    service.until_ready().await;
    let after = service.submit(&loaded(70_000)).await;
    service.until(&after, "succeeded").await;
}
