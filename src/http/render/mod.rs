//! The forms of an answer other than JSON; one format is one file.

pub mod batch_csv;
pub mod csv;
pub mod forces;
pub mod npz;
pub mod picture;
pub mod pieces;
pub mod resultants;
pub mod row_tables;
pub mod rows;
pub mod stresses;
pub mod table;
pub mod vtk;
