//! The URL of a location for results.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
#[cfg(feature = "cluster")]
use std::time::Duration;

use object_store::ObjectStore;
#[cfg(feature = "cluster")]
use object_store::aws::AmazonS3Builder;
use object_store::local::LocalFileSystem;
use object_store::prefix::PrefixStore;
#[cfg(feature = "cluster")]
use object_store::{BackoffConfig, RetryConfig};

use crate::error::{JobsError, Result};
use crate::metrics::StoreRequests;
#[cfg(feature = "cluster")]
use crate::result_place::client::Client;

/// Number of retries of a failed request.
#[cfg(feature = "cluster")]
const RETRIES: usize = 5;

/// Time after the first attempt within which a retry may begin, because a client waits for the result.
#[cfg(feature = "cluster")]
const RETRIED_WITHIN: Duration = Duration::from_secs(10);

/// First and longest pause between retries.
#[cfg(feature = "cluster")]
const PAUSES: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(2));

/// Location of large results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResultsUrl {
    /// `file:///…`: a folder.
    Folder(PathBuf),
    /// `s3://bucket/prefix`, and with the features `gs` and `az` those of other providers.
    Bucket {
        /// The kind of store.
        scheme: &'static str,
        /// Bucket or container.
        bucket: String,
        /// Prefix of every key; may be empty.
        prefix: String,
    },
}

/// Location of large results, with a statement whether it is shared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultsPlace {
    /// URL.
    pub url: ResultsUrl,
    /// Whether a folder is the same on all nodes.
    pub shared: bool,
}

impl FromStr for ResultsUrl {
    type Err = String;

    fn from_str(text: &str) -> Result<ResultsUrl, String> {
        let shape = "it looks like file:///folder, s3://bucket/prefix, gs://bucket/prefix or az://container/prefix";
        let Some((scheme, rest)) = text.split_once("://") else {
            return Err(shape.to_owned());
        };
        let scheme = match scheme {
            "file" if rest.len() > 1 && rest.starts_with('/') => {
                return Ok(ResultsUrl::Folder(PathBuf::from(rest)));
            }
            "file" => return Err("a folder is named from the root: file:///folder".to_owned()),
            "s3" if cfg!(feature = "cluster") => "s3",
            "gs" if cfg!(feature = "gs") => "gs",
            "az" if cfg!(feature = "az") => "az",
            "s3" | "gs" | "az" => {
                let feature = if scheme == "s3" { "cluster" } else { scheme };
                return Err(format!(
                    "this build cannot use {scheme}://; one with the feature `{feature}` can (cargo build --release --features {feature})"
                ));
            }
            _ => return Err(shape.to_owned()),
        };
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let named = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        if bucket.is_empty() || !bucket.chars().all(named) {
            return Err(format!("`{bucket}` is not the name of a bucket; {shape}"));
        }
        let prefix = prefix.trim_matches('/').to_owned();
        if !prefix.chars().all(|c| named(c) || c == '/') || prefix.contains("//") {
            return Err(format!(
                "the prefix `{prefix}` has other characters than letters, digits, `.`, `-`, `_` and `/`"
            ));
        }
        Ok(ResultsUrl::Bucket {
            scheme,
            bucket: bucket.to_owned(),
            prefix,
        })
    }
}

impl fmt::Display for ResultsUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ResultsUrl::Folder(path) => write!(f, "file://{}", path.display()),
            ResultsUrl::Bucket {
                scheme,
                bucket,
                prefix,
            } if prefix.is_empty() => write!(f, "{scheme}://{bucket}"),
            ResultsUrl::Bucket {
                scheme,
                bucket,
                prefix,
            } => write!(f, "{scheme}://{bucket}/{prefix}"),
        }
    }
}

impl ResultsUrl {
    /// Creates the store, without sending a request. Credentials, region and address of an object store come from the usual
    /// variables of its provider (`AWS_…`, `GOOGLE_…`, `AZURE_…`).
    ///
    /// # Errors
    /// The folder cannot be created, or a variable has an invalid value.
    pub(crate) fn open(&self, requests: StoreRequests) -> Result<Arc<dyn ObjectStore>> {
        match self {
            ResultsUrl::Folder(path) => {
                std::fs::create_dir_all(path).map_err(JobsError::at(path))?;
                Ok(Arc::new(
                    LocalFileSystem::new_with_prefix(path)?.with_fsync(true),
                ))
            }
            ResultsUrl::Bucket {
                scheme,
                bucket,
                prefix,
            } => {
                let store = bucket_store(scheme, bucket, requests)?;
                Ok(match prefix.is_empty() {
                    true => store,
                    false => Arc::new(PrefixStore::new(store, prefix.as_str())),
                })
            }
        }
    }

    /// The folder, if it is one.
    pub(crate) fn folder(&self) -> Option<PathBuf> {
        match self {
            ResultsUrl::Folder(path) => Some(path.clone()),
            ResultsUrl::Bucket { .. } => None,
        }
    }
}

#[cfg(not(feature = "cluster"))]
fn bucket_store(_: &str, _: &str, _: StoreRequests) -> Result<Arc<dyn ObjectStore>> {
    Err(JobsError::NotBuilt {
        what: "object stores",
        feature: "cluster",
    })
}

#[cfg(feature = "cluster")]
fn bucket_store(
    scheme: &str,
    bucket: &str,
    requests: StoreRequests,
) -> Result<Arc<dyn ObjectStore>> {
    let client = Client::new(requests)?;
    let retry = RetryConfig {
        backoff: BackoffConfig {
            init_backoff: PAUSES.0,
            max_backoff: PAUSES.1,
            base: 2.0,
        },
        max_retries: RETRIES,
        retry_timeout: RETRIED_WITHIN,
    };
    Ok(match scheme {
        #[cfg(feature = "gs")]
        "gs" => Arc::new(
            object_store::gcp::GoogleCloudStorageBuilder::from_env()
                .with_bucket_name(bucket)
                .with_retry(retry)
                .with_http_connector(client)
                .build()?,
        ),
        #[cfg(feature = "az")]
        "az" => Arc::new(
            object_store::azure::MicrosoftAzureBuilder::from_env()
                .with_container_name(bucket)
                .with_retry(retry)
                .with_http_connector(client)
                .build()?,
        ),
        _ => Arc::new(
            AmazonS3Builder::from_env()
                .with_bucket_name(bucket)
                .with_retry(retry)
                .with_http_connector(client)
                .build()?,
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_and_written_back() {
        let written_back = |text: &str| text.parse::<ResultsUrl>().unwrap().to_string();
        assert_eq!(written_back("file:///srv/results"), "file:///srv/results");
        #[cfg(feature = "cluster")]
        {
            for text in ["s3://bucket", "s3://my-bucket/rail/head"] {
                assert_eq!(written_back(text), text);
            }
            assert_eq!(written_back("s3://bucket/a/"), "s3://bucket/a");
        }
    }

    #[test]
    fn what_names_no_place_is_told_what_does() {
        for (text, word) in [
            ("results", "s3://bucket"),
            ("ftp://a/b", "s3://bucket"),
            #[cfg(feature = "cluster")]
            ("s3://", "not the name of a bucket"),
            #[cfg(feature = "cluster")]
            ("s3://u:p@host/b", "not the name of a bucket"),
            #[cfg(feature = "cluster")]
            ("s3://b/a//b", "prefix"),
            ("file://folder", "from the root"),
        ] {
            let said = text.parse::<ResultsUrl>().unwrap_err();
            assert!(said.contains(word), "{text}: {said}");
        }
    }
}
