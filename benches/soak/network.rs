//! Tests nodes on separate hosts while one of them is disconnected or paused for longer than its lease: when its jobs become free, that it changes
//! nothing afterwards, and when it works again.

use std::time::{Duration, Instant};

use reqwest::{Client, Method};
use serde_json::json;
use sqlx::PgPool;
use tokio::time::sleep;

use crate::cluster::{assert_ended_once, counted, tables, until, until_all_ended};
use crate::hosts::{self, Cut, Host};
use crate::support::{Service, case, endless_case, long_case, railhead};
use crate::{postgres, row, without_settings};

const LEASE: Duration = Duration::from_secs(3);

/// Time limit to free the jobs of a disconnected node: the lease, one round of the check for silent workers (a third of the lease), and one second
/// for everything else.
const FREE_WITHIN: Duration = Duration::from_secs(5);

/// Time limit of a request.
const WITHIN: Duration = Duration::from_secs(120);

/// Records which host claims which job, and delays claims of the hosts in `soak_slow` by a second.
const NOTES: &str = "CREATE TABLE soak_claims (job text NOT NULL, host text NOT NULL); \
    CREATE TABLE soak_slow (host text NOT NULL); \
    CREATE FUNCTION soak_claim() RETURNS trigger LANGUAGE plpgsql AS $$ \
    BEGIN INSERT INTO soak_claims VALUES (NEW.id, host(inet_client_addr())); \
    IF EXISTS (SELECT 1 FROM soak_slow WHERE host = host(inet_client_addr())) THEN PERFORM pg_sleep(1); END IF; RETURN NULL; END $$; \
    CREATE TRIGGER soak_claims AFTER UPDATE ON jobs FOR EACH ROW \
    WHEN (NEW.state = 'running' AND OLD.state = 'queued') EXECUTE FUNCTION soak_claim()";

/// Digest of everything that an end or a stale owner could change.
const AS_THEY_ARE: &str = "SELECT COALESCE(md5(string_agg(concat_ws(',', id, state, ended_at, lease_token, blob_id, attempt, version), ' ' ORDER BY id)), '') \
    FROM jobs WHERE ended_at IS NOT NULL";

/// The way in which a node is lost.
#[derive(Debug, Clone, Copy)]
enum Away {
    Cut(Cut),
    /// The process of the node is paused.
    Paused,
}

/// The database and an API node on this host, and two workers on separate hosts.
struct Network {
    pool: PgPool,
    url: String,
    api: Service,
    hosts: [Host; 2],
    workers: [Service; 2],
}

fn start(host: &Host, role: &str, url: &str) -> Service {
    let program = host.command(env!("CARGO_BIN_EXE_railhead"));
    let mut program = without_settings(program);
    let listen = format!("{}:0", host.address);
    let workers = if role == "worker" { "1" } else { "0" };
    let lease = LEASE.as_secs().to_string();
    let mut flags = vec!["--database-url", url, "--workers", workers];
    flags.extend(["--listen", &listen, "--lease-s", &lease, "--cache", "false"]);
    if role == "serve" {
        flags.extend(["--anonymous", "always"]);
    }
    Service::alone(&mut program, role, &flags)
}

impl Network {
    async fn new() -> Option<Network> {
        postgres::ALSO_AT.set(hosts::HERE).expect("the first");
        let (near, pool) = tables().await?;
        sqlx::raw_sql(NOTES).execute(&pool).await.expect("notes");
        let url = near.replace("127.0.0.1", hosts::HERE);
        let flags = ["--database-url", &url, "--workers", "0", "--lease-s", "3"];
        let flags = [&flags[..], &["--cache", "false"]].concat();
        let api = Service::alone(&mut railhead(), "serve", &flags);
        let hosts = [Host::new(2), Host::new(3)];
        let workers = [0, 1].map(|number| start(&hosts[number], "worker", &url));
        Some(Network {
            pool,
            url,
            api,
            hosts,
            workers,
        })
    }

    /// Submits jobs of some seconds, and many small ones after them.
    async fn submit(&self, long: usize, small: usize) {
        for number in 0..long {
            let mut case = long_case(&format!("long {number}"), 150);
            case["solver"]["mesh"] = json!({ "strips": 32, "cells": 32 });
            self.api.submit(&case).await;
        }
        for number in 0..small {
            self.api.submit(&case(&format!("small {number}"))).await;
        }
    }

    /// Returns the number of claims of the first host.
    async fn claims(&self) -> i64 {
        counted(
            &self.pool,
            "SELECT COUNT(*) FROM soak_claims WHERE host = '10.77.0.2'",
        )
        .await
    }

    /// Returns the running jobs last claimed by the first host, with their tokens.
    async fn held(&self) -> Vec<(String, i64)> {
        sqlx::query_as(
            "SELECT id, lease_token FROM jobs WHERE state = 'running' \
             AND (SELECT host FROM soak_claims WHERE job = id ORDER BY soak_claims.ctid DESC LIMIT 1) = '10.77.0.2'",
        )
        .fetch_all(&self.pool)
        .await
        .expect("what it holds")
    }

    async fn as_they_are(&self) -> String {
        let asked = sqlx::query_scalar(AS_THEY_ARE).fetch_one(&self.pool);
        asked.await.expect("all ended jobs")
    }

    fn take_away(&self, how: Away) {
        match how {
            Away::Cut(cut) => self.hosts[0].cut(cut),
            Away::Paused => self.workers[0].signal("STOP"),
        }
    }

    fn give_back(&self, how: Away) {
        match how {
            Away::Cut(cut) => self.hosts[0].heal(cut),
            Away::Paused => self.workers[0].signal("CONT"),
        }
    }

    /// Disconnects or pauses the first host for three leases while it solves.
    async fn lose(&self, how: Away) {
        self.submit(6, 60).await;
        until("the first host solves", async || {
            !self.held().await.is_empty()
        })
        .await;
        let lost = Instant::now();
        self.take_away(how);
        // The jobs that it held at that moment. It may have ended some since.
        let held = self.held().await;
        let (ids, tokens): (Vec<_>, Vec<_>) = held.into_iter().unzip();
        until("its jobs are free", async || {
            let left: i64 = sqlx::query_scalar(
                "SELECT COUNT(*) FROM jobs JOIN unnest($1::text[], $2::bigint[]) AS held (one, token) \
                 ON id = one AND lease_token = token WHERE state = 'running'",
            )
            .bind(&ids)
            .bind(&tokens)
            .fetch_one(&self.pool)
            .await
            .expect("what it holds");
            left == 0
        })
        .await;
        let free = lost.elapsed();
        until_all_ended(&self.pool).await;
        sleep((3 * LEASE).saturating_sub(lost.elapsed())).await;
        let ended = self.as_they_are().await;
        let before = self.claims().await;
        self.give_back(how);
        let back = Instant::now();
        sleep(2 * LEASE).await;
        assert_eq!(
            ended,
            self.as_they_are().await,
            "{how:?}: a stale owner changed something"
        );
        until("it works again", async || {
            self.submit(0, 4).await;
            sleep(Duration::from_millis(200)).await;
            self.claims().await > before
        })
        .await;
        let works = back.elapsed();
        until_all_ended(&self.pool).await;
        assert_ended_once(&self.pool).await;
        row(
            &format!(
                "{how:?}: jobs held, seconds until they were free, seconds from its return to its next claim (at least 6)"
            ),
            format!(
                "{}, {:.1}, {:.1}",
                ids.len(),
                free.as_secs_f64(),
                works.as_secs_f64()
            ),
        );
        assert!(
            free < FREE_WITHIN,
            "{how:?}: its jobs were free after {free:?}"
        );
    }

    /// Disconnects the first host during an uncommitted claim. Nobody else can take the rows until the server ends its session.
    async fn lose_in_a_transaction(&self) {
        let slow = "INSERT INTO soak_slow VALUES ('10.77.0.2')";
        sqlx::raw_sql(slow).execute(&self.pool).await.expect("slow");
        let sleeping = "SELECT COUNT(*) FROM pg_stat_activity WHERE wait_event = 'PgSleep' AND host(client_addr) = '10.77.0.2'";
        let mut lost = None;
        until("a claim is under way", async || {
            if counted(&self.pool, sleeping).await == 0 {
                self.submit(0, 1).await;
                return false;
            }
            self.hosts[0].cut(Cut::BlackHole);
            lost = Some(Instant::now());
            true
        })
        .await;
        let lost = lost.expect("it was cut off");
        let slow = "TRUNCATE soak_slow";
        sqlx::raw_sql(slow).execute(&self.pool).await.expect("fast");
        let open = "SELECT COUNT(*) FROM pg_stat_activity WHERE xact_start IS NOT NULL AND host(client_addr) = '10.77.0.2'";
        until("its transaction is over", async || {
            counted(&self.pool, open).await == 0
        })
        .await;
        let free = lost.elapsed();
        until_all_ended(&self.pool).await;
        self.hosts[0].heal(Cut::BlackHole);
        row(
            "cut off in the transaction of a claim: seconds until its rows were free",
            format!("{:.1}", free.as_secs_f64()),
        );
        assert!(free < FREE_WITHIN, "its rows were free after {free:?}");
    }

    /// Disconnects an API node from the database, and tests the responses to clients and when it serves them again.
    async fn lose_the_database(&self) {
        let host = Host::new(4);
        let node = start(&host, "serve", &self.url);
        let running = node.submit(&endless_case("endless")).await;
        node.until(&running, "running").await;
        let (_, port) = postgres::at_port(&self.url);
        host.cut(Cut::Port(port));
        let client = Client::builder().timeout(WITHIN).build().expect("a client");
        let ask = async |method: Method, path: &str| {
            let url = format!("http://{}{path}", node.address());
            let mut request = client.request(method.clone(), url);
            if method == Method::POST {
                request = request.json(&case("refused"));
            }
            let since = Instant::now();
            let status = request.send().await.expect("an answer").status().as_u16();
            (status, since.elapsed().as_secs_f64())
        };
        let mut said = Vec::new();
        for (method, path) in [
            (Method::GET, "/v1/jobs"),
            (Method::GET, "/readyz"),
            (Method::POST, "/v1/jobs"),
            (Method::GET, "/v1/jobs"),
        ] {
            let (status, seconds) = ask(method.clone(), path).await;
            said.push(format!("{method} {path} {status} after {seconds:.1} s"));
            assert_eq!(status, 503, "{said:?}");
        }
        row("an API node without its database", said.join(", "));
        host.heal(Cut::Port(port));
        let back = Instant::now();
        until("it is ready again", async || {
            ask(Method::GET, "/readyz").await.0 == 200
        })
        .await;
        let ready = back.elapsed().as_secs_f64();
        // The node learns of the cancellation at another node by the notification or by polling.
        self.api.cancel(&running).await;
        node.until(&running, "cancelled").await;
        row(
            "seconds from the return of the database until it is ready",
            format!("{ready:.1}"),
        );
    }
}

/// Runs all tests, one after the other.
pub async fn run() {
    let Some(network) = Network::new().await else {
        return;
    };
    for how in [
        Away::Cut(Cut::BlackHole),
        Away::Cut(Cut::Cable),
        Away::Cut(Cut::OneWay),
        Away::Paused,
    ] {
        network.lose(how).await;
    }
    network.lose_in_a_transaction().await;
    network.lose_the_database().await;
    for worker in &network.workers {
        assert!(
            !worker.log_text().contains("panicked"),
            "{}",
            worker.log_text()
        );
    }
}
