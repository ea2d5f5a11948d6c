//! Measured and analytic gaps against converged results of an independent program.

use crate::gap_samples::GapReference;
use crate::reference::solve;

fn check(cases: Vec<GapReference>) {
    for case in cases {
        let (solution, _) = solve(&case.case());
        let sum = |f: fn(&railhead::contact::solution::PatchSolution) -> f64| solution.patches.iter().map(f).sum::<f64>();
        let area = sum(|p| p.area_mm2);
        let pmax = solution.patches.iter().map(|p| p.pressure_max_mpa).fold(0.0, f64::max);
        let bound = 0.3 * case.normal_force_n;
        let c = (case.area_mm2.value / std::f64::consts::PI).sqrt();
        let total = solution.total[0];
        let n = solution.normal.unwrap();
        println!("{:24} {} patches, approach {:+.5} (unc {:.5}) area {:+.4} ({:.4}) pmax {:+.4} ({:.4}) F {:+.4} {:+.4} ({:.4}) M {:+.4} ({:.4}) cells {:?} it {} res {:.1e} {:?}",
            case.id, solution.patches.len(),
            solution.patches[0].approach_mm.unwrap() / case.approach_mm.value - 1.0, case.approach_mm.unc / case.approach_mm.value,
            area / case.area_mm2.value - 1.0, case.area_mm2.unc / case.area_mm2.value,
            pmax / case.pressure_max_mpa.value - 1.0, case.pressure_max_mpa.unc / case.pressure_max_mpa.value,
            (total.force_x_n - case.force_x_n.value) / bound, (total.force_y_n - case.force_y_n.value) / bound, case.force_y_n.unc / bound,
            (total.moment_z_n_mm - case.moment_z_n_mm.value) / bound / c, case.moment_z_n_mm.unc / bound / c, n.cells, n.iterations, n.residual, solution.warnings);
    }
}

#[test]
fn profiles() {
    check(GapReference::profiles());
}

#[test]
fn grids() {
    check(GapReference::grids());
}
