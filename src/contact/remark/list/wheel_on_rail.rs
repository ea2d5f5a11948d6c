//! Remarks on the contact of a wheel and a rail: where it is, and what its model leaves out.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! wheel_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// The contact is on the tip of the flange, as on a wheel that climbs or has derailed.
            ContactOnFlangeTip {
                /// Whose.
                profile: &'static str = "wheel",
                /// Where on the profile, from and to.
                y_mm: [f64; 2] = [-58.0, -52.0],
            }
            code: "contact-on-flange-tip",
            severity: Warning,
            advice: "Check lateral shift, gauge, flange-back distance and position.",
            detail: format!(
                "the contact at y {:.1} to {:.1} mm of the {profile} is on the tip of its flange, as on a wheel that climbs or has derailed: check lateral \
                 shift, gauge and flange-back distance", y_mm[0], y_mm[1]
            ),

            /// The contact is near the end of a profile, so that part of it may be cut off.
            ContactAtProfileEnd {
                /// Whose.
                profile: &'static str = "wheel",
                /// Where on the profile, from and to.
                y_mm: [f64; 2] = [52.0, 58.0],
                /// What is left of the profile beyond the contact.
                left_mm: f64 = 2.0,
            }
            code: "contact-at-profile-end",
            severity: Warning,
            advice: "Check lateral shift and gauge, or send at least 5 mm of profile beyond the contact.",
            detail: format!(
                "the contact at y {:.1} to {:.1} mm of the {profile} is {} mm from the end of its profile: check lateral shift and gauge, or send \
                 a longer profile", y_mm[0], y_mm[1], short(left_mm)
            ),

            /// The target is smaller than the uncertainty that the measurement of the profiles leaves: a finer solve adds nothing.
            TargetBelowProfileUncertainty {
                /// The target, relative to μN.
                target: f64 = 1e-3,
                /// Uncertainty of the forces that the profiles leave, relative to μN.
                uncertainty: f64 = 0.02,
            }
            code: "target-below-profile-uncertainty",
            severity: Info,
            advice: "A better measurement reduces the uncertainty; a smaller target does not.",
            detail: format!(
                "the profiles leave forces uncertain by {} % of μN, more than the target of {} %",
                short(100.0 * uncertainty), short(100.0 * target)
            ),

            /// The case does not ask for a reference surface, and the curve of the rail does not solve it: it is solved on planes of contact.
            OnPlanes {
                /// Why.
                reason: String = "only boundary_element is solved on the curve of the rail".to_owned(),
            }
            code: "on-planes",
            severity: Warning,
            advice: "Expect larger errors than the error estimate where the rail bends under a patch: 15 % of μN at a gauge corner. Give `reference_surface` \"plane\" to solve on planes without this remark.",
            detail: format!("solved on planes of contact: {reason}"),

            /// The surface turns over the contact by more than the factors of the influence are known for.
            TurnBeyondRange {
                /// Turn of the rail's surface from one end of the contact to the other.
                turn_rad: f64 = 1.4,
                /// Turn up to which the factors were compared with boundary elements.
                range_rad: f64 = 1.25,
            }
            code: "turn-beyond-range",
            severity: Info,
            advice: "Take the forces as approximate: the influence between the ends of the contact is extrapolated, and the rail head is no half-space there.",
            detail: format!(
                "the surface turns by {} rad over the contact; the influence between its ends is known up to {range_rad} rad",
                short(turn_rad)
            ),

            /// The tractions of a motion in a list change the number of patches, or leave no answer; its pressures are those without tractions.
            NormalForcesAloneBalance {}
            code: "normal-forces-alone-balance",
            severity: Warning,
            advice: "Ask for the motion in a case of its own if its tractions should change the pressures, and its friction forces be included in the vertical balance.",
            detail: "the tractions of this motion change the number of patches, of which an answer to several motions has one list, or leave no answer: its pressures are                      those without tractions, and normal forces alone balance the load".to_owned(),

            /// A history under a vertical force has the pressures that belong to its last point.
            PressuresOfLastPoint {
                /// The largest difference of the vertical force of a point to that of the last one, relative to it.
                part: f64 = 0.12,
            }
            code: "pressures-of-last-point",
            severity: Info,
            advice: "Compare `total.force_z_n` of the points with the load; end the history where the forces are needed, or give `normal_force_n`.",
            detail: format!(
                "all points of a history have the pressures that belong to its last one, at which the vertical force is met; at others friction changes it by up to {} %,                  which the error estimates of their forces contain",
                short(100.0 * part)
            ),
        }
    };
}
pub(crate) use wheel_remarks;
