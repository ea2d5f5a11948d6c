//! Tests that lists of jobs show every job once, for any filter and during changes.

use railhead::jobs::store::{Filter, NewJob};
use serde_json::{Value, json};
use uuid::Uuid;

use crate::batches::small;
use crate::server::Server;
use crate::store::{StoreKind, Table, conformance, ids, new_job, success};

async fn pages_neither_repeat_nor_skip_while_jobs_arrive(kind: StoreKind) {
    let table = Table::new(kind).await;
    let mut expected = Vec::new();
    for _ in 0..20 {
        expected.insert(0, table.add(new_job()).await.id);
    }
    let filter = Filter::default();
    let mut seen = Vec::new();
    let mut cursor: Option<String> = None;
    // The last page is full, and no page follows it.
    for last in [false, true] {
        let after = cursor.map(|cursor| filter.read_cursor(&cursor).unwrap());
        let page = table.list(&filter, after, 10).await;
        seen.extend(page.entries.iter().map(|job| job.id));
        // A new job belongs before the first page. A job that ends keeps its place.
        table.add(new_job()).await;
        let claim = table.claim(0).await.unwrap();
        table.finish(&claim, &success(), 1).await.unwrap();
        assert_eq!(page.next_cursor.is_none(), last);
        cursor = page.next_cursor;
    }
    assert_eq!(seen, expected);
}

async fn windows_of_time_are_half_open(kind: StoreKind) {
    let table = Table::new(kind).await;
    let mut jobs = Vec::new();
    for at in 1_000..1_004 {
        let new = NewJob {
            id: Uuid::from_u128((at << 80) | (7 << 76) | (2 << 62)),
            created_at: at as i64,
            ..new_job()
        };
        jobs.push(table.add(new).await.id);
    }
    let filter = Filter {
        created_after: Some(1_001),
        created_before: Some(1_003),
        ..Filter::default()
    };
    let page = table.list(&filter, None, 100).await;
    assert_eq!(ids(&page.entries), [jobs[2], jobs[1]]);
}

#[tokio::test]
async fn a_label_within_a_batch_is_listed_page_by_page() {
    let server = Server::idle().await;
    let labelled = |line: &str| {
        let mut case = small("one of many");
        case["labels"] = json!({ "line": line });
        case
    };
    let cases: Vec<Value> = (0..7)
        .map(|number| labelled(if number % 2 == 0 { "a" } else { "b" }))
        .collect();
    let mut batches = Vec::new();
    for _ in 0..3 {
        let sent = server.post("/v1/batches", &json!(cases)).await;
        batches.push(sent.json["id"].as_str().expect("an id").to_owned());
        // This job has the same label and belongs to no batch. It lies between the batches.
        assert_eq!(server.post("/v1/jobs", &labelled("a")).await.status, 202);
    }
    for (line, expected) in [("a", 4), ("b", 3), ("c", 0)] {
        for state in ["", "&state=queued"] {
            let path = format!(
                "/v1/jobs?batch={}&label=line:{line}{state}&limit=2",
                batches[1]
            );
            let (mut seen, mut cursor) = (Vec::new(), String::new());
            loop {
                let page = server.read(&format!("{path}{cursor}")).await;
                let jobs = page["jobs"].as_array().expect("jobs").clone();
                assert!(jobs.iter().all(|job| job["batch_id"] == json!(batches[1])));
                seen.extend(jobs.iter().map(|job| job["id"].to_string()));
                match page["next_cursor"].as_str() {
                    Some(next) => cursor = format!("&cursor={next}"),
                    None => break,
                }
            }
            assert_eq!(seen.len(), expected, "{path}");
            assert!(seen.is_sorted_by(|a, b| a > b), "newest first: {seen:?}");
        }
    }
    for elsewhere in ["&created_before=1970-01-01T00:00:00Z", "&state=failed"] {
        let path = format!("/v1/jobs?batch={}&label=line:a{elsewhere}", batches[1]);
        let page = server.get(&path).await;
        assert_eq!(page.json["jobs"], json!([]), "{path}: {}", page.text);
    }
}

conformance! {
    pages_neither_repeat_nor_skip_while_jobs_arrive,
    windows_of_time_are_half_open,
}
