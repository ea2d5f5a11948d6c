//! Location of large results outside the data folder: in the database, in a shared folder, or in an object store.
//!
//! [`url`] parses the location and opens the store, `client` sends requests to object stores, [`settle`] binds a location
//! to a database, and `change` moves results.

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

/// Checks the location of the results of a database.
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
