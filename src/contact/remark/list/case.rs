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

            /// The two bodies differ. Their materials are combined, but pressure and traction are solved one after the other.
            CouplingNeglected {
                /// Difference parameter K (Kalker 1990, eq. 1.44).
                difference_parameter: f64 = 0.021,
            }
            code: "coupling-neglected",
            severity: Warning,
            advice: "Expect errors of the order of K in tractions; above 0.05 cases are refused.",
            detail: format!(
                "the two bodies differ (K = {difference_parameter:.4}); the coupling of pressure and traction is neglected"
            ),
        }
    };
}
pub(crate) use case_remarks;
