//! How far pressure and traction of bodies that differ are solved together.

use crate::contact::method::Method;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::wheel::task::{ReferenceSurface, WheelTask};
use crate::contact::problem::physics::Problem;
use crate::contact::problem::run::Run;
use crate::contact::remark::list::Remark;

/// Error of forces relative to μN over |K| μ, where tractions feel the pressure but the pressure does not feel them: 0.09 to 0.55 in nine
/// contacts with |K| from 0.05 to 0.25 and μ of 0.3 and 0.6, on 10 × 20 cells against CONTACT.
const FIRST_ORDER: f64 = 0.6;
/// An error below this part of the target is not worth a second look at the pressure.
const PART_OF_TARGET: f64 = 0.1;

impl Problem {
    /// Error of forces, relative to μN, that is left if only tractions feel the other: 0 where the bodies are alike or without friction, and
    /// where the pressure is given, since it is that of the contact whatever the tractions are.
    #[must_use]
    pub fn first_order_error(&self, method: Method) -> f64 {
        let coupled = method == Method::BoundaryElement
            && !self.friction.is_frictionless()
            && !matches!(self.task, NormalTask::Given(_));
        let difference = if coupled {
            self.elasticity.difference.abs()
        } else {
            0.0
        };
        FIRST_ORDER * difference * self.friction.largest()
    }

    /// Returns whether the pressures belong to the tractions of bodies that differ. On the curve of a rail they do, in a history to those of its last point.
    /// Elsewhere they do in motions and in one pressing alone, where the gap is known. Points of a history that goes on share their patches.
    #[must_use]
    pub fn is_coupled(&self, run: &Run) -> bool {
        let on_curve = |wheel: &WheelTask| matches!(wheel.surface, ReferenceSurface::Curve { .. });
        match &self.task {
            NormalTask::Wheel(wheel) if on_curve(wheel) => return true,
            NormalTask::Wheelset(wheelset) if on_curve(&wheelset.sides[0]) => return true,
            _ => {}
        }
        let solved = match (&self.task, &self.history) {
            (NormalTask::Hertz(_) | NormalTask::Gap(_), None) => true,
            (NormalTask::Hertz(_) | NormalTask::Gap(_), Some(history)) => {
                history.only_presses() && self.forces == [[None; 2]]
            }
            (NormalTask::Given(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_), _) => false,
        };
        solved && self.first_order_error(run.method) > negligible(run)
    }

    /// The remark if the pressure should feel the tractions and does not.
    pub(crate) fn first_order(&self, run: &Run) -> Option<Remark> {
        let needed = self.first_order_error(run.method) > negligible(run) && !self.is_coupled(run);
        needed.then(|| self.first_order_remark(run.method))
    }

    /// What is said of motions whose pressure does not feel the tractions.
    pub(crate) fn first_order_remark(&self, method: Method) -> Remark {
        Remark::CouplingFirstOrder {
            difference_parameter: self.elasticity.difference,
            error: self.first_order_error(method),
        }
    }
}

/// The error of forces below which the pressure need not feel the tractions.
pub(crate) fn negligible(run: &Run) -> f64 {
    PART_OF_TARGET * run.resolution.target_or_usual()
}
