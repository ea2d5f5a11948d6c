//! The bell: notifications, sent after the commit and on their own. Inside a transaction that writes, a notification makes all
//! commits of the server wait for each other.

use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgListener, PgPool};
use tokio::sync::mpsc;
use tokio::time::timeout;
use uuid::Uuid;

use crate::jobs::store::cluster::Bell;
use crate::jobs::store::postgres::answer::in_time;
use crate::jobs::store_error::StoreError;

/// The channel of all nodes.
const CHANNEL: &str = "railhead";

/// Shortest time between two notifications of a node.
const PAUSE: Duration = Duration::from_millis(10);

/// Most bells in one notification, whose text may have 8000 bytes.
const BELLS_MAX: usize = 200;

/// After so long without a bell the server is asked whether it is still there: on a way that was cut, silence is all there is.
const SILENT_FOR: Duration = Duration::from_secs(10);

/// Bells that wait; further ones are left out, and found by looking.
const WAITING: usize = 10_000;

/// The way to the task that rings; it ends with the last of these.
#[derive(Debug, Clone)]
pub(crate) struct BellRinger(mpsc::Sender<Bell>);

impl BellRinger {
    /// Starts the task.
    pub(crate) fn start(pool: PgPool) -> BellRinger {
        let (sender, waiting) = mpsc::channel(WAITING);
        tokio::spawn(ring_all(pool, waiting));
        BellRinger(sender)
    }

    /// Rings soon.
    pub(crate) fn ring(&self, bell: Bell) {
        // A bell is a hint; who misses it looks a moment later.
        let _ = self.0.try_send(bell);
    }
}

async fn ring_all(pool: PgPool, mut waiting: mpsc::Receiver<Bell>) {
    let mut bells = Vec::with_capacity(BELLS_MAX);
    while waiting.recv_many(&mut bells, BELLS_MAX).await > 0 {
        let text = text_of(&bells);
        bells.clear();
        let rung = sqlx::query("SELECT pg_notify($1, $2)")
            .bind(CHANNEL)
            .bind(text)
            .execute(&pool);
        let rung = in_time(async { Ok(rung.await?) }).await;
        if let Err(error) = rung {
            tracing::debug!(%error, "a bell could not be rung");
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// `w`, `e` with an id, `c` with an id; the first only once.
fn text_of(bells: &[Bell]) -> String {
    let mut words = Vec::with_capacity(bells.len());
    if bells.contains(&Bell::Work) {
        words.push("w".to_owned());
    }
    words.extend(bells.iter().filter_map(|bell| match bell {
        Bell::Work => None,
        Bell::Ended(id) => Some(format!("e{}", id.simple())),
        Bell::Cancel(id) => Some(format!("c{}", id.simple())),
    }));
    words.join(" ")
}

/// A word that says nothing to this version is left out.
fn read(word: &str) -> Option<Bell> {
    let id = || Uuid::try_parse(word.get(1..)?).ok();
    match word.get(..1)? {
        "w" => Some(Bell::Work),
        "e" => id().map(Bell::Ended),
        "c" => id().map(Bell::Cancel),
        _ => None,
    }
}

/// Passes on what all nodes ring, until the connection fails.
pub(crate) async fn listen(
    options: PgConnectOptions,
    heard: &(dyn Fn(Bell) + Send + Sync),
) -> Result<(), StoreError> {
    let mut listener = in_time(async {
        let pool = sqlx::postgres::PgPoolOptions::new()
            .max_connections(1)
            .connect_with(options)
            .await?;
        let mut listener = PgListener::connect_with(&pool).await?;
        listener.listen(CHANNEL).await?;
        Ok(listener)
    })
    .await?;
    loop {
        let notification = match timeout(SILENT_FOR, listener.try_recv()).await {
            Ok(Ok(Some(notification))) => notification,
            // The connection failed and was made again; what was rung meanwhile is found by looking.
            Ok(Ok(None)) => continue,
            Ok(Err(error)) => return Err(error.into()),
            Err(_) => {
                let asked = sqlx::query("SELECT 1").execute(&mut listener);
                in_time(async { Ok(asked.await?) }).await?;
                continue;
            }
        };
        notification
            .payload()
            .split(' ')
            .filter_map(read)
            .for_each(heard);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_rung_is_heard_and_fits_into_a_notification() {
        let (one, other) = (Uuid::now_v7(), Uuid::now_v7());
        let bells = [
            Bell::Ended(one),
            Bell::Work,
            Bell::Cancel(other),
            Bell::Work,
        ];
        let heard: Vec<_> = text_of(&bells).split(' ').filter_map(read).collect();
        assert_eq!(heard, [Bell::Work, Bell::Ended(one), Bell::Cancel(other)]);
        assert_eq!(read("z1"), None);
        assert_eq!(read(""), None);
        assert!(text_of(&[Bell::Ended(one); BELLS_MAX]).len() < 8000);
    }
}
