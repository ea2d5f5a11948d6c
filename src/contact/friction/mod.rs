//! The law of friction: how large a traction can become.

pub mod across;
pub mod along;
pub mod coefficient_table;
pub mod falling;
pub mod interface;
pub mod law;
pub(crate) mod on_rail;
pub mod passage;
