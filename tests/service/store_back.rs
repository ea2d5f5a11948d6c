//! Tests a database that returns to an earlier state, as after a restore or a failover that lost the last commits. Workers then continue with
//! claims that it does not know.

use std::collections::BTreeSet;
use std::path::PathBuf;

#[cfg(feature = "cluster")]
use sqlx::{AssertSqlSafe, Connection, PgConnection};
use uuid::Uuid;

use crate::model::Model;
use crate::store::StoreKind;
use crate::store_moves::Pair;

/// The tables in PostgreSQL. A table comes after the tables that it refers to.
#[cfg(feature = "cluster")]
const TABLES: [&str; 14] = [
    "templates",
    "batches",
    "blobs",
    "jobs",
    "cases",
    "job_labels",
    "job_counts",
    "stored_bytes",
    "objects",
    "blob_outbox",
    "job_slices",
    "batch_keys",
    "idempotency_keys",
    "tombstones",
];

/// The tables whose triggers count.
#[cfg(feature = "cluster")]
const COUNTED: [&str; 3] = ["templates", "blobs", "jobs"];

/// A saved state of the model and the test, to which the database can return.
#[derive(Debug)]
pub struct Saved {
    model: Model,
    ids: Vec<Uuid>,
    batches: Vec<Uuid>,
    given: BTreeSet<String>,
}

impl Pair {
    /// Returns the paths of the file of an embedded store and of its copy.
    fn files(&self) -> [PathBuf; 2] {
        ["jobs.db", "saved.db"].map(|name| self.table.folder.path().join(name))
    }

    #[cfg(feature = "cluster")]
    async fn server(&self, statements: String) {
        let url = self.table.url.as_deref().expect("a server");
        let mut connection = PgConnection::connect(url).await.unwrap();
        let done = sqlx::raw_sql(AssertSqlSafe(statements)).execute(&mut connection);
        done.await.unwrap();
        connection.close().await.unwrap();
    }

    /// Saves the state of the database.
    pub async fn save(&mut self) {
        match self.table.kind {
            StoreKind::Sqlite => {
                let [file, copy] = self.files();
                let _ = std::fs::remove_file(&copy);
                let connection = rusqlite::Connection::open(file).unwrap();
                connection
                    .execute("VACUUM INTO ?", [copy.to_str()])
                    .unwrap();
            }
            #[cfg(feature = "cluster")]
            StoreKind::Postgres => {
                let copy = TABLES.map(|table| {
                    format!("DROP TABLE IF EXISTS saved_{table}; CREATE TABLE saved_{table} AS TABLE {table};")
                });
                self.server(copy.join(" ")).await;
            }
        }
        self.saved = Some(Saved {
            model: self.model.clone(),
            ids: self.ids.clone(),
            batches: self.batches.clone(),
            given: self.given.clone(),
        });
    }

    /// Restores the saved state of the database. Workers keep the claims that were made since.
    pub async fn go_back(&mut self) {
        let Some(saved) = &self.saved else {
            return;
        };
        match self.table.kind {
            StoreKind::Sqlite => {
                self.store.close().await;
                let [file, copy] = self.files();
                for end in ["-wal", "-shm"] {
                    let _ = std::fs::remove_file(format!("{}{end}", file.display()));
                }
                std::fs::copy(copy, file).unwrap();
                self.store = self.table.open_again().await;
            }
            #[cfg(feature = "cluster")]
            StoreKind::Postgres => {
                let back =
                    TABLES.map(|table| format!("INSERT INTO {table} SELECT * FROM saved_{table};"));
                let triggers = |state: &str| {
                    COUNTED.map(|table| format!("ALTER TABLE {table} {state} TRIGGER USER;"))
                };
                let statements = format!(
                    "BEGIN; {} TRUNCATE {}; {} {} COMMIT",
                    triggers("DISABLE").join(" "),
                    TABLES.join(", "),
                    back.join(" "),
                    triggers("ENABLE").join(" ")
                );
                self.server(statements).await;
            }
        }
        self.model = saved.model.clone();
        self.ids = saved.ids.clone();
        self.batches = saved.batches.clone();
        self.given = saved.given.clone();
    }
}
