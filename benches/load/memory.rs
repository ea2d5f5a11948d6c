//! Measures the memory that four workers keep after mixed cases. With `MALLOC_ARENA_MAX=16` in the environment, the C library's own settings apply.

use serde_json::{Value, json};

use crate::Row;
use crate::client::Client;
use crate::service::Service;

const WORKERS: usize = 4;
const CASES: usize = 400;
/// Shipped examples as submitted: ellipses, and a wheel on the crown of a rail and at its gauge corner.
const EXAMPLES: [&str; 4] = [
    include_str!("../../api/examples/spin.case.json"),
    include_str!("../../api/examples/hertz-steel.case.json"),
    include_str!("../../api/examples/wheel-rail.case.json"),
    include_str!("../../api/examples/wheel-rail-flange.case.json"),
];

/// Returns the examples in turn, without fields and with different loads. Four in ten have the finest target.
fn case(number: usize) -> Value {
    let mut case: Value = serde_json::from_str(EXAMPLES[number % EXAMPLES.len()]).expect("JSON");
    let share = (number * 197 % CASES) as f64 / CASES as f64;
    let load = case["load"]
        .as_object_mut()
        .expect("the load of an example");
    for force in load.values_mut() {
        let usual = force.as_f64().expect("a force in N");
        *force = json!(usual * (0.8 + 0.4 * share));
    }
    let target = if number % 10 < 4 { 0.001 } else { 0.005 };
    case["solver"] = json!({ "target_error": target });
    case["outputs"] = json!(["resultants"]);
    case
}

/// Measures the resident memory of the process when idle, at its peak and afterwards, and its processor time.
pub async fn run() -> Vec<Row> {
    let service = Service::start(WORKERS, &[]);
    let idle = service.usage().memory_mb;
    let cases: Vec<Value> = (0..CASES).map(case).collect();
    let mut client = Client::new(&service.url);
    let batch = client.post("/v1/batches", &[202], &json!(cases)).await;
    client.batch_results(&batch, CASES).await;
    let usage = service.usage();
    vec![Row::plain(
        "memory: 400 mixed cases on 4 workers; idle, peak, afterwards; processor time",
        format!(
            "{idle:.0}, {:.0}, {:.0} MB; {:.2} s",
            usage.peak_mb, usage.memory_mb, usage.processor_s
        ),
    )]
}
