//! The settings of the commands beside `serve`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::cli::{CaseArgs, address};

/// Settings of `backup`.
#[derive(Debug, Clone, Args)]
pub struct BackupArgs {
    /// Folder to make; it must not be there yet.
    #[arg(long, value_name = "FOLDER")]
    pub to: PathBuf,
    /// Data folder of the service.
    #[arg(
        long,
        env = "RAILHEAD_DATA_DIR",
        default_value = "./railhead-data",
        value_name = "FOLDER"
    )]
    pub data_dir: PathBuf,
}

/// Settings of `keys`.
#[derive(Debug, Clone, Args)]
pub struct KeysArgs {
    #[command(subcommand)]
    pub action: KeysAction,
}

/// What can be done with API keys.
#[derive(Debug, Clone, Subcommand)]
pub enum KeysAction {
    /// Make a key and print it, this one time.
    Create {
        /// Whose jobs the key opens; keys of the tenant `operator` may also read `/metrics`.
        #[arg(long, value_name = "TENANT")]
        tenant: String,
        /// What the key is for.
        #[arg(long, value_name = "TEXT")]
        name: Option<String>,
        /// Data folder of the service.
        #[arg(
            long,
            env = "RAILHEAD_DATA_DIR",
            default_value = "./railhead-data",
            value_name = "FOLDER"
        )]
        data_dir: PathBuf,
    },
    /// List all keys without their secrets.
    List {
        /// Data folder of the service.
        #[arg(
            long,
            env = "RAILHEAD_DATA_DIR",
            default_value = "./railhead-data",
            value_name = "FOLDER"
        )]
        data_dir: PathBuf,
    },
    /// Revoke a key; a running service refuses it within two seconds.
    Revoke {
        /// Id of the key, as `list` shows it.
        #[arg(value_name = "ID")]
        id: String,
        /// Data folder of the service.
        #[arg(
            long,
            env = "RAILHEAD_DATA_DIR",
            default_value = "./railhead-data",
            value_name = "FOLDER"
        )]
        data_dir: PathBuf,
    },
}

/// Settings of `solve`.
#[derive(Debug, Clone, Args)]
pub struct SolveArgs {
    /// File with the case as JSON, or `-` for standard input.
    #[arg(value_name = "CASE.JSON")]
    pub file: PathBuf,
    #[command(flatten)]
    pub case: CaseArgs,
}

/// Settings of `healthcheck`.
#[derive(Debug, Clone, Args)]
pub struct HealthcheckArgs {
    /// What to ask; only plain `http://` is possible [default: `/readyz` at the address that RAILHEAD_PROBE_LISTEN or
    /// RAILHEAD_LISTEN says, else at 127.0.0.1:8080].
    #[arg(long, env = "RAILHEAD_HEALTHCHECK_URL", value_name = "URL")]
    pub url: Option<String>,
    /// The listener for probes of the service, if it has one.
    #[arg(long, env = "RAILHEAD_PROBE_LISTEN", value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    /// Where the service listens.
    #[arg(
        long,
        env = "RAILHEAD_LISTEN",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS:PORT",
        value_parser = address
    )]
    pub listen: SocketAddr,
}
