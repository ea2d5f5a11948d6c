//! Where large results are, if not in the data folder or the database: a folder that all nodes share, or an object store.
//!
//! | to find | look in |
//! |---|---|
//! | the URL, and the store that it names | [`url`] |
//! | how requests to an object store are sent, and how long they are waited for | `client` |
//! | what ties a database and the place of its results together | [`settle`] |
//! | how all results go to another place | `change` |

#[cfg(feature = "cluster")]
pub mod change;
#[cfg(feature = "cluster")]
pub(crate) mod client;
pub(crate) mod settle;
pub mod url;

#[cfg(feature = "cluster")]
use crate::error::Result;
#[cfg(feature = "cluster")]
use crate::result_place::url::ResultsPlace;
#[cfg(feature = "cluster")]
use crate::store::{
    Store,
    postgres::{database::PostgresStore, doctor::Finding},
};

/// Examines the place of the results of a database.
///
/// # Errors
/// The database cannot be reached, or has no job table.
#[cfg(feature = "cluster")]
pub async fn examine_results(url: &str, place: Option<&ResultsPlace>) -> Result<Finding> {
    let store = PostgresStore::open(url, 1).await?;
    let examined = settle::examine(&store, place).await;
    store.close().await;
    let (says, wrong) = examined?;
    Ok(Finding {
        about: "place of the results",
        says,
        wrong,
    })
}
