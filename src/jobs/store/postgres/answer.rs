//! Calls that end in any case: what a database says that does not answer.

use std::time::Duration;

use tokio::time::timeout;

use crate::error::{StorageFault, StoreError};
use crate::store::Result;

/// How long a call may take; the server ends its statements before.
const ANSWERED_WITHIN: Duration = Duration::from_secs(15);

/// Makes a call that ends in any case, also if nothing comes back.
pub(crate) async fn in_time<T>(call: impl Future<Output = Result<T>>) -> Result<T> {
    let answer = timeout(ANSWERED_WITHIN, call).await;
    answer
        .unwrap_or_else(|_| Err(StoreError::timed_out()))
        .map_err(far)
}

/// A server that takes nothing is no disk that takes nothing: the answer to clients says which.
fn far(error: StoreError) -> StoreError {
    match error {
        StoreError::Away(StorageFault::Unwritable, cause) => {
            StoreError::Away(StorageFault::Unreachable, cause)
        }
        other => other,
    }
}
