//! From coarse to fine meshes until the estimate of the error meets the target.

mod caution;
pub mod companion_answer;
pub mod companions;
pub mod constants;
mod distances;
pub mod error_estimate;
pub mod estimate_context;
mod few_strips;
mod finer_by_table;
pub mod interpolate;
pub mod lender;
pub mod level_solve;
pub mod levels;
pub mod mesh_policy;
mod one_rule;
pub mod refine;
pub mod regime;
pub mod slender;
pub mod state;
pub mod stretch;
mod sweep_line;
mod swept_level;
mod table_check;
mod trials;
mod waiting;
pub mod warm_start;
mod without_companions;
