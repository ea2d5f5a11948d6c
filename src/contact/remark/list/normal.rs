//! Remarks on the normal problem: region, pressure and load.
//!
//! Remarks on what a case says.
//!
//! Remarks on the contact of a wheel and a rail: where it is, and what its model leaves out.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! normal_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// Pressure and region still change when the grid of the normal problem is refined.
            Warning GapRough {}
            advice: "Smooth the gap; if the surfaces are really as rough as this, give it on a finer grid.",
            detail: "the gap is rough: pressure and region still change when the grid of the normal problem is refined".to_owned(),

            /// A patch that carries a noticeable part of the load has few cells in the normal problem.
            Warning PatchCoarse {
                /// Cells across its narrower side.
                cells_across: f64 = 4.0,
                /// Its part of the load.
                load_share: f64 = 0.059,
            }
            advice: "Take the width and the pressure of this patch as uncertain by some per cent; if it matters, solve it in a separate case.",
            detail: format!(
                "the patch carries {} % of the load and has only {cells_across:.0} cells across: its width and its pressure are uncertain by \
                 some per cent",
                short(100.0 * load_share)
            ),

            /// A given pressure does not fall to 0 at the edge of its grid.
            Warning PressureCutAtEdge {}
            advice: "Give the pressure over the whole region where it is more than 0, with one row of zeros around it.",
            detail: "the pressure does not fall to 0 at the edge of the grid; the contact is taken to end within the next spacing".to_owned(),

            /// A patch of a given pressure has few samples.
            Warning PressureCoarse {
                /// Samples along rolling.
                samples_x: usize = 4,
                /// Samples across.
                samples_y: usize = 7,
            }
            advice: "Give the pressure on a finer grid.",
            detail: format!(
                "the patch has only {samples_x} by {samples_y} samples of pressure; its force and its edge are uncertain by some per cent"
            ),

            /// The given pressure jumps from one sample to the next, more than it would at the edge of a contact. Strips and cells do not follow
            /// the jump, and errors may be larger than estimated.
            Warning PressureJumps {
                /// Where, halfway between the two samples; the largest jump.
                x_mm: f64 = 1.5,
                /// The same across.
                y_mm: f64 = -0.5,
                /// The fall over the largest pressure.
                share_of_largest: f64 = 0.8,
            }
            advice: "Give finer samples, or smooth the pressure over two or three of them.",
            detail: format!(
                "the pressure jumps by {} of its largest value between samples at ({}, {}) mm, which strips and cells do not follow",
                short(share_of_largest),
                short(x_mm),
                short(y_mm)
            ),

            /// The contact is long compared with the rolling radius: the bodies are nearly conformal.
            Warning NearlyConformal {
                /// Length of the contact along rolling.
                length_mm: f64 = 14.2,
                /// Rolling radius.
                rolling_radius_mm: f64 = 20.0,
            }
            advice: "Half-spaces do not describe such bodies: treat the result as approximate.",
            detail: format!(
                "the contact is {} mm long, compared with a rolling radius of {rolling_radius_mm} mm: the bodies are nearly \
                 conformal, and half-spaces do not describe them",
                short(length_mm)
            ),

            /// The bodies overlap so deeply that strains are too large for linear elasticity.
            Warning StrainsTooLarge {
                /// Approach from first touch.
                overlap_mm: f64 = 1.1,
                /// Smaller half width of the contact.
                half_width_mm: f64 = 3.4,
            }
            advice: "Check units and load. If they are right, the bodies yield and pressures are lower than those of the result.",
            detail: format!(
                "the bodies overlap by {} mm, compared with a half width of {} mm of the contact: strains are too large for linear elasticity",
                short(overlap_mm),
                short(half_width_mm)
            ),

            /// The patch is large compared with the radii of the bodies, so that half-spaces do not describe them.
            Warning PatchLarge {
                /// `rolling` or `lateral`.
                direction: &'static str = "rolling",
                /// Half width of the patch in this direction.
                half_width_mm: f64 = 210.0,
                /// Relative radius in this direction.
                radius_mm: f64 = 460.0,
            }
            advice: "Check the units of load and radii: bodies are like half-spaces only if the half width is below a third of the radius.",
            detail: format!(
                "the patch has a half width of {} mm in the {direction} direction, compared with a radius of {radius_mm} mm",
                short(half_width_mm)
            ),

            /// The largest pressure is far above the strength of steel.
            Warning PressureImplausible {
                /// Largest pressure.
                pressure_max_mpa: f64 = 8100.0,
                /// The largest that passes without a remark.
                usual_max_mpa: f64 = 5000.0,
            }
            advice: "Check the units of load and geometry. If they are right, the bodies yield and the pressure is lower than that of the result.",
            detail: format!(
                "the largest pressure is {} MPa, more than {usual_max_mpa} MPa: bodies of steel would yield",
                short(pressure_max_mpa)
            ),

            /// A length of the track or the wheelset is unusual in mm, but usual in another unit.
            Warning LengthUnusual {
                /// The length as given.
                length_mm: f64 = 1.435,
                /// The unit in which it would be usual.
                unit: &'static str = "m",
            }
            advice: "Check its unit: lengths are in mm.",
            detail: format!("{length_mm} mm is unusual here and would be usual in {unit}: lengths are in mm"),

            /// The largest pressure is above the shakedown limit of rail steel.
            Info PressureAboveShakedown {
                /// Largest pressure.
                pressure_max_mpa: f64 = 1900.0,
                /// The shakedown limit.
                shakedown_limit_mpa: f64 = 1500.0,
            }
            advice: "The result is elastic. Harder steel has a higher limit; traction lowers it.",
            detail: format!(
                "the largest pressure of {pressure_max_mpa:.0} MPa is above {shakedown_limit_mpa} MPa, the shakedown limit of rail steel R260 in \
                 pure rolling: repeated passages deform the surface plastically"
            ),

            /// The load is larger than any wheel carries.
            Warning LoadImplausible {
                /// Normal force of all patches.
                normal_force_n: f64 = 1e12,
                /// The largest that passes without a remark.
                usual_max_n: f64 = 1e7,
            }
            advice: "Check its unit: forces are in N.",
            detail: format!("the normal force is {} N, more than {usual_max_n:e} N", short(normal_force_n)),
        }
    };
}
pub(crate) use normal_remarks;

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! case_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// The friction coefficient is larger than is usual.
            Warning FrictionUnusual {
                /// The coefficient given.
                coefficient: f64 = 1.5,
                /// The largest that passes without a remark.
                usual_max: f64 = 1.0,
            }
            advice: "Check `friction.coefficient`: dry steel has about 0.3 to 0.6.",
            detail: format!("the friction coefficient {coefficient} is more than {usual_max}"),

            /// A number is unusual for wheel and rail, but usual in another unit.
            Warning UnitSuspected {
                /// The number given.
                given: f64 = 75.0,
                /// The unit that it is taken in.
                unit: String = "N".to_owned(),
                /// The unit that it is likely given in.
                likely_unit: String = "kN".to_owned(),
            }
            advice: "Check the unit of the member that `pointer` names; if the number is intended, no action is needed.",
            detail: format!("{given} {unit} is unusual for wheel and rail: is it given in {likely_unit}?"),

            /// The materials of the bodies differ. They are combined, but the coupling of pressure and traction is neglected.
            Warning CouplingNeglected {
                /// Difference parameter K (Kalker 1990, eq. 1.44).
                difference_parameter: f64 = 0.021,
            }
            advice: "Expect errors of the order of K in tractions, or use `boundary_element`, which includes the coupling.",
            detail: format!(
                "the two bodies differ (K = {}); the coupling of pressure and traction is neglected",
                short(difference_parameter)
            ),

            /// The materials of the bodies differ. The effect of pressure on tractions is included, the effect of tractions on pressure
            /// is not.
            Warning CouplingFirstOrder {
                /// Difference parameter K (Kalker 1990, eq. 1.44).
                difference_parameter: f64 = 0.1,
                /// Error of forces that this leaves, relative to the friction limit; it is part of the error estimates.
                error: f64 = 0.018,
            }
            advice: "The error estimates include this error. Steady motions include both effects, except motions whose tractions separate or join patches.",
            detail: format!(
                "the two bodies differ (K = {}); the effect of pressure on tractions is included, the effect of tractions on \
                 pressure is not; this leaves an error of {} of the friction limit",
                short(difference_parameter),
                short(error)
            ),
        }
    };
}
pub(crate) use case_remarks;

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! wheel_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// The contact is on the tip of the flange, as on a wheel that climbs or has derailed.
            Warning ContactOnFlangeTip {
                /// Whose.
                profile: &'static str = "wheel",
                /// Where on the profile, from and to.
                y_mm: [f64; 2] = [-58.0, -52.0],
            }
            advice: "Check lateral shift, gauge, flange-back distance and position.",
            detail: format!(
                "the contact at y {:.1} to {:.1} mm of the {profile} is on the tip of its flange, as on a wheel that climbs or has derailed: check lateral \
                 shift, gauge and flange-back distance", y_mm[0], y_mm[1]
            ),

            /// The contact is near the end of a profile, so that part of it may be cut off.
            Warning ContactAtProfileEnd {
                /// Whose.
                profile: &'static str = "wheel",
                /// Where on the profile, from and to.
                y_mm: [f64; 2] = [52.0, 58.0],
                /// What is left of the profile beyond the contact.
                left_mm: f64 = 2.0,
            }
            advice: "Check lateral shift and gauge, or send at least 5 mm of profile beyond the contact.",
            detail: format!(
                "the contact at y {:.1} to {:.1} mm of the {profile} is {} mm from the end of its profile: check lateral shift and gauge, or send \
                 a longer profile", y_mm[0], y_mm[1], short(left_mm)
            ),

            /// The target is smaller than the uncertainty due to the measurement of the profiles; a finer solution does not improve the
            /// result.
            Info TargetBelowProfileUncertainty {
                /// The target, relative to μN.
                target: f64 = 1e-3,
                /// Uncertainty of the forces that the profiles leave, relative to μN.
                uncertainty: f64 = 0.02,
            }
            advice: "A better measurement reduces the uncertainty; a smaller target does not.",
            detail: format!(
                "the profiles leave forces uncertain by {} % of μN, more than the target of {} %",
                short(100.0 * uncertainty), short(100.0 * target)
            ),

            /// The target is smaller than the error that the factors for the turn of the contact surface leave: a finer solve adds nothing.
            Info TargetBelowCurveError {
                /// The target, relative to μN.
                target: f64 = 5e-3,
                /// Error of forces that the factors leave, relative to μN; it is part of the error estimates.
                error: f64 = 0.035,
            }
            advice: "The error is part of the estimates; `target_met` judges the rest of them. Give `reference_surface` \"half_space\" to leave the factors out.",
            detail: format!(
                "the surface turns under the contact, which leaves forces uncertain by {} % of μN, more than the target of {} %",
                short(100.0 * error), short(100.0 * target)
            ),

            /// The case names no reference surface and cannot be solved on the curve of the rail, so it is solved on planes of contact.
            Warning OnPlanes {
                /// Why.
                reason: String = "only boundary_element is solved on the curve of the rail".to_owned(),
            }
            advice: "Expect larger errors than the error estimate where the rail bends under a patch: 15 % of μN at a gauge corner. Give `reference_surface` \"plane\" to solve on planes without this remark.",
            detail: format!("solved on planes of contact: {reason}"),

            /// The slope of the surface changes over the contact by more than the range for which influence factors are known.
            Info TurnBeyondRange {
                /// Turn of the rail's surface from one end of the contact to the other.
                turn_rad: f64 = 1.4,
                /// Turn up to which the factors were compared with boundary elements.
                range_rad: f64 = 1.25,
            }
            advice: "Treat the forces as approximate: the influence between the ends of the contact is extrapolated, and the rail head is not a half-space there.",
            detail: format!(
                "the surface turns by {} rad over the contact; the influence between its ends is known up to {range_rad} rad",
                short(turn_rad)
            ),

            /// The tractions of one of several motions change the number of patches or have no solution; the pressures of this motion
            /// are those without tractions.
            Warning NormalForcesAloneBalance {}
            advice: "Submit the motion as a separate case to include the effect of its tractions on the pressures and of its friction on the vertical balance.",
            detail: "the tractions of this motion change the number of patches, which must be the same for all motions of a case, or have no \
                     solution: its pressures are those without tractions, and normal forces alone balance the load".to_owned(),

            /// All points of a history under a vertical force have the pressures of its last point.
            Info PressuresOfLastPoint {
                /// The largest difference of the vertical force of a point to that of the last one, relative to it.
                part: f64 = 0.12,
            }
            advice: "Compare `total.force_z_n` of the points with the load; end the history where the forces are needed, or give `normal_force_n`.",
            detail: format!(
                "all points of a history have the pressures of its last one, at which the vertical force is met; at other points friction \
                 changes the vertical force by up to {} %, which the error estimates of their forces include",
                short(100.0 * part)
            ),
        }
    };
}
pub(crate) use wheel_remarks;
