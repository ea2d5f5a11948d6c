//! Frame, signs, units, order of values and the words of this crate. Other modules refer to this page.
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
//! # Words
//!
//! | word | meaning |
//! |---|---|
//! | case | the question in the words of a client; checked, it is a [`CheckedCase`](crate::problem::checked_case::CheckedCase) |
//! | problem, run, label | what a case asks, how it is to be solved, what it is called |
//! | contact | what the bodies are: ellipse, radii, gap, pressure grid, profiles |
//! | normal task | what is known of patches and pressures before they are found ([`NormalTask`](crate::normal::footprint::NormalTask)) |
//! | footprint | patches and pressures, known ([`Footprint`](crate::normal::footprint::Footprint)) |
//! | patch | a connected part of the contact |
//! | approach | how far distant points of the bodies come together |
//! | lowering | how far a wheel is below its first touch on the rail |
//! | motion | creepages and spin of one state; a sweep has many |
//! | creepage ξ, η | rigid slip along and across rolling, over the rolling speed |
//! | spin φ | rigid rotation about the normal, over the rolling speed |
//! | friction limit | μN of a patch; the *bound* is μp of a cell |
//! | traction | tangential stress on the lower body |
//! | slip | relative velocity over the rolling speed; a cell *sticks* where it is 0 |
//! | zones | the cells that stick and those that slip |
//! | resultants | forces and moment of the tractions |
//! | strip | a part of a patch between two lines along rolling; its mid-line in the patch is a *chord* |
//! | segment | one chord of a strip; hollow patches have several in a strip |
//! | rule | how slip is differenced along a segment ([`Rule`](crate::rolling::slip_rules::Rule)) |
//! | operator | the map from tractions to displacements of a half-space |
//! | level | one mesh with its areas, pressures and operator ([`StripMesh`](crate::rolling::strip_mesh::StripMesh)) |
//! | regime | what tractions look like, for which a mesh is made: sticking, or turning about a pole |
//! | companion | the same level with half the strips or half the cells, which tells the error |
//! | target | the error of the resultants that a client allows |
//! | estimate | the error that is expected, beside every value |
//! | remark | a sentence with a code about an answer, where it holds and its figures |
//! | slice | motions of a sweep that are solved without a break |
