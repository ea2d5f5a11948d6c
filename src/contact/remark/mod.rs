//! What a client should know about an answer besides its numbers: remarks with a stable code, a place and figures.
//!
//! A stage returns the [`Remark`](crate::contact::remark::list::Remark)s of its own result, with the patch or the input they belong to where it knows that;
//! the motion is added when the solution is put together. `list` holds them all: adding one means adding it there.

pub mod entry;
pub mod figure;
pub mod kind;
pub mod list;
pub mod table;
