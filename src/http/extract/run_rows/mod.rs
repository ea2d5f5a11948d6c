//! Reads the rows of a run: columns in JSON, or tables in CSV, NDJSON, Arrow and Parquet, which are spooled and read piece by piece.

pub mod body;
mod text;
