//! Remarks: information about an answer besides its numbers, each with a stable code, a location and figures.
//!
//! A stage returns the [`Remark`](crate::remark::list::Remark)s on its result, with the patch or the member that they apply to. The motion is
//! added when the solution is assembled. All remarks are declared in `list`.

pub mod entry;
pub mod kind;
pub mod list;
