//! Statements of one transaction, sent one after the other.

use sqlx::postgres::{PgConnection, PgPool, PgRow, Postgres};
use sqlx::{QueryBuilder, Transaction};

use crate::jobs::store_error::StoreError;

/// Where transactions that write begin.
pub(crate) type Writer = PgPool;

/// A transaction whose statements are collected until their rows are needed. Dropped without a commit, it changes nothing.
pub(crate) struct Statements {
    transaction: Transaction<'static, Postgres>,
    collected: Vec<QueryBuilder<Postgres>>,
}

impl Statements {
    /// Others write between two statements of a transaction.
    pub(crate) const EXCLUSIVE: bool = false;

    /// Begins a transaction.
    pub(crate) async fn begin(writer: &Writer) -> Result<Statements, StoreError> {
        Ok(Statements {
            transaction: writer.begin().await?,
            collected: Vec::new(),
        })
    }

    /// Begins the next statement.
    pub(crate) fn next(&mut self) -> &mut QueryBuilder<Postgres> {
        let place = self.collected.len();
        self.collected.push(QueryBuilder::new(""));
        &mut self.collected[place]
    }

    /// Sends what was collected; the rows of each statement.
    pub(crate) async fn send(&mut self) -> Result<Vec<Vec<PgRow>>, StoreError> {
        let mut all = Vec::with_capacity(self.collected.len());
        for mut statement in std::mem::take(&mut self.collected) {
            all.push(statement.build().fetch_all(&mut *self.transaction).await?);
        }
        Ok(all)
    }

    /// Sends what was collected and ends the transaction; the rows of each statement that was sent with it.
    pub(crate) async fn commit(mut self) -> Result<Vec<Vec<PgRow>>, StoreError> {
        let all = self.send().await?;
        self.transaction.commit().await?;
        Ok(all)
    }

    /// The connection, for statements inside the transaction once what was collected was sent.
    pub(crate) fn connection(&mut self) -> &mut PgConnection {
        &mut self.transaction
    }
}
