//! Tests invalid requests: bodies, queries and headers.

use std::collections::BTreeSet;
use std::time::Duration;

use reqwest::Method;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::crowds::{read_answer, send};
use crate::errors::assert_problem;
use crate::server::{Server, example, example_text};
use crate::table_forms::kept_template;

#[tokio::test]
async fn malformed_json_is_answered_with_its_position() {
    let server = Server::idle().await;
    let deep = "[".repeat(10_000);
    for (body, line, word) in [
        ("", 1, "it is empty"),
        ("\u{feff}{}", 1, "byte order mark"),
        ("{\n  \"name\": \"x\",\n}", 3, "trailing comma"),
        ("{\n\"name\": \"a\",\n\"name\": \"b\"}", 3, "written twice"),
        (deep.as_str(), 1, "recursion limit"),
    ] {
        for path in ["/v1/jobs", "/v1/cases/check"] {
            let answer = server
                .post_as(path, "application/json", body.to_owned())
                .await;
            assert_problem(&answer, 400, "malformed-json", word);
            assert_eq!(answer.json["line"], line, "{}", answer.text);
            assert!(answer.json["column"].is_u64(), "{}", answer.text);
        }
    }
}

#[tokio::test]
async fn body_must_be_declared_as_json() {
    let server = Server::idle().await;
    let case = example_text("spin.case.json");
    for content_type in [
        None,
        Some("text/plain"),
        Some("application/x-www-form-urlencoded"),
        Some("jsonapplication/"),
    ] {
        let answer = server
            .send(Method::POST, "/v1/jobs", |request| {
                let request = request.body(case.clone());
                content_type.map_or(request.try_clone().expect("a request"), |name| {
                    request.header("content-type", name)
                })
            })
            .await;
        assert_problem(&answer, 415, "unsupported-media-type", "application/json");
    }
    let charset = |request: reqwest::RequestBuilder| {
        request
            .header("content-type", "Application/JSON; charset=utf-8")
            .body(case.clone())
    };
    server.send(Method::POST, "/v1/jobs", charset).await.is(202);
    for (path, kind) in [
        ("/v1/jobs", "application/json"),
        ("/v1/cases/check", "application/json"),
        ("/v1/profiles", "application/json"),
        ("/v1/batches", "application/x-ndjson"),
        ("/v1/runs", "application/json"),
        ("/v1/evaluate", "text/csv"),
    ] {
        for charset in ["latin1", "\"UTF-16\""] {
            let kind = format!("{kind}; Charset={charset}");
            let answer = server.post_as(path, &kind, case.clone()).await;
            let word = format!("the charset is `{}`", charset.trim_matches('"'));
            assert_problem(&answer, 415, "unsupported-media-type", &word);
        }
    }
    let quoted = "application/json; profile=x; charset=\"Utf-8\"";
    server.post_as("/v1/jobs", quoted, case).await.is(202);
}

#[tokio::test]
async fn a_byte_order_mark_is_skipped_before_lines_and_named_before_json() {
    let server = Server::idle().await;
    let case = example("spin.case.json");
    let id = kept_template(&server).await;
    for (path, line) in [
        ("/v1/batches".to_owned(), case.to_string()),
        (
            format!("/v1/batches?template={id}"),
            "{\"creepage_x\":0.001}".to_owned(),
        ),
        (
            format!("/v1/runs?template={id}"),
            "{\"creepage_x\":0.001}".to_owned(),
        ),
    ] {
        let lines = format!("\u{feff}{line}\n{line}\n");
        let sent = server
            .post_as(&path, "application/x-ndjson", lines)
            .await
            .is(202);
        let count = if path.starts_with("/v1/runs") {
            "rows"
        } else {
            "count"
        };
        assert_eq!(sent.json[count], 2, "{}", sent.text);
    }
    let rows = format!("{{\"template\":{case},\"columns\":{{\"creepage_x\":[0.001]}}}}");
    for (path, body) in [
        ("/v1/jobs", case.to_string()),
        ("/v1/batches", format!("[{case}]")),
        ("/v1/runs", rows.clone()),
        ("/v1/evaluate", rows),
    ] {
        let body = format!("\u{feff}{body}");
        let answer = server.post_as(path, "application/json", body).await;
        assert_problem(
            &answer,
            400,
            "malformed-json",
            "begins with a byte order mark",
        );
    }
}

/// Writes raw bytes to the service and returns the whole answer.
async fn raw(server: &Server, request: &str) -> String {
    let mut stream = send(server.address, request).await;
    read_answer(&mut stream).await
}

#[tokio::test]
async fn bodies_too_long_of_unknown_length_broken_or_missing_are_refused() {
    let server = Server::with(|setup| {
        setup.http.body_max_bytes = 100;
        setup.http.body_timeout = Duration::from_millis(20);
    })
    .await;
    let long = format!("c8\r\n{}\r\n0\r\n\r\n", " ".repeat(200));
    let chunked = "Transfer-Encoding: chunked";
    for (length, body, status, slug) in [
        (chunked, &*long, 413, "body-too-large"),
        (chunked, "no chunk\r\n", 400, "unreadable-body"),
        ("Content-Length: 10", "{", 408, "body-timeout"),
    ] {
        let head = "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json";
        let answer = raw(&server, &format!("{head}\r\n{length}\r\n\r\n{body}")).await;
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")),
            "{answer}"
        );
        assert!(answer.contains(&format!("/problems/{slug}")), "{answer}");
    }
}

#[tokio::test]
async fn a_refusal_in_the_middle_of_a_body_leaves_the_connection_usable_or_says_so() {
    let server = Server::idle().await;
    let head = |length: usize| {
        format!(
            "POST /v1/batches HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\n\r\n{{"
        )
    };
    let mut stream = send(server.address, &head(100_000)).await;
    tokio::time::sleep(Duration::from_millis(100)).await;
    let mut answer = Vec::new();
    let again = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    for piece in [" ".repeat(99_999).as_str(), again] {
        stream.write_all(piece.as_bytes()).await.expect("sent");
    }
    stream.read_to_end(&mut answer).await.expect("two answers");
    let answer = String::from_utf8_lossy(&answer);
    assert!(answer.starts_with("HTTP/1.1 415"), "{answer}");
    assert!(answer.contains("HTTP/1.1 200"), "{answer}");

    // The declared length exceeds the bytes that the service discards, and the rest never arrives.
    let answer = raw(&server, &head(100_000_000)).await;
    assert!(answer.starts_with("HTTP/1.1 415"), "{answer}");
    assert!(answer.contains("connection: close"), "{answer}");
    // A client that sends `Expect: 100-continue` is not asked to send its body.
    let asking = head(100).replace("\r\n\r\n{", "\r\nExpect: 100-continue\r\n\r\n");
    let answer = raw(&server, &asking).await;
    assert!(answer.starts_with("HTTP/1.1 415"), "{answer}");
    assert!(answer.contains("connection: close"), "{answer}");
}

#[tokio::test]
async fn bad_query_names_every_parameter_with_its_value() {
    let server = Server::idle().await;
    let answer = server.get("/v1/jobs?limit=0&state=done&label=x&created_after=yesterday&colour=red&cursor=a&cursor=b").await;
    assert_problem(&answer, 400, "bad-query", "1 to 1000");
    let errors = answer.json["errors"].as_array().expect("errors");
    let codes = errors
        .iter()
        .map(|error| ["parameter", "code", "value"].map(|name| error[name].as_str()));
    let codes: BTreeSet<_> = codes.collect();
    let named: BTreeSet<_> = codes.iter().filter_map(|[name, ..]| *name).collect();
    let expected = "colour created_after cursor label limit state";
    assert!(named.into_iter().eq(expected.split(' ')), "{}", answer.text);
    for expected in [
        ["colour", "unknown-parameter", "red"].map(Some),
        ["limit", "invalid", "0"].map(Some),
        [Some("cursor"), Some("repeated"), None],
    ] {
        assert!(codes.contains(&expected), "{expected:?} in {codes:?}");
    }
    let state = errors
        .iter()
        .find(|error| error["parameter"] == "state")
        .expect("the fault of `state`");
    let detail = state["detail"].as_str().expect("a detail");
    assert!(
        detail.contains("`done`")
            && detail.contains("queued, running, succeeded, failed, cancelled"),
        "{detail}"
    );
    let answer = server.get("/v1/jobs?limit=1001").await;
    assert_problem(&answer, 400, "bad-query", "1001");
    let answer = server.get("/v1/jobs?cursor=unheard-of").await;
    assert_problem(&answer, 400, "bad-query", "cursor");
    server.get("/v1/jobs?limit=1000.0").await.is(200);
    let path = server.submit(&example("spin.case.json")).await;
    for query in ["grid=1x5", "point=-1", "points=1"] {
        let name = query.split('=').next().expect("a name");
        let answer = server.get(&format!("{path}/tractions?{query}")).await;
        assert_problem(&answer, 400, "bad-query", name);
    }
}

#[tokio::test]
async fn bad_idempotency_keys_are_refused() {
    let server = Server::idle().await;
    let case = example("spin.case.json");
    let send = async |key: &str| {
        server
            .post_with("/v1/jobs", "idempotency-key", key, &case)
            .await
    };
    assert_problem(&send(&"x".repeat(256)).await, 400, "bad-header", "255");
    assert_problem(&send("").await, 400, "bad-header", "255");
    let answer = send("two words").await;
    assert_problem(&answer, 400, "bad-header", "visible");
    assert_eq!(send(&"x".repeat(255)).await.status, 202);
}

#[tokio::test]
async fn answers_that_exclude_json_are_refused() {
    let server = Server::idle().await;
    for path in ["/v1/jobs", "/v1/methods", "/v1/jobs/x/result"] {
        let answer = server.get_with(path, "accept", "text/csv").await;
        assert_problem(&answer, 406, "not-acceptable", "text/csv");
    }
    let named = server.get("/v1/methods?format=csv").await;
    assert_problem(&named, 406, "not-acceptable", "`json` only");
    let send = server.get_with("/v1/methods?format=json", "accept", "text/csv");
    assert_eq!(send.await.status, 200, "`format` overrides `Accept`");
    let browser = "text/html,application/xhtml+xml,*/*;q=0.8";
    server.get_with("/v1/jobs", "accept", browser).await.is(200);
}

#[tokio::test]
async fn a_body_that_is_refused_early_may_be_sent_to_its_end() {
    // The body exceeds every buffer on the way, so that the client is still writing when it is refused.
    const BYTES: usize = 40 << 20;
    let server = Server::idle().await;
    for path in ["/v1/jobs", "/v1/evaluate", "/v1/runs"] {
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: text/plain\r\ncontent-length: {BYTES}\r\n\r\n"
        );
        let mut stream = send(server.address, &head).await;
        for piece in vec![b' '; BYTES].chunks(1 << 20) {
            stream.write_all(piece).await.expect("the service reads on");
        }
        let answer = read_answer(&mut stream).await;
        assert!(
            answer.starts_with("HTTP/1.1 4") && answer.contains("/problems/"),
            "{path}: {answer:.300}"
        );
    }
}
