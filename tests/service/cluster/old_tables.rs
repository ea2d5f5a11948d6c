//! Creates database tables of earlier versions.

use sqlx::postgres::PgConnection;

/// The tables of the first schema version, with the row that records it.
const FIRST_FORM: &str = concat!(
    include_str!("../../../src/jobs/store/postgres/schema.sql"),
    "INSERT INTO deployment (one, form) VALUES (1, 1);"
);

/// Creates the tables of a schema version. The first version is 1.
pub async fn make(connection: &mut PgConnection, form: u32) {
    run(connection, FIRST_FORM).await;
    for step in 2..=form {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/jobs/store/postgres/steps");
        let step_text = std::fs::read_to_string(format!("{folder}/{step}.sql"));
        run(connection, &step_text.expect("a step")).await;
        run(connection, &format!("UPDATE deployment SET form = {step}")).await;
    }
}

async fn run(connection: &mut PgConnection, statements: &str) {
    sqlx::raw_sql(sqlx::AssertSqlSafe(statements.to_owned()))
        .execute(connection)
        .await
        .expect("tables");
}
