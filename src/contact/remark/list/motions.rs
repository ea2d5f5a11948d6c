//! Remarks on motions and on their forces.

/// Gives these remarks to the next macro that is named, behind those of the groups before.
macro_rules! motion_remarks {
    ($next:ident $(, $further:ident)*; $($before:tt)*) => {
        $next! {
            $($further),*;
            $($before)*

            /// Creepages are so large that they are no longer a small part of the rolling speed.
            Warning CreepageLarge {
                /// Longitudinal creepage.
                creepage_x: f64 = 5.0,
                /// Lateral creepage.
                creepage_y: f64 = 0.0,
                /// Spin times √(area/π) of the patch; absent where the patch is not known yet.
                spin_times_length: Option<f64> = Some(0.002),
                /// The largest that passes without a remark.
                usual_max: f64 = 0.2,
            }
            advice: "Check the unit (creepages are ratios, spin is in 1/mm). At such sliding speeds forces also depend on heat and wear.",
            detail: {
                let spin = spin_times_length.map_or_else(String::new, |spin| format!(" and the spin times the length of the patch is {}", short(spin)));
                format!("the creepages are {} and {}{spin}; the theory is made for values up to {usual_max}", short(creepage_x), short(creepage_y))
            },

            /// The second discretisation rule did not converge; forces come from the first alone.
            Warning SecondRuleFailed {}
            advice: "Use the forces with their larger error estimate, or try another mesh or target.",
            detail: "the trapezoid rule did not converge; forces come from the three-point rule and their error is larger".to_owned(),

            /// A solve for the gradients of a motion did not converge.
            Warning GradientsNotConverged {}
            advice: "The forces are not affected. Without gradients, take differences between motions.",
            detail: "a solve for the gradients of this motion did not converge; they are missing".to_owned(),

            /// Friction falls so fast with slip that the contact has a second state.
            Warning SeveralSolutions {
                /// Difference of the two forces relative to the friction limit.
                force_change: f64 = 0.08,
            }
            advice: "The result is the state reached from small slip. Reduce the speed, the pressure or the fall of friction to see where the two states separate.",
            detail: format!(
                "friction falls so fast with slip that a second state exists, reached from sliding, whose force differs by {} of \
                 the friction limit; the result is the one reached from rest",
                short(force_change)
            ),

            /// The contact passes so slowly that heat also flows along the surface.
            Warning HeatSpreads {
                /// Péclet number.
                peclet: f64 = 0.24,
                /// The least that passes without a remark.
                least: f64 = 10.0,
            }
            advice: "Take the temperatures as an upper bound; check the speed, which is in mm/s.",
            detail: format!(
                "the Péclet number is {}; temperatures are computed as if heat flowed only into the depth, which holds from about {least} on",
                short(peclet)
            ),

            /// The estimated error exceeds the target, or is unknown.
            Warning TargetMissed {
                /// What error and target are relative to.
                relative_to: &'static str = "μN",
                /// Estimated error; absent if it is unknown.
                estimate: Option<f64> = Some(2.3e-3),
                /// The target.
                target: f64 = 1e-3,
            }
            advice: "Use the numbers with their error estimate, or request a larger target.",
            detail: match estimate {
                Some(estimate) => format!(
                    "the error relative to {relative_to} is estimated at {}, the target was {target}", short(estimate)
                ),
                None => format!("the error relative to {relative_to} is unknown, the target was {target}"),
            },

            /// The error is a large part of the force, although it is a small part of μN.
            Info ErrorLargeForForce {
                /// Estimated error over the tangential force.
                error_over_force: f64 = 0.25,
                /// Tangential force over μN.
                force_over_limit: f64 = 0.02,
                /// Largest error over the force that passes without a remark.
                usual_max: f64 = 0.1,
            }
            advice: "Give `solver.relative_to: \"force\"` to solve to a share of the force, or a smaller `target_error`.",
            detail: format!(
                "the force is {} of μN, and its estimated error is {:.0} % of it; the target counts relative to μN",
                short(force_over_limit),
                100.0 * error_over_force
            ),

            /// No creepage gives the prescribed force; the result has the nearest force found.
            Warning ForceUnreachable {
                /// Force asked for along rolling; absent if none was.
                wanted_x_n: Option<f64> = Some(29_000.0),
                /// Force asked for across; absent if none was.
                wanted_y_n: Option<f64> = None,
                /// Force found along rolling.
                found_x_n: f64 = 28_100.0,
                /// Force found across.
                found_y_n: f64 = -350.0,
            }
            advice: "Prescribe a smaller force: the tractions due to spin use up a part of μN. The motion has `saturated: true`.",
            detail: {
                let wanted = |force: &Option<f64>| {
                    force.map_or_else(|| "free".to_owned(), |force| format!("{force} N"))
                };
                format!(
                    "no creepage gives the prescribed force (x: {}, y: {}); the nearest found is {found_x_n:.6e} N, {found_y_n:.6e} N",
                    wanted(wanted_x_n), wanted(wanted_y_n)
                )
            },

            /// An iteration ended before it met its tolerance; its result is used.
            Warning IterationInexact {
                /// Which iteration.
                iteration: &'static str = "force control",
                /// How it ended, as a clause.
                reason: &'static str = "the iteration limit was reached",
                /// Its last residual, in the measure of the iteration.
                residual: f64 = 3e-5,
                /// The residual that was wanted.
                tolerance: f64 = 2e-6,
            }
            advice: "Compare `residual` with `tolerance` to decide whether the result is accurate enough; the error estimate does not include this deviation.",
            detail: format!(
                "{iteration} ended before its tolerance was met: {reason}; the residual is {residual:.2e}, the tolerance {tolerance:.2e}"
            ),

            /// The scatter of the wear coefficients is not published; a stated factor replaces it.
            Info CoefficientScatterStated {
                /// The factor.
                factor: f64 = 2.0,
            }
            advice: "Give the scatter of your own measurements as `coefficient_factor`.",
            detail: format!(
                "no scatter of the coefficients of this wear map is published; it is assumed to be a factor of {factor} with a probability of 90 %"
            ),

            /// The contact pressure of a worn profile exceeds the hardness of the steel.
            Warning PressureAboveHardness {
                /// Largest pressure of the evolution.
                largest_mpa: f64 = 3100.0,
                /// Hardness.
                hardness_mpa: f64 = 2550.0,
            }
            advice: "Plastic flow would round the section there. Add states of traction, braking and other shifts to the traffic: a traffic without them leaves a ridge where nothing slips.",
            detail: format!(
                "the largest pressure is {largest_mpa:.0} MPa, above the hardness of {hardness_mpa:.0} MPa; plastic flow is not modelled"
            ),

            /// A condensed traffic does not meet its tolerance.
            Warning TrafficCoarse {
                /// Its error.
                traffic_error: f64 = 0.06,
                /// The tolerance.
                tolerance_asked: f64 = 0.03,
            }
            advice: "Raise `accuracy.states_max`.",
            detail: format!(
                "twice the number of states would change the distribution of wear by {} %; the tolerance is {} %",
                short(100.0 * traffic_error),
                short(100.0 * tolerance_asked)
            ),

            /// Part of the traffic could not be solved and causes no wear.
            Warning StatesUnsolved {
                /// Largest share of the traffic without an answer.
                unsolved_share: f64 = 0.03,
            }
            advice: "`failure` in the states of the records says why.",
            detail: format!(
                "up to {} % of the traffic could not be solved and causes no wear",
                short(100.0 * unsolved_share)
            ),
        }
    };
}
pub(crate) use motion_remarks;
