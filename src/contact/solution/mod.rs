//! The answer, in the words that clients read.

pub mod assemble;
pub mod cell_values;
pub mod damage;
pub mod finish;
pub mod finite;
pub(crate) mod history_point;
pub mod maintain;
pub mod maintenance;
pub mod plane_error;
pub mod profile_quality;
pub mod track_axes;
pub mod understanding;
pub mod wheelset;
pub mod words;
pub mod zone;
