//! Notifications between nodes (`NOTIFY`). They are sent after the commit, outside its transaction, because a transaction
//! that notifies serialises the commits of the whole server.

use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgListener, PgPool};
use tokio::sync::mpsc;
use tokio::time::timeout;
use uuid::Uuid;

use crate::store::postgres::connection::in_time;
use crate::store::{Notification, Result};

/// The channel of all nodes.
const CHANNEL: &str = "railhead";

/// Minimum interval between two notifications of a node.
const PAUSE: Duration = Duration::from_millis(10);

/// Maximum number of notifications in one `NOTIFY`, whose payload is limited to 8000 bytes.
const BATCH_MAX: usize = 200;

/// Time without a notification after which the connection is checked, because a dead connection is silent.
const SILENT_FOR: Duration = Duration::from_secs(10);

/// Maximum number of pending notifications; further ones are dropped, and other nodes find the change by polling.
const WAITING: usize = 10_000;

/// A handle to the task that sends notifications; the task ends with its last handle.
#[derive(Debug, Clone)]
pub(crate) struct Notifier(mpsc::Sender<Notification>);

impl Notifier {
    /// Starts the task.
    pub(crate) fn start(pool: PgPool) -> Notifier {
        let (sender, waiting) = mpsc::channel(WAITING);
        tokio::spawn(send_all(pool, waiting));
        Notifier(sender)
    }

    /// Sends a notification soon, unless too many are pending.
    pub(crate) fn publish(&self, notification: Notification) {
        // Nodes that miss a notification poll a moment later.
        let _ = self.0.try_send(notification);
    }
}

async fn send_all(pool: PgPool, mut waiting: mpsc::Receiver<Notification>) {
    let mut notifications = Vec::with_capacity(BATCH_MAX);
    while waiting.recv_many(&mut notifications, BATCH_MAX).await > 0 {
        let text = text_of(&notifications);
        notifications.clear();
        let sent = sqlx::query("SELECT pg_notify($1, $2)")
            .bind(CHANNEL)
            .bind(text)
            .execute(&pool);
        let sent = in_time(async { Ok(sent.await?) }).await;
        if let Err(error) = sent {
            tracing::debug!(%error, "a notification could not be sent");
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// The payload: `w`, `e` with an id, or `c` with an id; `w` only once.
fn text_of(notifications: &[Notification]) -> String {
    let mut words = Vec::with_capacity(notifications.len());
    if notifications.contains(&Notification::Work) {
        words.push("w".to_owned());
    }
    words.extend(
        notifications
            .iter()
            .filter_map(|notification| match notification {
                Notification::Work => None,
                Notification::Ended(id) => Some(format!("e{}", id.simple())),
                Notification::Cancel(id) => Some(format!("c{}", id.simple())),
            }),
    );
    words.join(" ")
}

/// Parses a word of a payload; `None` for words of later versions.
fn read(word: &str) -> Option<Notification> {
    let id = || Uuid::try_parse(word.get(1..)?).ok();
    match word.get(..1)? {
        "w" => Some(Notification::Work),
        "e" => id().map(Notification::Ended),
        "c" => id().map(Notification::Cancel),
        _ => None,
    }
}

/// Passes the notifications of all nodes to `heard` until the connection fails.
pub(crate) async fn listen(
    options: PgConnectOptions,
    heard: &(dyn Fn(Notification) + Send + Sync),
) -> Result<()> {
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
            // The connection was restored; changes in between are found by polling.
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
        let notifications = [
            Notification::Ended(one),
            Notification::Work,
            Notification::Cancel(other),
            Notification::Work,
        ];
        let heard: Vec<_> = text_of(&notifications)
            .split(' ')
            .filter_map(read)
            .collect();
        assert_eq!(
            heard,
            [
                Notification::Work,
                Notification::Ended(one),
                Notification::Cancel(other)
            ]
        );
        assert_eq!(read("z1"), None);
        assert_eq!(read(""), None);
        assert!(text_of(&[Notification::Ended(one); BATCH_MAX]).len() < 8000);
    }
}
