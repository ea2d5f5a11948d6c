//! The rows of an embedded job table, for those who move them elsewhere.

use std::sync::Arc;

use tokio::sync::mpsc;

use crate::error::StoreError;
use crate::store::Result;
use crate::store::portion::{Portion, Values};
use crate::store::sqlite::connection::{Row, SqliteRow, query, query_scalar};
use crate::store::sqlite::database::SqliteStore;

/// A portion ends with this row, or once its bytes are so many.
const ROWS_MAX: usize = 500;
const BYTES_MAX: usize = 4 << 20;

impl SqliteStore {
    /// The rows of a table, some at a time.
    pub(crate) fn portions(&self, table: &'static str) -> mpsc::Receiver<Result<Portion>> {
        let (sender, portions) = mpsc::channel(1);
        let store = self.clone();
        tokio::spawn(async move {
            if let Err(error) = store.send(table, &sender).await {
                // Nobody may listen any more.
                let _ = sender.send(Err(error)).await;
            }
        });
        portions
    }

    async fn send(
        &self,
        table: &'static str,
        sender: &mpsc::Sender<Result<Portion>>,
    ) -> Result<()> {
        let columns = query("SELECT name, type FROM pragma_table_info($1) ORDER BY cid");
        let columns = columns.bind(table).fetch_all(&self.readers).await?;
        let columns = columns
            .iter()
            .map(|row| Ok((row.try_get("name")?, row.try_get("type")?)))
            .collect::<Result<Vec<(String, String)>>>()?;
        let mut connection = self.readers.acquire().await?;
        let sender = sender.clone();
        let reading = tokio::task::spawn_blocking(move || {
            let names: Vec<_> = columns
                .iter()
                .map(|(name, _)| format!("\"{name}\""))
                .collect();
            let rows = query(format!("SELECT {} FROM {table}", names.join(", ")));
            let (mut portion, mut bytes) = (empty(&columns), 0);
            rows.for_each_now(&mut connection, |row| {
                bytes += add(&mut portion, row)?;
                if portion.rows < ROWS_MAX && bytes < BYTES_MAX {
                    return Ok(true);
                }
                bytes = 0;
                let full = std::mem::replace(&mut portion, empty(&columns));
                Ok(sender.blocking_send(Ok(full)).is_ok())
            })?;
            if portion.rows > 0 {
                let _ = sender.blocking_send(Ok(portion));
            }
            Ok(())
        });
        let ended = |error| StoreError::Failed(Arc::new(error));
        reading.await.map_err(ended)?
    }
}

fn empty(columns: &[(String, String)]) -> Portion {
    let values = |kind: &str| match kind {
        "INTEGER" => Values::Integer(Vec::new()),
        "REAL" => Values::Real(Vec::new()),
        "BLOB" => Values::Bytes(Vec::new()),
        _ => Values::Text(Vec::new()),
    };
    Portion {
        columns: columns
            .iter()
            .map(|(name, kind)| (name.clone(), values(kind)))
            .collect(),
        rows: 0,
    }
}

/// Adds a row; its bytes, as far as they count.
fn add(portion: &mut Portion, row: &SqliteRow) -> Result<usize> {
    let mut bytes = 0;
    for (place, (_, values)) in portion.columns.iter_mut().enumerate() {
        match values {
            Values::Integer(values) => values.push(row.try_get(place)?),
            Values::Real(values) => values.push(row.try_get(place)?),
            Values::Text(values) => {
                let value: Option<String> = row.try_get(place)?;
                bytes += value.as_ref().map_or(0, String::len);
                values.push(value);
            }
            Values::Bytes(values) => {
                let value: Option<Vec<u8>> = row.try_get(place)?;
                bytes += value.as_ref().map_or(0, Vec::len);
                values.push(value);
            }
        }
    }
    portion.rows += 1;
    Ok(bytes)
}

impl SqliteStore {
    /// The keys of the large results that something refers to.
    pub(crate) async fn large_results(&self) -> Result<Vec<String>> {
        let keys = query_scalar("SELECT DISTINCT key FROM blobs WHERE key IS NOT NULL");
        keys.fetch_all(&self.readers).await
    }
}
