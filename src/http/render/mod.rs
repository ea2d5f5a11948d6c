//! Formats of responses other than plain JSON.

pub(super) mod batch_table;
pub(super) mod format;
pub(super) mod picture;
pub(super) mod pieces;
pub(super) mod resultants;
pub(super) mod row_tables;
pub(super) mod shape;
pub(super) mod stresses;
pub(super) mod table;
