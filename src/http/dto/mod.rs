//! What clients read, as types of the contract.

pub mod batch;
pub mod cells;
pub mod job;
pub mod problem;
pub mod result;
pub mod resultants;
pub mod run;
pub mod tenant_limits;
