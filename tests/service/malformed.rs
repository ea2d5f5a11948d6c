//! Ten thousand malformed bodies: each is answered as the contract says, and the service lives on.

use std::path::Path;

use reqwest::Method;
use serde_json::Value;
use tokio::task::JoinSet;

use crate::schema::assert_documented;
use crate::support::{Service, case};

/// Bodies that must be refused before the test ends.
const REFUSED: usize = 10_000;
/// Clients that send at the same time.
const CLIENTS: usize = 8;

/// What mutations put into a body.
const SPLICES: [&str; 34] = [
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "-",
    "-0",
    "0",
    "1e999",
    "-1e308",
    "5e-324",
    "1e-400",
    "99999999999999999999999999",
    "NaN",
    "Infinity",
    "0x10",
    "1.",
    ".5",
    "\"",
    "'",
    "\\u0000",
    "\\ud800",
    "\\",
    ",",
    ":",
    "[",
    "]",
    "{",
    "}",
    "\n",
    "\r",
    "\u{feff}",
    "//",
    "é",
];

/// A generator of numbers (Marsaglia's xorshift64*), the same at every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let number = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33;
        usize::try_from(number).unwrap() % bound.max(1)
    }

    /// A stretch of a body, not longer than `longest`.
    fn stretch(&mut self, length: usize, longest: usize) -> std::ops::Range<usize> {
        let from = self.below(length + 1);
        let to = length.min(from + self.below(longest + 1));
        from..to
    }

    /// Changes a body in one to three places.
    fn mutate(&mut self, body: &[u8]) -> Vec<u8> {
        let mut body = body.to_vec();
        for _ in 0..=self.below(3) {
            let length = body.len();
            match self.below(8) {
                0 if length > 0 => {
                    let place = self.below(length);
                    body[place] ^= 1 << self.below(8);
                }
                1 => body.truncate(self.below(length + 1)),
                2 => {
                    let gone = self.stretch(length, 40);
                    body.drain(gone);
                }
                3 => {
                    let twice = self.stretch(length, 200);
                    let copy = body[twice.clone()].to_vec();
                    body.splice(twice.end..twice.end, copy);
                }
                4 => {
                    let deep = if self.below(2) == 0 { "[" } else { "{\"a\":" };
                    let place = self.below(length + 1);
                    let many = deep.repeat(1 + self.below(5000));
                    body.splice(place..place, many.into_bytes());
                }
                5 => self.replace_number(&mut body),
                _ => {
                    let place = self.stretch(length, 6);
                    let splice = SPLICES[self.below(SPLICES.len())];
                    body.splice(place, splice.bytes());
                }
            }
        }
        body
    }

    /// Puts something else where a number begins.
    fn replace_number(&mut self, body: &mut Vec<u8>) {
        let start = self.below(body.len() + 1);
        let digit = body[start..].iter().position(u8::is_ascii_digit);
        if let Some(place) = digit.map(|offset| start + offset) {
            let rest = &body[place..];
            let number = rest
                .iter()
                .take_while(|b| b.is_ascii_digit() || **b == b'.');
            let end = place + number.count();
            let splice = SPLICES[self.below(SPLICES.len())];
            body.splice(place..end, splice.bytes());
        }
    }
}

/// Where bodies are sent, as what, and good ones.
fn seeds(template: &str) -> Vec<(String, &'static str, Vec<u8>)> {
    let mut seeds = Vec::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("api/examples");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        // Cases with long lists of points take longer to read than to break.
        let text = std::fs::read(&path).unwrap();
        if path.to_string_lossy().ends_with(".case.json") && text.len() < 6000 {
            for route in ["/v1/jobs", "/v1/cases/check"] {
                seeds.push((route.to_owned(), "application/json", text.clone()));
            }
        }
    }
    assert!(seeds.len() > 4, "{}", seeds.len());
    let small = case("malformed").to_string();
    let batches = "/v1/batches".to_owned();
    let valid = format!("{batches}?on_invalid=skip");
    let lines = format!("{small}\n\n{small}\n");
    let table = "label:km,normal_force_n,/motion/creepage_x,name\r\n1.5,80000,0.002,\"a, \"\"b\"\"\"\r\n,9e4,,\r\n";
    seeds.extend([
        (
            batches.clone(),
            "application/json",
            format!("[{small}, {small}]").into_bytes(),
        ),
        (batches, "application/x-ndjson", lines.clone().into_bytes()),
        (valid, "application/x-ndjson", lines.into_bytes()),
        (
            format!("/v1/batches?template={template}"),
            "text/csv",
            table.into(),
        ),
    ]);
    seeds
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn ten_thousand_malformed_bodies_are_answered_as_documented() {
    let (_folder, service) = Service::fresh(&["--log", "warn,railhead::cli=info"]);
    let template = service.submit(&case("template")).await;
    let seeds = seeds(&template);
    let service = std::sync::Arc::new(service);
    let mut clients = JoinSet::new();
    for client in 0..CLIENTS {
        let (service, seeds) = (service.clone(), seeds.clone());
        clients.spawn(async move {
            let mut chance = Chance(0x9E37_79B9_7F4A_7C15 ^ ((client as u64 + 1) << 32));
            let (mut sent, mut refused) = (0, 0);
            while refused < REFUSED.div_ceil(CLIENTS) {
                let (path, content, body) = &seeds[chance.below(seeds.len())];
                let body = chance.mutate(body);
                let request = service.request(Method::POST, path);
                let request = request.header("content-type", *content).body(body.clone());
                let answer = request.send().await.unwrap();
                let status = answer.status().as_u16();
                let media = answer.headers().get("content-type").cloned();
                let media = media.as_ref().and_then(|value| value.to_str().ok());
                let told = answer.bytes().await.unwrap();
                let json: Value = serde_json::from_slice(&told).unwrap_or_default();
                let body = String::from_utf8_lossy(&body).into_owned();
                // Where all turns are taken, as on a busy machine, a body is not read.
                assert!(
                    status < 500 || status == 503,
                    "{path} answered {status} to {body}: {json}"
                );
                assert_documented("POST", path, status, media, &json);
                sent += 1;
                if status >= 400 {
                    assert_eq!(media, Some("application/problem+json"), "{body}");
                    refused += 1;
                }
            }
            sent
        });
    }
    let sent: usize = clients.join_all().await.iter().sum();
    println!("{sent} bodies, {REFUSED} of them refused");
    assert!(sent < 2 * REFUSED, "most mutations are faulty: {sent}");
    service.get("/healthz").await;
    assert_eq!(service.log_text().matches("panicked").count(), 0);
    let metrics = service
        .request(Method::GET, "/metrics")
        .send()
        .await
        .unwrap();
    let metrics = metrics.text().await.unwrap();
    let panics = "railhead_job_failures_total{reason=\"panic\"} 0\n";
    assert!(metrics.contains(panics), "{metrics}");
}
