//! From the motion of a wheelset to the creepages of a patch.
//!
//! The material of the wheel at the patch moves with `v = (V, v_y, 0) + ω × r`, where `ω = Ω e + (roll rate, 0, yaw
//! rate)`, e is the axle and r runs from the wheelset's centre to the wheel's surface at the origin of the patch; the
//! rail is at rest. In the frame of the patch (tangent t, normal n) and with the rolling speed V:
//! `ν_x = v_x / V`, `ν_y = v · t / V`, `φ = ω · n / V`. Free rolling at the radius r has `Ω = V / r`, positive.
//! Source: Kalker 1990, section 1.3; the same as in the Manchester contact benchmark.

/// How a wheelset moves; mm, s and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsetMotion {
    /// Rolling speed along x.
    pub speed: f64,
    /// Angular velocity about the axle, positive for rolling forward.
    pub angular_velocity: f64,
    /// Speed of the centre to the left.
    pub lateral_velocity: f64,
    /// Rate of the yaw.
    pub yaw_rate: f64,
    /// Rate of the roll.
    pub roll_rate: f64,
}
