//! An S1002 wheel on a 60E1 rail under 75 kN, shifted toward the flange, rolling freely at 20 m/s.
#![allow(clippy::print_stdout, reason = "an example shows its result")]

use railhead_contact::{
    Case, Contact, CrossSection, Error, Format, Friction, Load, Material, Side, Wheelset,
};

fn main() -> Result<(), Error> {
    let rail = CrossSection::text(Format::Columns, include_str!("60e1.txt"));
    let wheel = CrossSection::text(Format::Columns, include_str!("s1002.txt"));
    let mut contact = Contact::profiles(rail, wheel, Side::Right, 460.0);
    if let Contact::Profiles {
        cant_rad,
        lateral_shift_mm,
        ..
    } = &mut contact
    {
        (*cant_rad, *lateral_shift_mm) = (0.025, -5.0);
    }
    let case = Case::new(Material::steel(), Friction::coulomb(0.3), contact);
    let solution = case
        .load(Load::vertical_force(75e3))
        .motion(Wheelset::rolling_freely(20e3, 460.0))
        .solve()?;
    for patch in &solution.patches {
        let [y, z] = patch
            .position
            .map_or([f64::NAN; 2], |position| position.rail_mm);
        println!(
            "rail y {y:.1}, z {z:.1} mm: {:.0} N, {:.0} MPa",
            patch.normal_force_n, patch.pressure_max_mpa
        );
    }
    println!(
        "{:.0} N along, {:.0} N across",
        solution.total[0].force_x_n, solution.total[0].force_y_n
    );
    Ok(())
}
