//! Moves the large results of a database to another place: `railhead move-results`.

use futures_util::{StreamExt, TryStreamExt, stream};
use object_store::ObjectStore;

use crate::blobs::Blobs;
use crate::error::{JobsError, Result};
use crate::metrics::StoreRequests;
use crate::result_place::settle::{IN_DATABASE, decide, mark, marker, on_this_machine_alone};
use crate::result_place::url::{ResultsPlace, ResultsUrl};
use crate::store::postgres::database::PostgresStore;
use crate::store::{Cluster, Deployment, Store};

/// Results that are copied at once: each waits for its requests most of the time. Chosen by judgement, below the usual 10 connections to
/// the database.
const AT_ONCE: usize = 8;

/// What was moved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MovedResults {
    /// Where they were; empty: in the database.
    pub from: String,
    /// How many there are now in the new place.
    pub results: u64,
    /// Bytes of these.
    pub bytes: u64,
    /// Those that were not where they were looked for; their jobs stay without.
    pub missing: u64,
}

/// Copies the large results of a database, which no node uses, to another place, and notes this place. What was in the database is removed
/// there afterwards; what was elsewhere stays. Whatever fails before that, nothing has changed, and it can be repeated.
///
/// # Errors
/// A node uses the database, no node has ever been started, the place is that of another database or the same as before, or something
/// cannot be read or written.
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
        Some(marker) if marker.deployment != before.id => {
            return refused(format!(
                "{} holds the results of another database ({}); use another prefix",
                place.url, marker.deployment
            ));
        }
        Some(_) => {}
        None => mark(&*objects, &before, &place.url.to_string()).await?,
    }
    let new = Blobs::at(objects, place.url.folder());
    let mut moved = MovedResults {
        from: from.clone(),
        results: 0,
        bytes: 0,
        missing: 0,
    };
    let keys = database.result_keys().await?;
    let mut copies = stream::iter(&keys)
        .map(|key| old.copy(key, &new))
        .buffer_unordered(AT_ONCE);
    while let Some(copied) = copies.try_next().await? {
        match copied {
            Some(bytes) => {
                moved.results += 1;
                moved.bytes += bytes;
            }
            None => moved.missing += 1,
        }
    }
    // A node that came meanwhile may have written where the results were.
    without_nodes(database).await?;
    if database.result_keys().await? != keys {
        return refused("a node has written results meanwhile; move them again".to_owned());
    }
    decide(database, &before, &place.url.to_string()).await?;
    if from == IN_DATABASE {
        database.remove_objects().await?;
    }
    Ok(moved)
}

/// What the database knows, if no node uses it.
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
