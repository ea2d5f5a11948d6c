//! What a client should know about an answer besides its numbers: remarks with a stable code, a place and figures.
//!
//! A stage returns the [`Remark`](crate::remark::list::Remark)s on its own result, with the patch or the input they concern where it
//! is known; the motion is added when the solution is assembled. All remarks are declared in `list`.

pub mod entry;
pub mod kind;
pub mod list;
