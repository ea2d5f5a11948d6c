//! Binds the location of results to a database: the database records the location, and a marker object there names the
//! database. A node does not start with the results of another database, or with another location than that of its
//! database: results would be missing, or removed as orphans.

use std::time::Duration;

use bytes::Bytes;
use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutPayload};
use serde::{Deserialize, Serialize};
use tokio::time::timeout;

use crate::blobs::Blobs;
use crate::error::{JobsError, Result};
use crate::metrics::StoreRequests;
use crate::result_place::url::{ResultsPlace, ResultsUrl};
use crate::store::{Cluster, Deployment};

/// Name of the marker object.
const MARKER: &str = "railhead.json";

/// Time limit of the first requests together.
const SETTLED_WITHIN: Duration = Duration::from_secs(60);

/// Recorded location of results in the database itself.
pub(super) const IN_DATABASE: &str = "";

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Marker {
    pub(super) deployment: String,
}

impl Marker {
    /// The error for a location with the results of another database.
    pub(super) fn foreign(&self, url: &ResultsUrl) -> JobsError {
        JobsError::ResultPlace(format!(
            "{url} holds the results of another database ({}); use another prefix",
            self.deployment
        ))
    }
}

/// Opens the location of the results of a database; the first call for a database records it.
///
/// # Errors
/// [`JobsError::ResultPlace`] if location and database do not belong together, or one of them is unreachable.
pub(crate) async fn settle(
    cluster: &dyn Cluster,
    place: Option<&ResultsPlace>,
    requests: StoreRequests,
) -> Result<Blobs> {
    let settled = async {
        let Some(place) = place else {
            return settle_inside(cluster).await;
        };
        on_this_machine_alone(place)?;
        let objects = place.url.open(requests)?;
        settle_outside(cluster, &place.url, &*objects).await?;
        Ok(Blobs::at(objects, place.url.folder()))
    };
    let settled = timeout(SETTLED_WITHIN, settled).await;
    settled.map_err(|_| JobsError::ResultPlace("it does not answer".to_owned()))?
}

/// Rejects a folder that is not declared as shared by all nodes.
pub(super) fn on_this_machine_alone(place: &ResultsPlace) -> Result<()> {
    match (&place.url, place.shared) {
        (ResultsUrl::Folder(path), false) => Err(JobsError::ResultPlace(format!(
            "{} is a folder of this machine, and all nodes of a database share their results; give --results-shared if every \
             node has the same folder there (NFS), or use an object store",
            path.display()
        ))),
        _ => Ok(()),
    }
}

async fn settle_inside(cluster: &dyn Cluster) -> Result<Blobs> {
    let deployment = cluster.deployment().await?;
    match deployment.results_place.as_deref() {
        Some(IN_DATABASE) => {}
        Some(place) if deployment.in_use() => {
            return Err(JobsError::ResultPlace(format!(
                "the results of this database are in {place}; start the node with --results-url {place}"
            )));
        }
        _ => decide(cluster, &deployment, IN_DATABASE).await?,
    }
    Ok(Blobs::at(cluster.objects(), None))
}

async fn settle_outside(
    cluster: &dyn Cluster,
    url: &ResultsUrl,
    objects: &dyn ObjectStore,
) -> Result<()> {
    let deployment = cluster.deployment().await?;
    let place = url.to_string();
    let refused = |why: String| Err(JobsError::ResultPlace(why));
    match marker(objects).await? {
        Some(marker) if marker.deployment != deployment.id => Err(marker.foreign(url)),
        Some(_) if deployment.results_place.as_ref() == Some(&place) => Ok(()),
        // The same results with another URL, or a location whose first node failed.
        Some(_) if deployment.results_place.as_deref() != Some(IN_DATABASE) => {
            if let Some(known) = &deployment.results_place
                && is_another(objects, known, &deployment).await?
            {
                return refused(format!(
                    "the results of this database are in {known}; {place} has a copy of them, or the remains of a move. Start the \
                     node with --results-url {known}"
                ));
            }
            decide(cluster, &deployment, &place).await
        }
        Some(_) | None if deployment.in_use() => {
            let known = match deployment.results_place.as_deref() {
                Some(IN_DATABASE) => {
                    "the results of this database are in the database itself; start the node without --results-url"
                        .to_owned()
                }
                Some(known) if known == place => format!(
                    "there is no {MARKER} in {place}, where the results of this database are: they were removed, or this is another bucket with that name"
                ),
                Some(known) => format!(
                    "the results of this database are in {known}; start the node with --results-url {known}"
                ),
                None => "other nodes have just determined another location; start again".to_owned(),
            };
            refused(known)
        }
        _ => {
            mark(objects, &deployment, &place).await?;
            decide(cluster, &deployment, &place).await
        }
    }
}

/// Whether the recorded location exists and does not contain what is written to `objects`, which are then a copy or the
/// rest of a move.
///
/// # Errors
/// The location could not be written to, or the recorded location is in use and does not respond.
async fn is_another(
    objects: &dyn ObjectStore,
    known: &str,
    deployment: &Deployment,
) -> Result<bool> {
    let url: ResultsUrl = known.parse().map_err(JobsError::ResultPlace)?;
    if url.folder().is_some_and(|folder| !folder.exists()) {
        return Ok(false);
    }
    let there = url.open(StoreRequests::default())?;
    match marker(&*there).await {
        Ok(Some(marker)) if marker.deployment == deployment.id => {}
        Ok(_) => return Ok(false),
        // No node uses it, and this node may lack the permission to read it.
        Err(_) if deployment.nodes == 0 => return Ok(false),
        Err(error) => return Err(error),
    }
    match with_probe(objects, async |path| there.head(path).await).await? {
        Ok(_) => Ok(false),
        Err(Error::NotFound { .. }) => Ok(true),
        Err(error) => Err(unusable(error)),
    }
}

/// Content of the object that tests a location.
const PROBE: &[u8] = b"railhead probe";

/// Writes an object with the content [`PROBE`], returns the outcome of `look` at its path, and removes it.
async fn with_probe<T>(
    objects: &dyn ObjectStore,
    look: impl AsyncFnOnce(&Path) -> object_store::Result<T>,
) -> Result<object_store::Result<T>> {
    let path = Path::from(format!("probe-{}", uuid::Uuid::now_v7()));
    let written = objects.put(&path, PutPayload::from_static(PROBE)).await;
    written.map_err(unusable)?;
    let seen = look(&path).await;
    let removed = objects.delete(&path).await;
    removed.map_err(unusable)?;
    Ok(seen)
}

/// Records the location if the recorded one has not changed.
pub(super) async fn decide(cluster: &dyn Cluster, before: &Deployment, place: &str) -> Result<()> {
    let known = before.results_place.as_deref();
    if cluster.place_results(known, place).await? {
        tracing::info!(place, "the location of the results was determined");
        return Ok(());
    }
    match cluster.deployment().await?.results_place {
        Some(now) if now == place => Ok(()),
        _ => Err(JobsError::ResultPlace(
            "another node determined another location at the same time; start again".to_owned(),
        )),
    }
}

/// Reads the marker object.
pub(super) async fn marker(objects: &dyn ObjectStore) -> Result<Option<Marker>> {
    let found = match objects.get(&Path::from(MARKER)).await {
        Ok(found) => found.bytes().await?,
        Err(Error::NotFound { .. }) => return Ok(None),
        Err(error) => return Err(unusable(error)),
    };
    let marker = serde_json::from_slice(&found);
    marker.map(Some).map_err(|error| {
        JobsError::ResultPlace(format!("{MARKER} is none of this service: {error}"))
    })
}

/// Writes the marker object.
pub(super) async fn mark(
    objects: &dyn ObjectStore,
    deployment: &Deployment,
    place: &str,
) -> Result<()> {
    let text = serde_json::json!(Marker {
        deployment: deployment.id.clone()
    });
    let payload = PutPayload::from_bytes(Bytes::from(text.to_string()));
    let written = objects.put(&Path::from(MARKER), payload).await;
    written.map_err(unusable)?;
    // If two databases mark the same location at once, the last writer gets it.
    match marker(objects).await? {
        Some(marker) if marker.deployment == deployment.id => Ok(()),
        _ => Err(JobsError::ResultPlace(format!(
            "another database has marked {place} at the same moment"
        ))),
    }
}

fn unusable(error: Error) -> JobsError {
    JobsError::ResultPlace(error.to_string())
}

/// Checks the location of the results of a database by writing, reading and removing an object.
///
/// # Errors
/// The database failed.
#[cfg(feature = "cluster")]
pub(crate) async fn examine(
    cluster: &dyn Cluster,
    place: Option<&ResultsPlace>,
) -> Result<(String, bool)> {
    let deployment = cluster.deployment().await?;
    let Some(place) = place else {
        return Ok(match deployment.results_place.as_deref() {
            None => ("not decided: no node has been started".to_owned(), false),
            Some(IN_DATABASE) => ("in the database".to_owned(), false),
            Some(known) => (
                format!("{known}; not examined without --results-url"),
                false,
            ),
        });
    };
    let probed = timeout(SETTLED_WITHIN, probe(&deployment, &place.url)).await;
    Ok(match probed {
        Ok(Ok(())) => (
            format!("{}: an object was written, read and removed", place.url),
            false,
        ),
        Ok(Err(error)) => (format!("{}: {error}", place.url), true),
        Err(_) => (format!("{} does not answer", place.url), true),
    })
}

/// Checks the marker, and writes, reads and removes an object.
#[cfg(feature = "cluster")]
async fn probe(deployment: &Deployment, url: &ResultsUrl) -> Result<()> {
    let wrong = |why: String| Err(JobsError::ResultPlace(why));
    match &deployment.results_place {
        Some(known) if known != &url.to_string() => {
            let known = if known == IN_DATABASE {
                "itself"
            } else {
                known
            };
            return wrong(format!("this database has its results in {known}"));
        }
        _ => {}
    }
    let objects = url.open(StoreRequests::default())?;
    match marker(&*objects).await? {
        Some(marker) if marker.deployment != deployment.id => {
            return wrong(format!(
                "the results of another database ({})",
                marker.deployment
            ));
        }
        None if deployment.results_place.is_some() => return wrong(format!("no {MARKER} there")),
        _ => {}
    }
    let read = with_probe(&*objects, async |path| objects.get_range(path, 9..14).await);
    match read.await? {
        Ok(read) if read == PROBE[9..14] => Ok(()),
        Ok(_) => wrong("the object read back differs from the object written".to_owned()),
        Err(error) => Err(unusable(error)),
    }
}
