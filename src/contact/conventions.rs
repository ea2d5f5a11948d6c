//! Frame, signs, units, order of values and the glossary of this crate.
//!
//! # Units
//!
//! mm, N, MPa, rad, s. Creepages are dimensionless, spin is in 1/mm. Inside a mesh level everything is dimensionless by
//! [`Scale`](crate::rolling::strip_mesh::Scale). Errors of resultants are relative to μN, those of the moment to
//! μN√(A/π).
//!
//! # Frame and signs
//!
//! *x* points along rolling, so that the leading edge is at larger x; *y* to the left; *z* up, out of the lower body (body 2, the
//! rail). Forces, moments and tractions are those on the lower body; slip is that of the upper body relative to the lower one, so
//! that traction and slip of a slipping cell point the same way. Kalker's CONTACT reports forces on body 1, whose signs are the
//! reverse. The forces on each patch of a wheel on a rail are also given in axes of the patch, turned about *x* by its mean contact
//! angle; track axes are those of the rail's foot.
//!
//! # Order of values
//!
//! - Cells of a mesh: patch by patch, strip by strip from smaller to larger y, segment by segment and in each from the trailing end
//!   (smaller x) to the leading end ([`strips`](crate::mesh)).
//! - Vectors of the slip equations: all x components, then all y components
//!   ([`slip_equations`](crate::rolling::slip_equations)).
//! - Grids: the value at `(x[i], y[j])` is `rows[j][i]`, stored at `j * nx + i`.
//! - Patches: in order of their smallest y.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | case | the input of a client; a checked one is a [`CheckedCase`](crate::problem::checked_case::CheckedCase) |
//! | problem, run, label | the physics of a case, how it is solved, and its name |
//! | contact | the kind of contact: ellipse, radii, gap, pressure grid, profiles, wheelset |
//! | normal task | the normal problem ([`NormalTask`](crate::normal::footprint::NormalTask)) |
//! | footprint | patches and pressures, the solution of the normal problem ([`Footprint`](crate::normal::footprint::Footprint)) |
//! | patch | a connected part of the contact area |
//! | approach | displacement of distant points of the bodies toward each other |
//! | lowering | vertical displacement of a wheel below its first touch on the rail |
//! | motion | creepages and spin of one state; a sweep has many |
//! | creepage ξ, η | rigid slip in the rolling and in the lateral direction, divided by the rolling speed |
//! | spin φ | rigid rotation about the normal, divided by the rolling speed |
//! | friction limit | μN of a patch; the *bound* is μp of a cell |
//! | traction | tangential stress on the lower body |
//! | slip | relative velocity divided by the rolling speed; a cell with slip 0 *sticks* |
//! | zones | the cells that stick and those that slip |
//! | resultants | forces and moment of the tractions |
//! | strip | a part of a patch between two lines in the rolling direction; its mid-line in the patch is a *chord* |
//! | segment | one chord of a strip; strips of hollow patches have several |
//! | rule | the difference scheme of slip along a segment ([`Rule`](crate::rolling::slip_rules::Rule)) |
//! | operator | the map from tractions to displacements of a half-space |
//! | level | a mesh with its areas, pressures and operator ([`StripMesh`](crate::rolling::strip_mesh::StripMesh)) |
//! | regime | the type of tractions for which a mesh is made: adhesion, or rotation about a pole |
//! | companion | the level with half the strips or half the cells, from which the error is estimated |
//! | target | the error of the resultants that a client allows |
//! | estimate | the expected error of a value |
//! | remark | information about an answer: a code, a sentence, its location and figures |
//! | slice | motions of a sweep that are solved together |
