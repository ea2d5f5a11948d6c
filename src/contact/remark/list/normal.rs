//! Remarks on the normal problem: region, pressure and load.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! normal_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// Pressure and region still change when the grid of the normal problem is refined.
            GapRough {}
            code: "gap-rough",
            severity: Warning,
            advice: "Smooth the gap; if the surfaces are really as rough as this, give it on a finer grid.",
            detail: "the gap is rough: pressure and region still change when the grid of the normal problem is refined".to_owned(),

            /// A patch that carries a noticeable part of the load has few cells in the normal problem.
            PatchCoarse {
                /// Cells across its narrower side.
                cells_across: f64 = 4.0,
                /// Its part of the load.
                load_share: f64 = 0.059,
            }
            code: "patch-coarse",
            severity: Warning,
            advice: "Take the width and the pressure of this patch as uncertain by some per cent; if it matters, solve it in a case of its own.",
            detail: format!(
                "the patch carries {} % of the load and has only {cells_across:.0} cells across: its width and its pressure are uncertain by \
                 some per cent",
                short(100.0 * load_share)
            ),

            /// A given pressure does not fall to 0 at the edge of its grid.
            PressureCutAtEdge {}
            code: "pressure-cut-at-edge",
            severity: Warning,
            advice: "Give the pressure over the whole region where it is more than 0, with one row of zeros around it.",
            detail: "the pressure does not fall to 0 at the edge of the grid; the contact is taken to end within the next spacing".to_owned(),

            /// A patch of a given pressure has few samples.
            PressureCoarse {
                /// Samples along rolling.
                samples_x: usize = 4,
                /// Samples across.
                samples_y: usize = 7,
            }
            code: "pressure-coarse",
            severity: Warning,
            advice: "Give the pressure on a finer grid.",
            detail: format!(
                "the patch has only {samples_x} by {samples_y} samples of pressure; its force and its edge are uncertain by some per cent"
            ),

            /// The given pressure jumps from one sample to the next, more than it would at the edge of a contact. Strips and cells do not follow
            /// the jump, and errors may be larger than estimated.
            PressureJumps {
                /// Where, halfway between the two samples; the largest jump.
                x_mm: f64 = 1.5,
                /// The same across.
                y_mm: f64 = -0.5,
                /// The fall over the largest pressure.
                share_of_largest: f64 = 0.8,
            }
            code: "pressure-jumps",
            severity: Warning,
            advice: "Give finer samples, or smooth the pressure over two or three of them.",
            detail: format!(
                "the pressure jumps by {} of its largest value between samples at ({}, {}) mm, which strips and cells do not follow",
                short(share_of_largest),
                short(x_mm),
                short(y_mm)
            ),

            /// The contact is long compared with the rolling radius: the bodies are nearly conformal.
            NearlyConformal {
                /// Length of the contact along rolling.
                length_mm: f64 = 14.2,
                /// Rolling radius.
                rolling_radius_mm: f64 = 20.0,
            }
            code: "nearly-conformal",
            severity: Warning,
            advice: "Half-spaces do not describe such bodies: take the answer as approximate.",
            detail: format!(
                "the contact is {} mm long, compared with a rolling radius of {rolling_radius_mm} mm: the bodies are nearly \
                 conformal, and half-spaces do not describe them",
                short(length_mm)
            ),

            /// The bodies overlap so deeply that strains are too large for linear elasticity.
            StrainsTooLarge {
                /// Approach from first touch.
                overlap_mm: f64 = 1.1,
                /// Smaller half width of the contact.
                half_width_mm: f64 = 3.4,
            }
            code: "strains-too-large",
            severity: Warning,
            advice: "Check units and load. If they are right, the bodies yield and pressures are lower than the answer says.",
            detail: format!(
                "the bodies overlap by {} mm, compared with a half width of {} mm of the contact: strains are too large for linear elasticity",
                short(overlap_mm),
                short(half_width_mm)
            ),

            /// The patch is large compared with the radii of the bodies, so that half-spaces do not describe them.
            PatchLarge {
                /// `rolling` or `lateral`.
                direction: &'static str = "rolling",
                /// Half width of the patch in this direction.
                half_width_mm: f64 = 210.0,
                /// Relative radius in this direction.
                radius_mm: f64 = 460.0,
            }
            code: "patch-large",
            severity: Warning,
            advice: "Check the units of load and radii: bodies are like half-spaces only if the half width is below a third of the radius.",
            detail: format!(
                "the patch has a half width of {} mm in the {direction} direction, compared with a radius of {radius_mm} mm",
                short(half_width_mm)
            ),

            /// The largest pressure is far beyond what steel bears.
            PressureImplausible {
                /// Largest pressure.
                pressure_max_mpa: f64 = 8100.0,
                /// The largest that passes without a remark.
                usual_max_mpa: f64 = 5000.0,
            }
            code: "pressure-implausible",
            severity: Warning,
            advice: "Check the units of load and geometry. If they are right, the bodies yield and the pressure is lower than the answer says.",
            detail: format!(
                "the largest pressure is {} MPa, more than {usual_max_mpa} MPa: bodies of steel would yield",
                short(pressure_max_mpa)
            ),

            /// A length of the track or the wheelset would be usual in another unit than mm.
            LengthUnusual {
                /// The length as given.
                length_mm: f64 = 1.435,
                /// The unit in which it would be usual.
                unit: &'static str = "m",
            }
            code: "length-unusual",
            severity: Warning,
            advice: "Check its unit: lengths are in mm.",
            detail: format!("{length_mm} mm is unusual here and would be usual in {unit}: lengths are in mm"),

            /// The largest pressure is above the shakedown limit of rail steel.
            PressureAboveShakedown {
                /// Largest pressure.
                pressure_max_mpa: f64 = 1900.0,
                /// The shakedown limit.
                shakedown_limit_mpa: f64 = 1500.0,
            }
            code: "pressure-above-shakedown",
            severity: Info,
            advice: "The answer is elastic. Harder steel has a higher limit; traction lowers it.",
            detail: format!(
                "the largest pressure of {pressure_max_mpa:.0} MPa is above {shakedown_limit_mpa} MPa, the shakedown limit of rail steel R260 in \
                 pure rolling: repeated passages deform the surface plastically"
            ),

            /// The load is larger than any wheel bears.
            LoadImplausible {
                /// Normal force of all patches.
                normal_force_n: f64 = 1e12,
                /// The largest that passes without a remark.
                usual_max_n: f64 = 1e7,
            }
            code: "load-implausible",
            severity: Warning,
            advice: "Check its unit: forces are in N.",
            detail: format!("the normal force is {} N, more than {usual_max_n:e} N", short(normal_force_n)),
        }
    };
}
pub(crate) use normal_remarks;
