//! Remarks on what a case says.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! case_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// The friction coefficient is larger than is usual.
            FrictionUnusual {
                /// The coefficient given.
                coefficient: f64 = 1.5,
                /// The largest that passes without a remark.
                usual_max: f64 = 1.0,
            }
            code: "friction-unusual",
            severity: Warning,
            advice: "Check `friction.coefficient`: dry steel has about 0.3 to 0.6.",
            detail: format!("the friction coefficient {coefficient} is more than {usual_max}"),

            /// A number is unusual for wheel and rail, but usual in another unit.
            UnitSuspected {
                /// The number given.
                given: f64 = 75.0,
                /// The unit that it is taken in.
                unit: String = "N".to_owned(),
                /// The unit that it is likely given in.
                likely_unit: String = "kN".to_owned(),
            }
            code: "unit-suspected",
            severity: Warning,
            advice: "Check the unit of the member that `pointer` names; if the number is meant as it stands, nothing is wrong.",
            detail: format!("{given} {unit} is unusual for wheel and rail: is it given in {likely_unit}?"),

            /// The two bodies differ. Their materials are combined, but pressure and traction are solved one after the other.
            CouplingNeglected {
                /// Difference parameter K (Kalker 1990, eq. 1.44).
                difference_parameter: f64 = 0.021,
            }
            code: "coupling-neglected",
            severity: Warning,
            advice: "Expect errors of the order of K in tractions, or take `boundary_element`, which couples them.",
            detail: format!(
                "the two bodies differ (K = {}); the coupling of pressure and traction is neglected",
                short(difference_parameter)
            ),

            /// The two bodies differ. Tractions follow from the pressure, but the pressure is that without tractions.
            CouplingFirstOrder {
                /// Difference parameter K (Kalker 1990, eq. 1.44).
                difference_parameter: f64 = 0.1,
                /// Error of forces that this leaves, relative to the friction limit; it is part of the error estimates.
                error: f64 = 0.018,
            }
            code: "coupling-first-order",
            severity: Warning,
            advice: "The error is part of the estimates. Steady motions also include the effect of tractions on pressure, but for those whose tractions part or join patches.",
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
