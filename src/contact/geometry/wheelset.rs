//! From the motion of a wheelset to the creepages of a patch.
//!
//! The material of the wheel at the patch moves with `v = (V, v_y, 0) + ω × r`, where `ω = Ω e + (roll rate, 0, yaw
//! rate)`, e is the axle and r runs from the wheelset's centre to the wheel's surface at the origin of the patch; the
//! rail is at rest. In the frame of the patch (tangent t, normal n) and with the rolling speed V:
//! `ν_x = v_x / V`, `ν_y = v · t / V`, `φ = ω · n / V`. Free rolling at the radius r has `Ω = V / r`, positive.
//! Source: Kalker 1990, section 1.3; the same as in the Manchester contact benchmark.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::frame::SurfaceMissed;
use crate::contact::geometry::wheel_rail::WheelRail;

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

/// Creepages `ν_x`, `ν_y` and the spin φ in 1/mm about the origin of a frame, with the wheel's centre at the height
/// `centre` in mm.
///
/// # Errors
/// The wheel has no point over the origin, or none was found.
pub fn creepages(
    geometry: &WheelRail,
    frame: &Frame,
    centre: f64,
    motion: &WheelsetMotion,
) -> Result<[f64; 3], SurfaceMissed> {
    let axle = geometry.axle();
    let [tangent, normal] = frame.axes();
    let overlap = geometry.overlap(frame, centre)?;
    // The wheel's surface lies below the rail's by the overlap.
    let arm = [
        frame.origin[0],
        frame.origin[1] - geometry.placement.lateral_shift - overlap * normal[0],
        frame.origin[2] - centre - overlap * normal[1],
    ];
    let mut turn = axle.map(|part| motion.angular_velocity * part);
    turn[0] += motion.roll_rate;
    turn[2] += motion.yaw_rate;
    let velocity = [
        motion.speed + turn[1] * arm[2] - turn[2] * arm[1],
        motion.lateral_velocity + turn[2] * arm[0] - turn[0] * arm[2],
        turn[0] * arm[1] - turn[1] * arm[0],
    ];
    let relative = [
        velocity[0],
        velocity[1] * tangent[0] + velocity[2] * tangent[1],
        turn[1] * normal[0] + turn[2] * normal[1],
    ];
    Ok(relative.map(|part| part / motion.speed))
}
