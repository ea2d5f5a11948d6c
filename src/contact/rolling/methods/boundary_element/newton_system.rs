//! The linear system of one Newton step.

use std::ops::ControlFlow;

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::numerics::gmres::LinearSystem;
use crate::contact::rolling::methods::boundary_element::linearisation::Linearisation;
use crate::contact::rolling::methods::boundary_element::preconditioner::StripFactors;
use crate::contact::rolling::slip_equations::{SlipEquations, SlipScratch};

/// The linearised equations as GMRES sees them.
pub(crate) struct NewtonSystem<'a> {
    pub(crate) equations: &'a SlipEquations<'a>,
    pub(crate) linear: &'a Linearisation,
    pub(crate) blocks: &'a mut StripFactors,
    pub(crate) product: &'a mut SlipScratch,
    pub(crate) expanded: &'a mut [f64],
    pub(crate) slip: &'a mut [f64],
    pub(crate) monitor: &'a dyn Monitor,
}

impl LinearSystem for NewtonSystem<'_> {
    fn product(&mut self, x: &[f64], out: &mut [f64]) {
        let (padded, cells) = (self.equations.padded(), self.equations.cells());
        for i in 0..cells {
            if self.linear.slips(i) {
                let (ux, uy) = self.linear.direction[i];
                self.expanded[i] = ux * x[i];
                self.expanded[padded + i] = uy * x[i];
            } else {
                self.expanded[i] = x[i];
                self.expanded[padded + i] = x[padded + i];
            }
        }
        self.equations
            .elastic(self.expanded, self.slip, self.product);
        out.fill(0.0);
        for i in 0..cells {
            let (sx, sy) = (self.slip[i], self.slip[padded + i]);
            if self.linear.slips(i) {
                let (ux, uy) = self.linear.direction[i];
                out[i] = ux * sx + uy * sy - self.linear.stiffness[i] * x[i];
            } else {
                out[i] = sx;
                out[padded + i] = sy;
            }
        }
        for row in &self.linear.falling {
            let [i, j] = [row.cell, padded + row.cell];
            [out[i], out[j]] = row.apply([out[i], out[j]], [x[i], x[j]]);
        }
    }

    fn precondition(&mut self, x: &mut [f64]) {
        self.blocks.apply(x);
    }

    fn tick(&mut self) -> ControlFlow<Stop> {
        self.monitor.tick(0.0)
    }
}
