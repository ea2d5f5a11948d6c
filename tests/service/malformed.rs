//! Tests that malformed bodies are answered as documented and that the service continues.

use reqwest::Method;
use serde_json::Value;
use tokio::task::JoinSet;

use crate::schema::assert_documented;
use crate::server::example_text;
use crate::support::{Service, case};

/// The number of bodies that must be refused before the test ends.
const REFUSED: usize = 2000;
/// The number of concurrent clients.
const CLIENTS: usize = 8;

/// Texts that mutations insert into a body.
const SPLICES: &str = r#"null true [] {} "" - -0 0 1e999 -1e308 5e-324 1e-400 99999999999999999999999999 NaN Infinity
    0x10 1. .5 " ' \u0000 \ud800 \ , : [ ] { } // é"#;
/// White space and a byte order mark, which mutations insert too.
const BLANKS: [&str; 3] = ["\n", "\r", "\u{feff}"];

/// A reproducible generator of pseudo-random numbers (Marsaglia's xorshift64*).
pub struct Chance(pub u64);

impl Chance {
    /// Returns a number below the bound.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let number = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33;
        usize::try_from(number).unwrap() % bound.max(1)
    }

    /// Returns a range of a body that is not longer than `longest`.
    fn stretch(&mut self, length: usize, longest: usize) -> std::ops::Range<usize> {
        let from = self.below(length + 1);
        let to = length.min(from + self.below(longest + 1));
        from..to
    }

    fn splice(&mut self) -> &'static str {
        let all: Vec<&str> = SPLICES.split_whitespace().chain(BLANKS).collect();
        all[self.below(all.len())]
    }

    /// Changes a body in one to three places.
    fn mutate(&mut self, body: &[u8]) -> Vec<u8> {
        let mut body = body.to_vec();
        for _ in 0..=self.below(3) {
            let length = body.len();
            match self.below(7) {
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
                _ => {
                    let place = self.stretch(length, 6);
                    let splice = self.splice();
                    body.splice(place, splice.bytes());
                }
            }
        }
        body
    }
}

/// Returns valid requests: path, media type and body.
fn seeds(template: &str) -> Vec<(String, &'static str, String)> {
    let (json, ndjson) = ("application/json", "application/x-ndjson");
    let seed = |path: &str, form, body: &str| (path.to_owned(), form, body.to_owned());
    let examples =
        ["hertz-steel", "spin", "sweep"].map(|name| example_text(&format!("{name}.case.json")));
    let small = case("malformed").to_string();
    let lines = format!("{small}\n\n{small}\n");
    let table = "label:km,normal_force_n,/motion/creepage_x,name\r\n1.5,80000,0.002,\"a, \"\"b\"\"\"\r\n,9e4,,\r\n";
    let mut seeds = vec![
        seed("/v1/batches", json, &format!("[{small}, {small}]")),
        seed("/v1/batches", ndjson, &lines),
        seed("/v1/batches?on_invalid=skip", ndjson, &lines),
        seed(
            &format!("/v1/batches?template={template}"),
            "text/csv",
            table,
        ),
    ];
    for path in ["/v1/jobs", "/v1/cases/check"] {
        seeds.extend(examples.iter().map(|text| seed(path, json, text)));
    }
    seeds
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn malformed_bodies_are_answered_as_documented() {
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
                let body = chance.mutate(body.as_bytes());
                let request = service.request(Method::POST, path);
                let request = request.header("content-type", *content).body(body.clone());
                let answer = request.send().await.unwrap();
                let status = answer.status().as_u16();
                let media = answer.headers().get("content-type").cloned();
                let media = media.as_ref().and_then(|value| value.to_str().ok());
                let told = answer.bytes().await.unwrap();
                let json: Value = serde_json::from_slice(&told).unwrap_or_default();
                let body = String::from_utf8_lossy(&body).into_owned();
                // A body is not read if all slots are in use, as on a busy machine.
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
