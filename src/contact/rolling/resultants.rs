//! Forces and moment of tractions over a patch.

use crate::contact::rolling::strip_mesh::StripMesh;

/// Forces in N and moment about z in N·mm, on the lower body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Resultants {
    /// Longitudinal force.
    pub force_x: f64,
    /// Lateral force.
    pub force_y: f64,
    /// Moment about the point it was asked for.
    pub moment_z: f64,
}

impl Resultants {
    /// `F_x = Σ T_x A`, `F_y = Σ T_y A`, `M_z = Σ (x T_y − y T_x) A` over the cells of one patch. `traction` is dimensionless as on the
    /// level; the moment is about the origin of the case.
    ///
    /// x is taken in the middle of the cell, where the moment of its constant traction is exact; at the node the error of M_z is about
    /// twice as large. y is taken halfway between the mid-line and the centre of the load: at the mid-line the moment of a vortex comes
    /// out too large, at the centre too small, because the mean of `y²` over a strip exceeds the square of the mean.
    #[must_use]
    pub fn of_patch(level: &StripMesh, traction: &[Vec<f64>; 2], patch: usize) -> Resultants {
        let mut sum = Resultants::default();
        let mesh = &level.mesh;
        let segments = mesh.segments.iter().zip(&mesh.load_y);
        for (segment, load_y) in segments.filter(|(s, _)| s.chord.patch == patch) {
            let arm = 0.5 * (segment.chord.y + load_y);
            for i in segment.cells.clone() {
                let weight = level.area[i] * level.scale.traction;
                let (x, y) = (weight * traction[0][i], weight * traction[1][i]);
                sum.force_x += x;
                sum.force_y += y;
                let centre = 0.5 * (mesh.left[i] + mesh.right[i]);
                sum.moment_z += centre * y - arm * x;
            }
        }
        sum
    }

    /// Sum of two resultants about the same point.
    #[must_use]
    pub fn plus(self, other: Resultants) -> Resultants {
        Resultants {
            force_x: self.force_x + other.force_x,
            force_y: self.force_y + other.force_y,
            moment_z: self.moment_z + other.moment_z,
        }
    }

    /// These resultants times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Resultants {
        Resultants {
            force_x: factor * self.force_x,
            force_y: factor * self.force_y,
            moment_z: factor * self.moment_z,
        }
    }

    /// Richardson's extrapolation of errors that fall as 1/N: these resultants plus `share` of their change from a coarser
    /// mesh, with a force no larger than `bound`.
    #[must_use]
    pub fn beyond(self, coarser: Resultants, share: f64, bound: f64) -> Resultants {
        let past = |here: f64, before: f64| here + share * (here - before);
        let [x, y] = [
            past(self.force_x, coarser.force_x),
            past(self.force_y, coarser.force_y),
        ];
        let force = x.hypot(y);
        let factor = if force > bound { bound / force } else { 1.0 };
        Resultants {
            force_x: factor * x,
            force_y: factor * y,
            moment_z: past(self.moment_z, coarser.moment_z),
        }
    }

    /// The same resultants with the moment about `point` instead of the origin.
    #[must_use]
    pub fn about(self, point: [f64; 2]) -> Resultants {
        Resultants {
            moment_z: self.moment_z - point[0] * self.force_y + point[1] * self.force_x,
            ..self
        }
    }

    /// Largest component of the difference to `other`: forces relative to `force`, moments to `force × length`; the
    /// moments should be about a point in the patch.
    #[must_use]
    pub fn distance(&self, other: &Resultants, force: f64, length: f64) -> f64 {
        let x = (self.force_x - other.force_x).abs();
        let y = (self.force_y - other.force_y).abs();
        let z = (self.moment_z - other.moment_z).abs() / length;
        x.max(y).max(z) / force
    }
}
