//! Tests a run of many rows concurrent with the jobs: each row has one answer in its place, the same at every API node.

use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use sqlx::PgPool;

use crate::cluster::Cluster;
use crate::row;

/// An accepted run.
pub struct SentRun {
    id: String,
    rows: usize,
}

/// Returns one case with distinct loads and creepages for each row. Each row takes about a millisecond.
fn body(rows: usize, name: &str) -> Value {
    let each = |of: fn(usize) -> f64| (0..rows).map(of).collect::<Vec<_>>();
    let columns = json!({
        "normal_force_n": each(|row| 50_000.0 + (row % 9973) as f64),
        "creepage_x": each(|row| 1e-4 * ((row % 41) as f64 - 20.0)),
        "km": each(|row| row as f64 * 0.01),
    });
    json!({
        "template": {
            "name": name,
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 1 },
            "motion": { "creepage_x": 0, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
            "solver": { "method": "boundary_element", "mesh": { "strips": 6, "cells": 6 } },
        },
        "columns": columns,
    })
}

impl SentRun {
    /// Sends a run with an idempotency key until it is accepted.
    pub async fn send(cluster: &Arc<Cluster>, rows: usize, name: &str) -> SentRun {
        let (id, _) = cluster.submit("/v1/runs", &body(rows, name), name, 0).await;
        SentRun { id, rows }
    }

    /// Requires an answer to every row at every API node. Returns the largest number of attempts of its chunks.
    pub async fn verify(&self, cluster: &Cluster, pool: &PgPool) -> i64 {
        let chunks: Vec<(String, i64, i64)> = sqlx::query_as(
            "SELECT state, COUNT(*), MAX(attempt) FROM jobs WHERE batch_id = $1 GROUP BY state",
        )
        .bind(&self.id)
        .fetch_all(pool)
        .await
        .expect("chunks");
        let began = Instant::now();
        let path = format!(
            "/v1/runs/{}/results?format=csv&columns=row,status,force_x_n",
            self.id
        );
        let text = cluster.read_everywhere(&path).await;
        self.assert_rows(&text);
        row(
            "rows of a run, each answered in its place and alike at both API nodes; its chunks and most attempts; seconds to read it twice",
            format!(
                "{}; {chunks:?}; {:.1}",
                self.rows,
                began.elapsed().as_secs_f64()
            ),
        );
        assert!(
            chunks.len() == 1 && chunks[0].0 == "succeeded",
            "{chunks:?}"
        );
        chunks[0].2
    }

    fn assert_rows(&self, csv: &str) {
        let mut lines = csv.lines();
        assert_eq!(lines.next(), Some("row,status,force_x_n"));
        let mut number = 0;
        for line in lines {
            let mut cells = line.split(',');
            let cells = [cells.next(), cells.next(), cells.next()].map(Option::unwrap_or_default);
            assert_eq!(cells[0], number.to_string(), "{line}");
            assert_eq!(cells[1], "ok", "{line}");
            assert!(cells[2].parse::<f64>().is_ok_and(f64::is_finite), "{line}");
            number += 1;
        }
        assert_eq!(number, self.rows);
    }
}
