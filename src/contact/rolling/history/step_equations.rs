//! The slip equations of the steps of one kind.

use crate::contact::half_space::strip_operator::kind::Parity;
use crate::contact::rolling::displacement_memory::{DisplacementMemory, LeadingEdges};
use crate::contact::rolling::history::plan::{PRESS_WEIGHTS, StepKind, weights};
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::operator_store::LevelOperator;
use crate::contact::rolling::slip_equations::SlipEquations;
use crate::contact::rolling::slip_rules::Rule;
use crate::contact::rolling::strip_mesh::StripMesh;

/// Equations of steps of one kind.
pub(super) struct StepEquations<'e> {
    pub(super) kind: StepKind,
    pub(super) equations: &'e SlipEquations<'e>,
    pub(super) newton: &'e Newton<'e>,
}

/// How the displacements enter the slip of a step of this kind, for a unit of length in mm.
pub(super) fn memory(kind: StepKind, edges: &LeadingEdges, unit: f64) -> DisplacementMemory<'_> {
    let (factor, rolls) = match kind {
        StepKind::Steady => (0.0, true),
        StepKind::Shift => (1.0, false),
        StepKind::Press => (PRESS_WEIGHTS[0], false),
        StepKind::Roll { distance, growth } => (weights(growth)[0] * unit / distance, true),
    };
    DisplacementMemory {
        edges,
        factor,
        rolls,
    }
}

/// Equations of steady rolling by a rule.
pub(super) fn steady<'e>(
    rule: Rule,
    (level, operator, parity): (&StripMesh, &'e LevelOperator, Option<Parity>),
) -> SlipEquations<'e> {
    SlipEquations::new(rule, &level.normalised, &operator.influence, parity)
        .with_layer(&level.normalised, level.layer)
}
