//! Tests nodes behind a pooler in transaction mode, which assigns each transaction to any free session.

use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;
use reqwest::Method;

use crate::cluster::nodes::send_batch;
use crate::cluster::pgbouncer::Pooler;
use crate::cluster::postgres::database;
use crate::cluster::{node, until};
use crate::support::{Answer, Service, case, endless_case};

/// The number of sessions. It is smaller than the number of connections of the nodes, so that sessions change hands all the time.
const SESSIONS: u32 = 4;

/// A notification of an end takes milliseconds. Polling takes up to a second.
const HEARD_WITHIN: Duration = Duration::from_millis(700);

#[tokio::test(flavor = "multi_thread")]
async fn nodes_behind_a_pooler_in_transaction_mode_work_and_hear_each_other() {
    let direct = or_skip!(database().await);
    let pooler = or_skip!(Pooler::before(&direct, SESSIONS));
    let url = pooler.url(&direct);
    migrate(&url).await.unwrap();
    let start = |role: &str| node(&url, role, &["--database-direct-url", &direct]);
    let [one, other, worker] = ["serve", "serve", "worker"].map(start);

    let (batch, _) = send_batch(&one).await;
    let mut ids = Vec::new();
    for number in 0..40 {
        let api = [&one, &other][number % 2];
        ids.push(api.submit(&case(&format!("case {number}"))).await);
    }
    for id in &ids {
        let job = other.until(id, "succeeded").await;
        assert_eq!(job["attempt"], 1, "{job}");
        let result = one.get(&format!("/v1/jobs/{id}/result")).await;
        assert!(result["patches"].is_array(), "{result}");
    }
    until("the batch ends", async || {
        other.get(&batch).await["states"]["succeeded"] == 60
    })
    .await;
    assert_heard(&one, &other).await;
    for node in [&one, &other, &worker] {
        let log = node.log_text();
        assert!(
            !log.contains("\"ERROR\"") && !log.contains("prepared"),
            "{log}"
        );
    }
}

/// Asserts that a client that waits at one node is notified of an end at the other node without polling. Since a busy machine delays some
/// notifications, it suffices that one of 20 is fast.
async fn assert_heard(one: &Service, other: &Service) {
    let mut fastest = Duration::MAX;
    for number in 0..20 {
        let id = one
            .submit(&endless_case(&format!("waited for {number}")))
            .await;
        one.until(&id, "running").await;
        let waiting = one.request(Method::GET, &format!("/v1/jobs/{id}"));
        let waiting = tokio::spawn(Answer::to(waiting.header("Prefer", "wait=30")));
        // Ensures that the wait begins before the job ends.
        tokio::time::sleep(Duration::from_millis(100)).await;
        let asked = Instant::now();
        other.cancel(&id).await;
        let job = waiting.await.unwrap();
        assert_eq!(job.json["state"], "cancelled", "{}", job.text);
        fastest = fastest.min(asked.elapsed());
        if fastest < HEARD_WITHIN {
            return;
        }
    }
    panic!("the fastest notification took {fastest:?}");
}
