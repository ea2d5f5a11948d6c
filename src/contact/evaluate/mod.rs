//! Evaluates rows: one case with columns of values that replace some of its members. [`rows`] answers numbers without meshes, [`many`]
//! any column with any method.

pub mod answer;
pub mod many;
pub mod rows;
pub mod variable;
pub mod varied;
