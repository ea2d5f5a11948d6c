//! Tests caching by clients and compression.

use std::io::Read;

use railhead::http::{HttpOptions, router};
use reqwest::Method;
use serde_json::json;
use tower::ServiceExt;

use crate::errors::assert_problem;
use crate::results::path_of;
use crate::server::{Answer, Server, example, example_text, unpacked};
use crate::support::{Service, case};
use crate::table_forms::kept_template;

#[tokio::test]
async fn finished_results_are_kept_for_good_and_asked_for_by_tag() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    // A service on the same jobs that cannot render: it must not render again what the client has stored.
    let options = HttpOptions {
        renderings_waiting_max: 0,
        ..HttpOptions::default()
    };
    let unable = router(server.jobs.clone(), options);
    let ask = async |path: &str, tag: &str| {
        let request = axum::http::Request::get(path).header("host", "localhost");
        let request = request.header("if-none-match", tag);
        let request = request.body(axum::body::Body::empty()).expect("a request");
        let answer = unable.clone().oneshot(request).await;
        answer.expect("an answer").status().as_u16()
    };
    for part in [
        "result",
        "case",
        "resultants",
        "resultants?format=csv",
        "tractions",
        "tractions?format=npz",
        "zones?grid=5x5",
        "plot.svg",
        "plot.png?field=pressure&width=60",
    ] {
        let path = format!("{path}/{part}");
        let first = server.get(&path).await;
        let tag = first.header("etag").expect("a tag").to_owned();
        assert!(tag.starts_with('"') && tag.len() == 34, "{part}: {tag}");
        let lifetime = first.header("cache-control").expect("a lifetime");
        assert_eq!(lifetime, "private, max-age=3600", "{part}");
        assert_eq!(
            server.get(&path).await.header("etag"),
            Some(tag.as_str()),
            "{part}"
        );
        let again = server
            .get_with(&path, "if-none-match", &format!("\"x\", {tag}"))
            .await;
        assert_eq!((again.status, again.bytes.len()), (304, 0), "{part}");
        assert_eq!(again.header("etag"), Some(tag.as_str()), "{part}");
        let other = server.get_with(&path, "if-none-match", "\"x\"").await;
        assert_eq!((other.status, other.bytes), (200, first.bytes), "{part}");
        assert_eq!(ask(&path, &tag).await, 304, "{part}");
        let made = !["result", "case"].contains(&part);
        let without = if made { 503 } else { 200 };
        assert_eq!(ask(&path, "\"x\"").await, without, "{part}");
    }
    let csv = server.get(&format!("{path}/slip?format=csv")).await;
    let json = server.get(&format!("{path}/slip")).await;
    assert_ne!(
        csv.header("etag"),
        json.header("etag"),
        "each form has its tag"
    );
}

#[tokio::test]
async fn the_tag_of_a_job_or_a_batch_changes_with_it() {
    let server = Server::idle().await;
    let batch = json!([example("spin.case.json")]);
    let batch = server.post("/v1/batches", &batch).await.is(202).location();
    let tag = server
        .get(&batch)
        .await
        .header("etag")
        .expect("a tag")
        .to_owned();
    server.get_with(&batch, "if-none-match", &tag).await.is(304);
    server.cancel(&batch).await;
    server.get_with(&batch, "if-none-match", &tag).await.is(200);
    let path = server.submit(&example("spin.case.json")).await;
    let queued = server.get(&path).await;
    assert_eq!(queued.header("cache-control"), Some("private, no-cache"));
    let tag = queued.header("etag").expect("a tag").to_owned();
    server.get_with(&path, "if-none-match", &tag).await.is(304);
    let early = server.get(&format!("{path}/result")).await.is(409);
    assert_eq!(early.header("cache-control"), Some("no-store"));
    server.cancel(&path).await;
    let cancelled = server.get_with(&path, "if-none-match", &tag).await.is(200);
    assert_eq!(cancelled.json["state"], "cancelled");
    assert_ne!(cancelled.header("etag"), Some(tag.as_str()));
    server.delete(&path).await;
    let gone = server.get_with(&path, "if-none-match", &tag).await;
    assert_problem(&gone, 404, "job-not-found", "");
    assert_eq!(gone.header("cache-control"), Some("no-store"));
}

#[tokio::test]
async fn answers_are_packed_for_those_who_accept_it() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    for part in ["tractions", "tractions?format=csv", "plot.svg", "result"] {
        let path = format!("{path}/{part}");
        let plain = server.get(&path).await;
        assert_eq!(plain.header("content-encoding"), None, "{part}");
        for coding in ["gzip", "zstd"] {
            let packed = server.get_with(&path, "accept-encoding", coding).await;
            assert_eq!(packed.header("content-encoding"), Some(coding), "{part}");
            assert!(packed.bytes.len() < plain.bytes.len(), "{part} as {coding}");
            assert_eq!(
                unpacked(&packed.headers, &packed.bytes),
                plain.bytes,
                "{part} as {coding}"
            );
            let vary = packed.headers.get_all("vary").iter();
            let vary: Vec<_> = vary.filter_map(|value| value.to_str().ok()).collect();
            assert!(
                vary.join(",").to_lowercase().contains("accept-encoding"),
                "{vary:?}"
            );
            let tag = packed.header("etag").expect("a tag").to_owned();
            assert!(tag.ends_with(&format!("-{coding}\"")), "{tag}");
            let again = server.get_with(&path, "if-none-match", &tag).await;
            assert_eq!(
                (again.status, again.header("etag")),
                (304, Some(tag.as_str()))
            );
        }
    }
    for part in ["plot.png?width=60", "tractions?format=npz"] {
        let answer = server
            .get_with(&format!("{path}/{part}"), "accept-encoding", "gzip, zstd")
            .await;
        assert_eq!(
            answer.header("content-encoding"),
            None,
            "{part} is packed already"
        );
    }
}

pub fn gzip(text: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::read::GzEncoder::new(text, flate2::Compression::best());
    let mut out = Vec::new();
    encoder.read_to_end(&mut out).expect("gzip");
    out
}

async fn send_packed(
    server: &Server,
    path: &str,
    kind: &str,
    coding: &str,
    body: Vec<u8>,
) -> Answer {
    let send = server.send(Method::POST, path, |request| {
        request
            .header("content-type", kind)
            .header("content-encoding", coding)
            .body(body)
    });
    send.await
}

#[tokio::test]
async fn packed_cases_are_unpacked_and_other_codings_refused() {
    let server = Server::idle().await;
    let text = example_text("spin.case.json");
    let zstd = zstd::encode_all(text.as_bytes(), 3).expect("zstd");
    for (coding, body) in [("gzip", gzip(text.as_bytes())), ("zstd", zstd)] {
        send_packed(&server, "/v1/jobs", "application/json", coding, body)
            .await
            .is(202);
    }
    let answer = send_packed(&server, "/v1/jobs", "application/json", "br", vec![1, 2]).await;
    assert_problem(&answer, 415, "unsupported-encoding", "`br`");
    assert_eq!(answer.header("accept-encoding"), Some("gzip, zstd"));
    let answer = send_packed(
        &server,
        "/v1/jobs",
        "application/json",
        "gzip",
        text.into_bytes(),
    )
    .await;
    assert_problem(&answer, 400, "unreadable-body", "");
}

/// RFC 1952 allows several members in a file. Parallel compressors and `cat` produce such files.
#[tokio::test]
async fn every_member_of_a_packed_body_is_read_and_nothing_may_follow() {
    let server = Server::idle().await;
    let line = format!("{}\n", example("spin.case.json"));
    let (text, middle) = (line.repeat(2), line.find("0.").expect("a number") + 1);
    for coding in ["gzip", "zstd"] {
        let pack = |text: &[u8]| match coding {
            "gzip" => gzip(text),
            _ => zstd::encode_all(text, 3).expect("zstd"),
        };
        for cut in [line.len(), line.len() + middle] {
            let (one, other) = text.as_bytes().split_at(cut);
            let whole = [pack(one), pack(other)].concat();
            let send = |body: Vec<u8>| {
                send_packed(&server, "/v1/batches", "application/x-ndjson", coding, body)
            };
            let answer = send(whole.clone()).await.is(202);
            assert_eq!(answer.json["count"], 2, "{coding}");
            let last = whole.len() - 1;
            let damaged = [
                [&whole, &b"x"[..]].concat(),
                [&whole, &b"no more of it is packed"[..]].concat(),
                whole[..last].to_vec(),
                whole[..pack(one).len() + 5].to_vec(),
            ];
            for body in damaged {
                let answer = send(body).await;
                assert_problem(&answer, 400, "unreadable-body", "cannot be decompressed");
            }
        }
    }
    let id = kept_template(&server).await;
    let rows = ["creepage_x\n0.00", "1\n0.002\n"].map(|part| gzip(part.as_bytes()));
    let path = format!("/v1/runs?template={id}");
    let run = send_packed(&server, &path, "text/csv", "gzip", rows.concat()).await;
    assert_eq!(run.is(202).json["rows"], 2);
}

#[tokio::test]
async fn limits_hold_before_and_after_unpacking() {
    let server = Server::idle_with(|setup| {
        setup.http = HttpOptions {
            body_max_bytes: 20_000,
            batch_max_bytes: 60_000,
            ..HttpOptions::default()
        }
    })
    .await;
    let case = example_text("spin.case.json");
    let padded = " ".repeat(20_000 - case.len()) + &case;
    let json = "application/json";
    let padded = gzip(padded.as_bytes());
    let fits = send_packed(&server, "/v1/jobs", json, "gzip", padded).await;
    fits.is(202);
    let generous = Server::idle().await;
    // The body consists of empty lines and takes a few kB when compressed.
    let text = vec![b'\n'; 40_000_000];
    for (coding, bomb) in [
        ("gzip", gzip(&text)),
        ("zstd", zstd::encode_all(text.as_slice(), 3).expect("zstd")),
    ] {
        let answer = send_packed(&server, "/v1/jobs", json, coding, bomb.clone()).await;
        assert_problem(&answer, 413, "body-too-large", "20000");
        let answer = send_packed(&server, "/v1/batches", json, coding, bomb.clone()).await;
        assert_problem(&answer, 413, "body-too-large", "60000");
        // A large body is refused as well once it expands to many times its compressed size.
        let lines = "application/x-ndjson";
        let answer = send_packed(&generous, "/v1/batches", lines, coding, bomb).await;
        assert_problem(&answer, 413, "body-too-large", "200 times its size");
    }
    let server = Server::idle_with(|setup| setup.http.body_max_bytes = 20_000).await;
    // An endless sequence of empty blocks: the decompressed size stays 0, the compressed size exceeds the limit, and no length is declared.
    let head = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 0xff];
    let blocks = std::iter::repeat_n([0, 0, 0, 0xff, 0xff].repeat(100), 1000);
    let pieces = std::iter::once(head)
        .chain(blocks)
        .map(Ok::<_, std::io::Error>);
    let body = reqwest::Body::wrap_stream(futures_util::stream::iter(pieces));
    let send = server.send(Method::POST, "/v1/jobs", |request| {
        request
            .header("content-type", json)
            .header("content-encoding", "gzip")
            .body(body)
    });
    assert_problem(&send.await, 413, "body-too-large", "20000");
}

/// Returns the entity tag of the result of a job, and the status of a conditional request with the tag `known`.
async fn tag_and_status(service: &Service, result: &str, known: &str) -> (String, u16) {
    let request = service.request(Method::GET, result);
    let answer = request.header("if-none-match", known).send().await;
    let answer = answer.expect("an answer");
    let tag = answer.headers().get("etag").expect("a tag");
    let tag = tag.to_str().expect("ASCII").to_owned();
    (tag, answer.status().as_u16())
}

#[tokio::test]
async fn tags_of_results_end_with_the_build_that_made_them() {
    let (folder, service) = Service::fresh(&[]);
    let job = service.submit(&case("kept by clients")).await;
    service.until(&job, "succeeded").await;
    let result = format!("/v1/jobs/{job}/resultants");
    let (tag, _) = tag_and_status(&service, &result, "\"none\"").await;
    service.kill();
    // The tag is the same after a restart and on another node with the same build.
    let service = Service::start(folder.path(), &[]);
    assert_eq!(
        tag_and_status(&service, &result, &tag).await,
        (tag.clone(), 304)
    );
    service.kill();
    // A different build: bytes appended to a program do not change its behaviour.
    let other = folder.path().join("another-build");
    std::fs::copy(env!("CARGO_BIN_EXE_railhead"), &other).expect("a copy");
    let file = std::fs::File::options().append(true).open(&other);
    file.and_then(|mut file| std::io::Write::write_all(&mut file, b"another"))
        .expect("another build");
    let mut program = std::process::Command::new(&other);
    let service = Service::start_as(&mut program, "serve", folder.path(), &[]);
    let (new, status) = tag_and_status(&service, &result, &tag).await;
    assert_eq!(status, 200);
    assert_ne!(new, tag);
}
