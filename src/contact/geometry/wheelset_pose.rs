//! A rigid wheelset on both rails: the roll and the height at which both wheels touch, and its motion.
//!
//! The material of the wheel at a patch moves with `v = (V, v_y, 0) + ω × r`. Here `ω = Ω e + (roll rate, 0, yaw rate)`, e is the axle, and r
//! leads from the wheelset's centre to the wheel's surface at the origin of the patch. The rail is at rest. In the frame of the patch with the
//! tangent t and the normal n, the rolling speed V gives the creepages `ν_x = v_x / V`, `ν_y = v · t / V` and the spin `φ = ω · n / V`. Free
//! rolling at the radius r has the positive angular velocity `Ω = V / r`.
//! Source: Kalker 1990, section 1.3; the same as in the Manchester contact benchmark.

use std::f64::consts::FRAC_PI_2;

use crate::geometry::profile::NEAR;
use crate::geometry::rigid_touch::{RailTop, RigidTouch};
use crate::geometry::wheel_rail::WheelRail;
use crate::numerics::equilibrium::{Search, Trial};

/// Tolerance of the difference of the two heights in mm, about 1e-10 rad of roll.
const LEVEL: f64 = 1e-7;

/// Both wheels on both rails, for any position of the wheelset.
#[derive(Debug, Clone)]
pub struct PairOfRails {
    /// Left and right.
    sides: [WheelRail; 2],
    tops: [RailTop; 2],
}

/// The position of a rigid wheelset on rigid rails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidPose {
    /// Shift to the left in mm.
    pub lateral_shift: f64,
    /// Yaw in rad.
    pub yaw: f64,
    /// Roll in rad at which both wheels touch.
    pub roll: f64,
    /// Height of the wheelset's centre above the top of the rails in mm.
    pub height: f64,
    /// Contact points of the left and the right wheel.
    pub touches: [RigidTouch; 2],
}

impl RigidPose {
    /// Rolling radius of the left wheel less that of the right one, in mm.
    pub fn radius_difference(&self) -> f64 {
        self.touches[0].radius - self.touches[1].radius
    }

    /// Lateral distance of the contact points in mm.
    pub fn contact_distance(&self) -> f64 {
        self.touches[0].at[1] - self.touches[1].at[1]
    }
}

impl PairOfRails {
    /// Makes a pair from the left and the right side.
    pub fn new(sides: [WheelRail; 2]) -> PairOfRails {
        let tops = [RailTop::new(&sides[0]), RailTop::new(&sides[1])];
        PairOfRails { sides, tops }
    }

    /// Finds the position of the wheelset at a shift to the left in mm and a yaw in rad, starting from a roll nearby.
    ///
    /// # Errors
    /// Returns a sentence if a wheel is not above its rail or the roll is not found.
    pub fn pose(&mut self, lateral_shift: f64, yaw: f64, roll: f64) -> Result<RigidPose, String> {
        // The difference of the heights grows with the roll by about the distance of the contact points. It has a kink where a contact point
        // jumps.
        let start = self.touches(lateral_shift, yaw, roll)?;
        let distance = start[0].at[1] - start[1].at[1];
        let mut search = Search::new([Some(1.0 / distance)], [FRAC_PI_2]);
        let found = search.find([roll], |[roll]| {
            let touches = self.touches(lateral_shift, yaw, roll)?;
            Ok::<_, String>(Trial {
                residual: [touches[1].height - touches[0].height],
                tolerance: LEVEL,
                value: RigidPose {
                    lateral_shift,
                    yaw,
                    roll,
                    height: 0.5 * (touches[0].height + touches[1].height),
                    touches,
                },
            })
        })?;
        match found.converged() {
            true => Ok(found.value),
            false => Err(format!(
                "no roll of the wheelset was found at which both wheels touch, at a lateral shift of {lateral_shift} mm"
            )),
        }
    }

    /// The position at a shift to the left in mm and a yaw in rad with the axle level, so that only one wheel touches.
    ///
    /// # Errors
    /// Returns a sentence if a wheel is not above its rail.
    pub fn pose_without_roll(&mut self, lateral_shift: f64, yaw: f64) -> Result<RigidPose, String> {
        let touches = self.touches(lateral_shift, yaw, 0.0)?;
        Ok(RigidPose {
            lateral_shift,
            yaw,
            roll: 0.0,
            height: touches[0].height.max(touches[1].height),
            touches,
        })
    }

    /// Checks that neither wheel touches at the end of a cross-section.
    ///
    /// # Errors
    /// Returns a sentence if the points of a cross-section end where the bodies touch, so that the true contact may be elsewhere.
    pub fn not_cut_off(&self, pose: &RigidPose) -> Result<(), String> {
        for (k, touch) in pose.touches.iter().enumerate() {
            let ranges = self.sides[k].ranges();
            let bodies = [("rail", touch.rail), ("wheel", touch.wheel)];
            for ((body, at), [first, last]) in bodies.into_iter().zip(ranges) {
                if at <= first + NEAR || at >= last - NEAR {
                    let side = ["left", "right"][k];
                    return Err(format!(
                        "at a lateral shift of {:.2} mm the {side} wheel touches at the end of the {body}'s points; send the points beyond",
                        pose.lateral_shift
                    ));
                }
            }
        }
        Ok(())
    }

    fn touches(
        &mut self,
        lateral_shift: f64,
        yaw: f64,
        roll: f64,
    ) -> Result<[RigidTouch; 2], String> {
        let mut touch = |k: usize| {
            self.sides[k].pose(lateral_shift, yaw, roll);
            let found = self.tops[k].touch(&self.sides[k]);
            found.ok_or_else(|| {
                let side = ["left", "right"][k];
                format!(
                    "at a lateral shift of {lateral_shift} mm no part of the {side} wheel lies above its rail; check gauge, flange-back \
                     distance and position"
                )
            })
        };
        Ok([touch(0)?, touch(1)?])
    }

    /// The contact point of a wheel on the cross-sections of rail and wheel: `[y, z]` in mm, y to the field side and z down.
    pub fn on_profiles(&self, side: usize, touch: &RigidTouch) -> [[f64; 2]; 2] {
        [
            self.sides[side].on_rail(touch.rail),
            self.sides[side].on_wheel(touch.wheel),
        ]
    }
}

/// The motion of a wheelset in mm, s and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsetMotion {
    /// Rolling speed along x.
    pub speed: f64,
    /// Angular velocity about the axle, positive for rolling forward.
    pub angular_velocity: f64,
    /// Speed of the centre to the left.
    pub lateral_velocity: f64,
    /// Yaw rate.
    pub yaw_rate: f64,
    /// Roll rate.
    pub roll_rate: f64,
}
