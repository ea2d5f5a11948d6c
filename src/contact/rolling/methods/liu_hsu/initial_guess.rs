//! Initial guesses for the Newton–Raphson iteration: the two of the paper, and the tractions of the previous division.

use crate::contact::rolling::motion::Motion;

/// How the directions of the slip tractions are chosen; their magnitude is always the friction bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialGuess {
    /// Initial guess 1: along the rigid slip `(ν_x − φ y, ν_y + φ x)` (eq. 14).
    RigidSlip,
    /// Initial guess 2: around a spin pole, `sgn φ (−(y − y_p), x − x_p)` (eq. 15).
    ///
    /// The paper prints a minus under the root of eq. 15, which must be a plus, and leaves out the sign of φ. With the
    /// rigid pole `(−ν_y/φ, ν_x/φ)` this would equal guess 1; the pole of the elastic problem differs from it.
    SpinPole([f64; 2]),
    /// Along the tractions of the previous division, see the third run in
    /// [`liu_hsu`](crate::contact::rolling::methods::liu_hsu) (not in the paper).
    Continued,
}

impl InitialGuess {
    /// The name in logs and answers.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            InitialGuess::RigidSlip => "rigid slip",
            InitialGuess::SpinPole(_) => "spin pole",
            InitialGuess::Continued => "continued",
        }
    }

    /// Unit direction at a cell at `(x, y)`, where the previous division gave the traction `before`.
    ///
    /// Where the direction is undefined (at a pole, or without a previous traction) it is that of the rigid slip, and at
    /// the rigid pole that of x; the iteration works with any direction there.
    #[must_use]
    pub fn direction(self, motion: &Motion, at: [f64; 2], before: [f64; 2]) -> [f64; 2] {
        let [x, y] = at;
        let rigid = [
            motion.creepage_x - motion.spin_per_mm * y,
            motion.creepage_y + motion.spin_per_mm * x,
        ];
        let wanted = match self {
            InitialGuess::RigidSlip => rigid,
            InitialGuess::SpinPole([pole_x, pole_y]) => {
                let sign = motion.spin_per_mm.signum();
                [-sign * (y - pole_y), sign * (x - pole_x)]
            }
            InitialGuess::Continued => before,
        };
        unit(wanted).or_else(|| unit(rigid)).unwrap_or([1.0, 0.0])
    }
}

/// The unit vector along `v`, unless `v` is 0 or not finite.
fn unit(v: [f64; 2]) -> Option<[f64; 2]> {
    let length = v[0].hypot(v[1]);
    (length > 0.0 && length.is_finite()).then(|| [v[0] / length, v[1] / length])
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTION: Motion = Motion {
        creepage_x: 0.3,
        creepage_y: -0.2,
        spin_per_mm: -0.5,
    };

    #[test]
    fn guess_2_about_the_rigid_pole_is_guess_1_for_either_sign_of_spin() {
        for spin in [-0.5, 0.5] {
            let motion = Motion {
                spin_per_mm: spin,
                ..MOTION
            };
            let pole = [-motion.creepage_y / spin, motion.creepage_x / spin];
            for at in [[0.0, 0.0], [1.0, 2.0], [-3.0, 0.4]] {
                let one = InitialGuess::RigidSlip.direction(&motion, at, [0.0; 2]);
                let two = InitialGuess::SpinPole(pole).direction(&motion, at, [0.0; 2]);
                assert!((one[0] - two[0]).abs() < 1e-15 && (one[1] - two[1]).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_direction_is_a_unit_vector_even_at_a_pole() {
        let still = Motion {
            creepage_x: 0.0,
            creepage_y: 0.0,
            spin_per_mm: 1.0,
        };
        for guess in [
            InitialGuess::RigidSlip,
            InitialGuess::SpinPole([0.0, 0.0]),
            InitialGuess::Continued,
        ] {
            let [x, y] = guess.direction(&still, [0.0, 0.0], [0.0, 0.0]);
            assert!((x.hypot(y) - 1.0).abs() < 1e-15, "{guess:?}");
        }
    }

    #[test]
    fn the_continued_guess_keeps_the_direction_before() {
        let [x, y] = InitialGuess::Continued.direction(&MOTION, [1.0, 1.0], [3.0, -4.0]);
        assert!((x - 0.6).abs() < 1e-15 && (y + 0.8).abs() < 1e-15);
    }
}
