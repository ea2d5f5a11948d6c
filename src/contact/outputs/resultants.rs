//! Forces and moment of tractions over a patch.

use crate::contact::tangential::level::Level;

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
    /// `F_x = Σ T_x A`, `F_y = Σ T_y A`, `M_z = Σ (x T_y − y T_x) A` over the cells of one patch, with x in the
    /// middle of the cell (there the moment of its constant traction is exact; at the node the error of M_z is about
    /// twice as large) and y on the mid-line; `traction` is dimensionless as the level's, the moment is about the origin of the case.
    #[must_use]
    pub fn of_patch(level: &Level, traction: &[Vec<f64>; 2], patch: usize) -> Resultants {
        let mut sum = Resultants::default();
        for segment in level
            .mesh
            .segments
            .iter()
            .filter(|s| s.chord.patch == patch)
        {
            for i in segment.cells.clone() {
                let weight = level.area[i] * level.scale.traction;
                let (x, y) = (weight * traction[0][i], weight * traction[1][i]);
                sum.force_x += x;
                sum.force_y += y;
                let centre = 0.5 * (level.mesh.left[i] + level.mesh.right[i]);
                sum.moment_z += centre * y - segment.chord.y * x;
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
