//! The flags that name where jobs and results are: the data folder, or the database which several nodes share.

use std::path::PathBuf;

use clap::{ArgAction, Args};

use crate::jobs::options::{Database, NotifyMode};
use crate::jobs::result_place::url::{ResultsPlace, ResultsUrl};

/// The variable of the data folder.
pub(super) const DATA_DIR_VARIABLE: &str = "RAILHEAD_DATA_DIR";
/// The data folder where none is named.
pub(super) const DATA_DIR_DEFAULT: &str = "./railhead-data";

/// The data folder of a command that works beside the service.
#[derive(Debug, Clone, Args)]
pub(super) struct DataFolderArgs {
    /// Data folder of the service.
    #[arg(
        long,
        env = DATA_DIR_VARIABLE,
        default_value = DATA_DIR_DEFAULT,
        value_name = "FOLDER"
    )]
    pub(crate) data_dir: PathBuf,
}

/// The database of several nodes.
#[derive(Debug, Clone, Args)]
pub(super) struct DatabaseArgs {
    /// PostgreSQL 15 or later, in which jobs and results are kept and which any number of nodes share, such as
    /// `postgres://user:password@host/database`; without it they are kept in the data folder. Needs a build with the feature `cluster`.
    #[arg(
        long,
        env = "RAILHEAD_DATABASE_URL",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database_url: Option<String>,
    /// Most connections of this process to the database, one more aside on which it listens.
    #[arg(long, env = "RAILHEAD_DATABASE_CONNECTIONS", default_value_t = 10, value_name = "N",
          value_parser = clap::value_parser!(u32).range(2..))]
    pub database_connections: u32,
    /// The same database past a pooler that gives each transaction another session (PgBouncer in transaction mode), where nodes hear
    /// each other; `none`: they do not, and notice what others did up to a second later. Without it at `--database-url`.
    #[arg(
        long,
        env = "RAILHEAD_DATABASE_DIRECT_URL",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database_direct_url: Option<String>,
    #[command(flatten)]
    pub results: ResultsArgs,
}

/// The place of large results beside a database.
#[derive(Debug, Clone, Args)]
pub(super) struct ResultsArgs {
    /// Where results above 32 KiB are kept beside a database: `s3://bucket/prefix` (keys, region and address by the usual `AWS_…`
    /// variables) or `file:///folder`; without it in the database. Buckets need the feature `cluster`. Every node of a database names the same place.
    #[arg(long, env = "RAILHEAD_RESULTS_URL", value_name = "URL")]
    pub results_url: Option<ResultsUrl>,
    /// The folder that `--results-url` names is the same one on every node (a network file system).
    #[arg(
        long,
        env = "RAILHEAD_RESULTS_SHARED",
        default_value_t = false,
        action = ArgAction::Set,
        num_args = 0..=1,
        default_missing_value = "true",
        value_name = "BOOL"
    )]
    pub results_shared: bool,
}

impl ResultsArgs {
    /// The place, if one is named.
    #[must_use]
    pub(super) fn place(&self) -> Option<ResultsPlace> {
        Some(ResultsPlace {
            url: self.results_url.clone()?,
            shared: self.results_shared,
        })
    }
}

impl DatabaseArgs {
    /// The database, if one is named.
    #[must_use]
    pub(super) fn database(&self) -> Option<Database> {
        Some(Database {
            url: self.database_url.clone()?,
            connections: self.database_connections,
            notify_mode: match self.database_direct_url.as_deref() {
                None => NotifyMode::Database,
                Some("none") => NotifyMode::Off,
                Some(url) => NotifyMode::Direct(url.to_owned()),
            },
        })
    }
}

/// The database that a command is about.
#[derive(Debug, Clone, Args)]
pub(super) struct DatabaseUrlArgs {
    /// PostgreSQL 15 or later, such as `postgres://user:password@host/database`.
    #[arg(
        long,
        env = "RAILHEAD_DATABASE_URL",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database_url: String,
}

/// What `doctor` looks at.
#[derive(Debug, Clone, Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    pub database: DatabaseUrlArgs,
    #[command(flatten)]
    pub results: ResultsArgs,
}
