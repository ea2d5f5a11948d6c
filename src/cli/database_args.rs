//! The flags that name the database which several nodes share.

use clap::Args;

use crate::jobs::options::Database;

/// The database of several nodes.
#[derive(Debug, Clone, Args)]
pub struct DatabaseArgs {
    /// PostgreSQL 15 or later, in which jobs and results are kept and which any number of nodes share, such as
    /// `postgres://user:password@host/database`; without it they are kept in the data folder.
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
}

impl DatabaseArgs {
    /// The database, if one is named.
    #[must_use]
    pub fn database(&self) -> Option<Database> {
        Some(Database {
            url: self.database_url.clone()?,
            connections: self.database_connections,
        })
    }
}

/// The database that a command is about.
#[derive(Debug, Clone, Args)]
pub struct DatabaseUrlArgs {
    /// PostgreSQL 15 or later, such as `postgres://user:password@host/database`.
    #[arg(
        long,
        env = "RAILHEAD_DATABASE_URL",
        hide_env_values = true,
        value_name = "URL"
    )]
    pub database_url: String,
}
