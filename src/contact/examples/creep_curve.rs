//! The creep curve of a Hertz contact: force over longitudinal creepage, with the error of each force.
#![allow(clippy::print_stdout, reason = "an example shows its result")]

use railhead_contact::{Case, Contact, Error, Friction, Load, Material, Motion};

fn main() -> Result<(), Error> {
    let contact = Contact::radii(460.0, 300.0);
    let creepages = (0..=20).map(|k| 0.0003 * f64::from(k));
    let motions: Vec<Motion> = creepages.map(|x| Motion::creepages(x, 0.0, 0.0)).collect();
    let case = Case::new(Material::steel(), Friction::coulomb(0.3), contact);
    let solution = case
        .load(Load::normal_force(100e3))
        .motion(motions)
        .solve()?;
    for point in &solution.patches[0].points {
        let error = point.error_estimate.map_or(0.0, |error| error.force_x_n);
        println!(
            "{:.4}: {:6.0} N, +-{error:.0} N",
            point.motion.creepage_x, point.force_x_n
        );
    }
    Ok(())
}
