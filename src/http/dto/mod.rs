//! What clients read, as types of the contract.

pub(super) mod batch;
pub(super) mod cells;
pub(super) mod job;
pub(super) mod result;
pub(super) mod resultants;
pub(super) mod run;
pub(super) mod tenant_limits;
