//! The solver of Liu and Hsu: Newton–Raphson on the slip cells inside an iteration over stick and slip zones.
//!
//! Source: "Non-Hertzian rolling contact stress analysis" (eq. 6 to 15; "the paper" below), after Liu and Paul. It is
//! included for comparison with the paper: it solves the same discrete equations as
//! [`boundary_element`](crate::rolling::methods::boundary_element), with dense matrices and a smaller domain of
//! convergence. The steps, as in §4 and §5 of the paper:
//!
//! 1. All cells stick; their tractions follow from eq. 11.
//! 2. Stick cells at or above their bound and slip cells whose traction opposes their slip (eq. 10) change zones
//!    ([`active_set`]).
//! 3. The stick tractions are eliminated (eq. 13, [`stick_block`]); Newton–Raphson gives the slip tractions
//!    (eq. 8 and 9, [`solve`]) from an initial guess (eq. 14 or 15, [`active_set`]). Steps 2 and 3 are repeated
//!    until no cell changes.
//! 4. The first run uses guess 1. If it fails, a solution on a coarse mesh with guess 1 gives the spin pole
//!    ([`vortex`](crate::rolling::methods::liu_hsu::solve)) for guess 2.
//!
//! # What the paper leaves open
//!
//! | question | here |
//! |---|---|
//! | eq. 6 sums slip along the strip, eq. 12 needs slip itself | rows are differenced along the strip: the map is that of [`Equations`](crate::rolling::slip_equations::SlipEquations) |
//! | weight of the own cell in eq. 6 | one half, from the centre to the side: [`Rule::Trapezoid`](crate::rolling::slip_rules::Rule::Trapezoid); any other rule can be used |
//! | `x_U`, "the closest boundary" | the leading edge for every cell; with a stick/slip boundary the equations change with the zones, and some have two solutions or none |
//! | when a stick cell slips | T reaches `μp (1 + 1e-9)` |
//! | when a slip cell sticks | `s·T < 0`, in the same pass |
//! | unknowns | slip tractions alone; slips are linear in them, so the steps are the same |
//! | eq. 14 and 15 at a pole (0/0) | any direction works |
//! | eq. 15 | plus under the root, factor `sgn φ` |
//! | where the spin pole is | the centre of the vortex of the coarse tractions, least squares weighted with the load; with the rigid pole eq. 15 is eq. 14 |
//! | a coarse solution that failed | its last tractions are still used for the pole; a converged coarse solution gave no better one |
//! | all cells slip, or all stick | eq. 11, or eq. 8 and 9, have no unknowns and are skipped |
//! | a division that occurs again | the run ends, because it would cycle |
//!
//! # Where it converges
//!
//! The paper says always. Measured, that is true only of the upwind rule without spin. Most failures are divisions that
//! repeat, because Newton–Raphson converges to a root of eq. 9 at which some tractions oppose their slips. If both guesses
//! fail, a third run follows, which is not in the paper ([`InitialGuess::Continued`](active_set::InitialGuess::Continued)):
//! it starts from the tractions and zones at which the Newton iteration of the boundary element method ends. It solves
//! all these motions on 5 × 5 cells. The table counts how many of 109 motions converge without it (normalised creepage 0
//! to 3 in four directions, spin 0 to 20). The pole of guess 2 comes from 25 coarse cells; without spin guess 1 stands in
//! its place. `cargo bench --bench convergence_domain` prints more.
//!
//! | rule, mesh | region | guess 1 | guess 2 | 1, then 2 (the paper) |
//! |---|---|---|---|---|
//! | upwind, 5 × 5 equal cells | circle | 63 | 101 | 102 |
//! | | ellipse, b = 0.3 a | 59 | 88 | 90 |
//! | | ellipse, b = 3.3 a | 75 | 97 | 97 |
//! | | egg | 70 | 102 | 102 |
//! | upwind, 10 × 10 equal cells | circle | 54 | 93 | 93 |
//! | | ellipse, b = 0.3 a | 53 | 78 | 80 |
//! | | ellipse, b = 3.3 a | 99 | 105 | 105 |
//! | | egg | 43 | 89 | 89 |
//! | trapezoid, 5 × 5 equal cells | circle | 78 | 99 | 100 |
//! | | ellipse, b = 0.3 a | 66 | 92 | 94 |
//! | | ellipse, b = 3.3 a | 89 | 91 | 94 |
//! | | egg | 84 | 99 | 103 |
//! | trapezoid, 12 × 12 graded cells | circle | 51 | 84 | 84 |
//! | | ellipse, b = 0.3 a | 45 | 61 | 66 |
//! | | ellipse, b = 3.3 a | 92 | 96 | 96 |
//! | | egg | 59 | 82 | 84 |
//!
//! A solve that does not converge is an error; `boundary_element` converges in all these states. All matrices are dense: 1000
//! cells take seconds and more than 100 MB, and the checks of a case allow no more cells than that.

pub mod active_set;
pub mod on_level;
pub mod solve;
pub mod stick_block;
