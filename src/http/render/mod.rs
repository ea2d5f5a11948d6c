//! The forms of an answer other than JSON.

pub(super) mod batch_table;
pub(super) mod forces;
pub(super) mod format;
pub(super) mod picture;
pub(super) mod pieces;
pub(super) mod resultants;
pub(super) mod row_tables;
pub(super) mod shape;
pub(super) mod stresses;
pub(super) mod table;
