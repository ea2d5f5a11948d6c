//! Export of the rows of an embedded job table.

use tokio::runtime::Handle;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use crate::store::Result;
use crate::store::sqlite::connection::{Row, query, query_scalar};
use crate::store::sqlite::database::SqliteStore;

/// Maximum number of rows and bytes of a portion.
const ROWS_MAX: usize = 500;
const BYTES_MAX: usize = 8 << 20;

/// A portion of a table: number of rows, and a JSON array with an object for each.
pub(crate) type Portion = (usize, String);

impl SqliteStore {
    /// The columns of a table, each with its type: `INTEGER`, `REAL`, `TEXT` or `BLOB`.
    pub(crate) async fn columns(&self, table: &'static str) -> Result<Vec<(String, String)>> {
        let columns = query("SELECT name, type FROM pragma_table_info($1) ORDER BY cid");
        let columns = columns.bind(table).fetch_all(&self.readers).await?;
        let columns = columns.iter();
        let columns = columns.map(|row| Ok((row.try_get("name")?, row.try_get("type")?)));
        columns.collect()
    }

    /// Reads the rows of a table in portions, by a separate task. Bytes are hexadecimal texts; real numbers are texts
    /// with all their digits.
    pub(crate) async fn portions(
        &self,
        table: &'static str,
        columns: &[(String, String)],
    ) -> Result<(mpsc::Receiver<Portion>, JoinHandle<Result<()>>)> {
        let members = columns.iter().map(|(name, kind)| {
            let value = match kind.as_str() {
                "BLOB" => format!("hex(\"{name}\")"),
                "REAL" => format!("format('%!.17g', \"{name}\")"),
                _ => format!("\"{name}\""),
            };
            format!("'{name}', iif(\"{name}\" IS NULL, NULL, {value})")
        });
        let members: Vec<String> = members.collect();
        let all = query(format!(
            "SELECT json_object({}) AS line FROM {table}",
            members.join(", ")
        ));
        let mut connection = self.readers.acquire().await?;
        let (sender, portions) = mpsc::channel(1);
        let runtime = Handle::current();
        let reading = tokio::task::spawn_blocking(move || {
            let (mut rows, mut text) = (0, String::new());
            let read = all.for_each(&mut *connection, |row| {
                text.push(if rows == 0 { '[' } else { ',' });
                text.push_str(&row.try_get::<String, _>("line")?);
                rows += 1;
                if rows < ROWS_MAX && text.len() < BYTES_MAX {
                    return Ok(true);
                }
                let full = (std::mem::take(&mut rows), std::mem::take(&mut text) + "]");
                Ok(sender.blocking_send(full).is_ok())
            });
            runtime.block_on(read)?;
            if rows > 0 {
                // The receiver may be closed.
                let _ = sender.blocking_send((rows, text + "]"));
            }
            Ok(())
        });
        Ok((portions, reading))
    }

    /// The keys of all referenced large results.
    pub(crate) async fn large_results(&self) -> Result<Vec<String>> {
        let keys = query_scalar("SELECT DISTINCT key FROM blobs WHERE key IS NOT NULL");
        keys.fetch_all(&self.readers).await
    }
}
