//! What is asked of the normal problem: where patches and pressures come from.

use std::sync::Arc;

use crate::contact::normal::footprint::Footprint;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::Ellipse;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::wheel::task::WheelTask;
use crate::contact::normal::wheel::wheelset_task::WheelsetTask;

/// What is known of a contact before it is solved. Solved, it is a [`Footprint`].
#[derive(Debug, Clone, PartialEq)]
pub enum NormalTask {
    /// Hertz's ellipse, in closed form.
    Hertz(Ellipse),
    /// A pressure on a grid, as it was given.
    Given(PressureField),
    /// A gap: patches and pressures have to be found.
    Gap(Box<GapTask>),
    /// A wheel on a rail: the places of its patches have to be found first, each in a frame of its own.
    Wheel(Arc<WheelTask>),
    /// A wheelset on both rails, in one or several positions.
    Wheelset(Arc<WheelsetTask>),
}

impl NormalTask {
    /// Number of positions of the bodies: several of a wheelset only.
    #[must_use]
    pub fn positions(&self) -> usize {
        match self {
            NormalTask::Wheelset(task) => task.poses.len(),
            NormalTask::Hertz(_)
            | NormalTask::Given(_)
            | NormalTask::Gap(_)
            | NormalTask::Wheel(_) => 1,
        }
    }

    /// The contact where it is known; nothing where it has to be found.
    #[must_use]
    pub fn known_footprint(&self) -> Option<Footprint> {
        match self {
            NormalTask::Hertz(ellipse) => Some(Footprint::hertz(*ellipse)),
            NormalTask::Given(field) => Some(Footprint::given(field.clone())),
            NormalTask::Gap(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_) => None,
        }
    }

    /// The patches, in order of their smallest y and at least one; nothing where they have to be found.
    #[must_use]
    pub fn known_patches(&self) -> Option<Vec<Patch>> {
        match self {
            NormalTask::Hertz(ellipse) => Some(vec![ellipse.patch()]),
            NormalTask::Given(field) => Some(field.patches()),
            NormalTask::Gap(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_) => None,
        }
    }
}
