//! The forms of an answer other than JSON; one format is one file.

pub(super) mod batch_table;
pub(super) mod csv;
pub(super) mod forces;
pub(super) mod format;
pub(super) mod npz;
pub(super) mod picture;
pub(super) mod pieces;
pub(super) mod resultants;
pub(super) mod row_tables;
pub(super) mod shape;
pub(super) mod stresses;
pub(super) mod table;
pub(super) mod vtk;
