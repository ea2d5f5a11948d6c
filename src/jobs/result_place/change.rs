//! `railhead move-results`: moves the large results of a database to another location.

use futures_util::{StreamExt, TryStreamExt, stream};
use object_store::ObjectStore;

use crate::blobs::{Blobs, Copied};
use crate::error::{JobsError, Result};
use crate::metrics::StoreRequests;
use crate::result_place::settle::{IN_DATABASE, decide, mark, marker, on_this_machine_alone};
use crate::result_place::url::{ResultsPlace, ResultsUrl};
use crate::store::postgres::database::PostgresStore;
use crate::store::{Cluster, Deployment, Store};

/// Number of concurrent copies, which mostly wait for requests. Chosen by judgement, below the default of 10 database connections.
const AT_ONCE: usize = 8;

/// Result of [`move_results`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MovedResults {
    /// Previous location; empty: in the database.
    pub from: String,
    /// The results in the new location.
    pub results: Copied,
}

/// Copies the large results of a database that no node uses to another location, and records the location. Results in the
/// database are removed afterwards; results elsewhere stay. A failure before that changes nothing, and the call can be
/// repeated.
///
/// # Errors
/// A node uses the database, no node was ever started, the location belongs to another database or is the current one, or a
/// read or write failed.
pub async fn move_results(url: &str, place: &ResultsPlace) -> Result<MovedResults> {
    let database = PostgresStore::open(url, 4).await?;
    let moved = move_within(&database, place).await;
    database.close().await;
    moved
}

async fn move_within(database: &PostgresStore, place: &ResultsPlace) -> Result<MovedResults> {
    let refused = |why: String| Err(JobsError::ResultPlace(why));
    on_this_machine_alone(place)?;
    let before = without_nodes(database).await?;
    let Some(from) = before.results_place.clone() else {
        return refused(
            "it is not decided yet: start the first node with --results-url".to_owned(),
        );
    };
    if from == place.url.to_string() {
        return refused(format!(
            "the results of this database are in {from} already"
        ));
    }
    let old = open_old(database, &before, &from).await?;
    let objects = place.url.open(StoreRequests::default())?;
    match marker(&*objects).await? {
        Some(marker) if marker.deployment != before.id => return Err(marker.foreign(&place.url)),
        Some(_) => {}
        None => mark(&*objects, &before, &place.url.to_string()).await?,
    }
    let new = Blobs::at(objects, place.url.folder());
    let mut results = Copied::default();
    let keys = database.result_keys().await?;
    let mut copies = stream::iter(&keys)
        .map(|key| old.copy(key, &new))
        .buffer_unordered(AT_ONCE);
    while let Some(copied) = copies.try_next().await? {
        results.add(copied);
    }
    // A node that was started in the meantime may have written to the previous location.
    without_nodes(database).await?;
    if database.result_keys().await? != keys {
        return refused("a node has written results meanwhile; move them again".to_owned());
    }
    decide(database, &before, &place.url.to_string()).await?;
    if from == IN_DATABASE {
        database.remove_objects().await?;
    }
    Ok(MovedResults { from, results })
}

/// The deployment, if no node uses the database.
async fn without_nodes(database: &PostgresStore) -> Result<Deployment> {
    let deployment = database.deployment().await?;
    match deployment.nodes {
        0 => Ok(deployment),
        nodes => Err(JobsError::ResultPlace(format!(
            "{nodes} nodes were seen within 20 s; stop all nodes to move results"
        ))),
    }
}

async fn open_old(database: &PostgresStore, deployment: &Deployment, from: &str) -> Result<Blobs> {
    if from == IN_DATABASE {
        return Ok(Blobs::at(database.objects(), None));
    }
    let url: ResultsUrl = from.parse().map_err(JobsError::ResultPlace)?;
    let objects: std::sync::Arc<dyn ObjectStore> = url.open(StoreRequests::default())?;
    match marker(&*objects).await? {
        Some(marker) if marker.deployment == deployment.id => Ok(Blobs::at(objects, url.folder())),
        _ => Err(JobsError::ResultPlace(format!(
            "{from}, where the results of this database are, does not have its marker"
        ))),
    }
}
