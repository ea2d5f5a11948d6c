//! Tuned numbers of the error estimate and of the refinement: what each was fitted on, how to see it again, and how much
//! it matters.
//!
//! Sensitivities without another population are those of the first 160 ellipses at the target 0.005 and the first 80 at 0.001, with the
//! number changed alone; *work* is the sum of products times the square of the cells.
//!
//! Populations are those of `benches/calibrate`: random ellipses (a/b 1/20 … 20, creepages and spin over two decades), gaps,
//! pressure grids and profiles, each against meshes of several thousand cells. Every table is printed by
//! `cargo bench --bench calibrate`.

/// Factor on each of the three differences that stand for the error: between the two rules, to half the strips, to half the
/// cells. The 95 % quantile of error over root of squares, 494 first and 2700 later ellipse meshes: 0.56, and 0.57 to 0.39
/// with growing size. 0.55 leaves 1 % more uncovered.
pub const DIFFERENCES: f64 = 0.6;
/// The factor falls as this power of the cells beyond those of the first mesh, as far as the same quantiles do. 0.06 takes 20 to 35 % more
/// work, 0.18 takes 8 to 25 % less and leaves one case in a hundred more uncovered.
pub const DECAY: f64 = 0.12;
/// The difference of the rules counts for more where a companion did not converge, which happens on two to four strips or
/// cells; one case in a thousand. Chosen by judgement; how much it matters was not measured.
pub const WITHOUT_COMPANION: f64 = 1.5;
/// Factor on the change from a coarser level, times 1 over (ratio of cells − 1): between levels of one kind, and from the
/// first mesh to one that is not gathered. It only lets a mesh be refused before its companions are solved; 0.2 and 0.45 change the work
/// by less than 1 %.
pub const LEVELS_LIKE: f64 = 0.3;
/// The same between levels of different kinds; 0.1 and 0.25 change the work by less than 1 %.
pub const LEVELS_UNLIKE: f64 = 0.15;
/// A level is compared with a coarser one if it has at least this many times its cells; with 1.5 the work changes by 1 %.
pub const LEVEL_RATIO_MIN: f64 = 1.8;
/// Error of sampling the vortex of the tractions by the cell that holds its centre, over p h² / N (1500 solves on random
/// meshes with spin: 0.3 median, 0.45 at 90 %), and its weight beside the differences, which see part of it (95 % of error
/// over estimate on first meshes .87 without, .73 with it).
pub const POLE: f64 = 0.45;
/// The weight of that error; see [`POLE`].
pub const POLE_WEIGHT: f64 = 0.3;
/// With the load on fewer strips than these, counted by `(Σ load)² / Σ load²`, the estimate is multiplied by the shortfall (this number over
/// the count), on an explicit mesh by its square; four strips of an ellipse count as 3.5. 3 and 4.5 are alike on ellipses; needed
/// for irregular patches of gaps.
pub const STRIPS_FEW: f64 = 3.5;
/// Factor for a motion by itself where region and pressure are closed forms: the errors are those of the mesh alone. See [`HERTZ_DECAY`].
pub const HERTZ: f64 = 0.9;
/// The power of the cells that it falls with in place of [`DECAY`]. The first 200 ellipses at the targets .005, .002 and .001: .995, .99 and .975
/// covered, estimates 1.8, 2.6 and 2.4 times the error in the median; the other 200: .955, .975 and .985, and 2.1, 2.6 and 2.5. With
/// [`DECAY`] they cover 1 % more at .002 and .001 and take 10 to 20 % more time, with .24 one case in a hundred less and 10 % less.
pub const HERTZ_DECAY: f64 = 0.21;
/// Factor where a smooth pressure is given in samples, and the power of the cells that it falls with in place of [`DECAY`]. Chosen on 160
/// grids at targets of 0.02, 0.005 and 0.001: .95, .96 and .98 covered, estimates 3.7, 3.3 and 3.3 times the error in the median; 160
/// others: .95, .96 and .99, and 3.8, 3.2 and 3.5 (`cargo bench --bench calibrate`). .76 gives 4.2, 3.3 and 3.5 there and covers .97, .96
/// and .99.
pub const SAMPLED: f64 = 0.71;
/// The power; see [`SAMPLED`].
pub const SAMPLED_DECAY: f64 = 0.05;
/// Factor where the pressure jumps from one sample to the next (40 grids of the first half: .95, .93 and 1.0 covered at three
/// targets, 40 others: .95, .98 and .98; larger factors do not help). Ellipses and gaps need none: with 1.15 their estimates are 4.2 to 6 times the error in the
/// median and cover one case in fifty more.
pub const JUMPING: f64 = 1.5;
/// Surprises (see `GridPressure::surprise`) up to which a pressure is smooth and from which on it jumps; between them the factor grows.
/// Half of the smooth grids have less than the first; with .12 and .35 of 80 of them .93 were covered at 0.02, not .95. With .78 for all
/// that do not jump one jumping grid in ten is covered no more.
pub const SURPRISES: [f64; 2] = [0.06, 0.31];
/// Factor on the change of the moments of such a pressure to twice as many strips and cells; .3 to 1 are alike.
pub const DATA: f64 = 0.5;
/// Error of the resultants from region and pressure of a gap on so many cells of the normal problem across a patch. Change to 100 cells at
/// 75 and 90 % of 100 gaps and of 96 patches of wheels on rails: .0003 to .0007 from 44 cells, .0005 to .0016 from 28, .0012 to .0027 from
/// 20. 5e-4 and 7e-4 cover as many of these.
pub const REGION: f64 = 6e-4;
/// The cells that [`REGION`] belongs to.
pub const REGION_CELLS: f64 = 44.0;
/// Power of the cells that it falls with; see [`REGION`].
pub const REGION_POWER: f64 = 1.75;
/// On so few cells that error is twice what this power says, and on half as many five times: a patch with a few
/// ten-thousandths of the load may have a third of its force. Chosen on that patch, the only one of the 100 of `calibrate profiles` at 0.02 that
/// [`REGION`] alone is more than twice too small for; from ten cells on it adds less than a tenth.
pub const REGION_CELLS_FEW: f64 = 3.0;
/// Relative error of resultants over that of the load they are found under: 2/3 for small creepages (areas of Hertz's
/// contacts), 1 in full slip.
pub const LOAD: f64 = 1.0;
/// Share of the differences that is added to the resultants: errors of second order in strips and in cells (median of the
/// error halved on 1900 meshes, its 90 % from .0034 to .0026 at 181 to 256 cells; weights .2 to .4 within 10 %).
pub const EXTRAPOLATED: f64 = 1.0 / 3.0;
/// Error that the next mesh is expected to have for its cells, over the present error. 0.65 takes 3 % more work at
/// the target 0.001 and 1 takes 4 % less; at 0.005 both take 40 to 60 % more, because of a few cases that step over a mesh size.
pub const MARGIN: f64 = 0.8;
/// The same where the pressure is no closed form, on a mesh that was compared with both companions, which cost more than the mesh itself. With
/// [`MARGIN`] in place of this and of [`MARGIN_REFUSED`] the 26 gaps of the report take 3050 products, not 2510, and a mesh more in the
/// median.
pub const MARGIN_COMPARED: f64 = 1.0;
/// The same on a mesh that was refused before it was compared with both: its error is more than what refused it.
pub const MARGIN_REFUSED: f64 = 1.3;
/// Smallest mesh for a target below `FINE_TARGET`: on fewer cells three small differences may coincide by accident. At 0.001, 64 takes the
/// same work and 200 takes 3 % more.
pub const CELLS_FINE: usize = 128;
/// The target below which [`CELLS_FINE`] holds.
pub const FINE_TARGET: f64 = 0.002;
/// Fewest cells of a motion by itself whose error the table may tell, for targets up to `SHOWN_TARGET`: forces need no more, but zones and outlines
/// are drawn from the cells. On so many the outline of a patch encloses its area within 2 %, on 128 not quite. Without it the Hertz cases of
/// the report take 0.14 LU at 0.005 in the median, with it 0.21, and their error is 0.0020 and 0.0012.
pub const CELLS_SHOWN: usize = 160;
/// See [`CELLS_SHOWN`]. It is the default target.
pub const SHOWN_TARGET: f64 = 0.005;
/// Stick below this share of the cells' area counts as none (.04 to .15 are alike).
pub const STICK_NEGLIGIBLE: f64 = 0.12;
/// With less stick than this on the first level, a pole in a sticking cell may as well be in a slipping one. 0.12 and 0.3 are alike.
pub const STICK_UNCERTAIN: f64 = 0.2;
/// A motion of a sweep goes on with half the cells when its estimate is smaller than this part of the target: less often than the
/// estimate's own changes along a sweep would have it. Chosen by judgement; how much it matters was not measured.
pub const SLACK: f64 = 1.0 / 6.0;
/// The same about a pole, where every motion has a mesh of its own to be filled, and a finer one costs four times as much: the
/// estimate about doubles with half the cells, and stays below the target. With 1/6 creep maps at fixed spin took 1.4 times as
/// long at 0.001 and 1.5 times at 0.005.
pub const SLACK_POLE: f64 = 0.4;
/// Factors of an explicit mesh, where companions are not solved, on the difference of the two rules; the second where region
/// and pressure come from samples (62 Hertz contacts, 64 to 576 cells).
pub const RULES_ON_MESH: f64 = 2.3;
/// The second of these factors; see [`RULES_ON_MESH`].
pub const RULES_ON_MESH_SAMPLED: f64 = 3.45;
/// That estimate grows as this power of the slenderness of a patch. Chosen by judgement; how much it matters was not measured.
pub const CAUTION: f64 = 0.4;
/// The dense method's change between its two levels, times 1 over (ratio of cells − 1); the second where they are so near each
/// other that this is more than `SHARE_LARGE`. Chosen by judgement; how much it matters was not measured.
pub const DENSE_LEVELS: f64 = 1.25;
/// The factor for levels that are near each other; see [`DENSE_LEVELS`]. Chosen by judgement; how much it matters was not measured.
pub const DENSE_LEVELS_NEAR: f64 = 1.9;
/// Threshold that identifies such levels; see [`DENSE_LEVELS`]. Chosen by judgement; how much it matters was not measured.
pub const SHARE_LARGE: f64 = 1.5;
