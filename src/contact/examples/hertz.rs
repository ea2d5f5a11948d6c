//! A steel wheel of radius 460 mm on a rail crown of radius 300 mm, under 100 kN, with longitudinal creepage and spin.
#![allow(clippy::print_stdout, reason = "an example shows its result")]

use railhead_contact::{Case, Contact, Error, Friction, Load, Material, Motion};

fn main() -> Result<(), Error> {
    let contact = Contact::radii(460.0, 300.0);
    let solution = Case::new(Material::steel(), Friction::coulomb(0.3), contact)
        .load(Load::normal_force(100e3))
        .motion(Motion::creepages(0.001, 0.0, 0.0001))
        .solve()?;
    let patch = &solution.patches[0];
    println!(
        "{:.1} mm2, {:.0} MPa",
        patch.area_mm2, patch.pressure_max_mpa
    );
    println!(
        "{:.0} N along, {:.0} N across",
        patch.points[0].force_x_n, patch.points[0].force_y_n
    );
    Ok(())
}
