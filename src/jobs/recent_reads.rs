//! What was read a moment ago, for all who ask for the same: however many clients follow a batch, the store is asked once.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::time::Instant;
use uuid::Uuid;

use crate::model::Kind;
use crate::sync::lock;

/// Whose work, of which kind, and which.
type OwnedId = (Arc<str>, Kind, Uuid);
type SharedRead<T> = Arc<tokio::sync::Mutex<Option<(Instant, T)>>>;

/// The last reads of what clients follow.
pub(crate) struct RecentReads<T>(Mutex<HashMap<OwnedId, SharedRead<T>>>);

impl<T> Default for RecentReads<T> {
    fn default() -> Self {
        RecentReads(Mutex::default())
    }
}

impl<T> fmt::Debug for RecentReads<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RecentReads")
    }
}

impl<T: Clone> RecentReads<T> {
    /// What a read finds, or found not longer than `age` ago. While one caller reads, the others wait for its answer.
    pub(crate) async fn at<E>(
        &self,
        id: OwnedId,
        age: Duration,
        read: impl Future<Output = Result<T, E>>,
    ) -> Result<T, E> {
        if age.is_zero() {
            return read.await;
        }
        let last = {
            let mut all = lock(&self.0);
            Arc::clone(all.entry(id).or_default())
        };
        let mut seen = last.lock().await;
        if let Some((when, found)) = seen.as_ref()
            && when.elapsed() < age
        {
            return Ok(found.clone());
        }
        let found = read.await?;
        *seen = Some((Instant::now(), found.clone()));
        drop(seen);
        drop(last);
        self.forget(age);
        Ok(found)
    }

    /// Forgets what is not read any more.
    fn forget(&self, age: Duration) {
        let mut all = lock(&self.0);
        all.retain(|_, read| {
            Arc::strong_count(read) > 1
                || read.try_lock().is_ok_and(|seen| {
                    seen.as_ref()
                        .is_some_and(|(when, _)| when.elapsed() < 4 * age)
                })
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[tokio::test]
    async fn a_thousand_clients_that_ask_for_the_same_cause_a_few_reads() {
        let reads = Arc::new(RecentReads::<u64>::default());
        let asked = Arc::new(AtomicU64::new(0));
        let tenant: Arc<str> = "t".into();
        let (id, age) = (Uuid::now_v7(), Duration::from_millis(200));
        for round in 1..=2 {
            let (before, began) = (asked.load(Ordering::SeqCst), Instant::now());
            let all = (0..1000).map(|_| {
                let (reads, asked, tenant) = (reads.clone(), asked.clone(), tenant.clone());
                tokio::spawn(async move {
                    let read = async {
                        tokio::time::sleep(Duration::from_millis(5)).await;
                        Ok::<_, ()>(asked.fetch_add(1, Ordering::SeqCst) + 1)
                    };
                    reads.at((tenant, Kind::Case, id), age, read).await
                })
            });
            for found in all.collect::<Vec<_>>() {
                assert!(found.await.unwrap().unwrap() > before, "older than allowed");
            }
            // A read serves all callers until it is too old.
            let made = asked.load(Ordering::SeqCst) - before;
            let most = 1 + began.elapsed().as_millis() / age.as_millis();
            assert!(u128::from(made) <= most, "round {round}: {made}");
            tokio::time::sleep(age).await;
        }
        // A failed read is the answer of its caller alone, and what is not followed is forgotten.
        let failed = reads
            .at((tenant.clone(), Kind::Case, id), age, async {
                Err::<u64, _>("away")
            })
            .await;
        assert_eq!(failed, Err("away"));
        let other = reads.at((tenant, Kind::Case, Uuid::now_v7()), age, async {
            Ok::<_, ()>(7)
        });
        assert_eq!(other.await, Ok(7));
        tokio::time::sleep(5 * age).await;
        reads.forget(age);
        assert!(reads.0.lock().unwrap().is_empty());
    }
}
