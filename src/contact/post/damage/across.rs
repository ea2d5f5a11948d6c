//! Wear strip by strip across a patch: what every line of the surface loses while the contact passes over it.

use crate::contact::case::words::damage::DamageModel;
use crate::contact::post::damage::figures::DamageTask;
use crate::contact::post::damage::models::{archard_coefficient, usfd_rate};
use crate::contact::post::units::{METRES, NANOMETRES};
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::solution::words::damage::WearAcross;

/// The power of every cell over the rolling speed in N, and the size of its slip.
#[derive(Debug, Clone, Copy)]
pub struct CellWear<'a> {
    /// The level.
    pub level: &'a StripMesh,
    /// Tractions times slips and areas, in N.
    pub power: &'a [f64],
    /// Slips over the rolling speed.
    pub slip: &'a [f64],
    /// Rolling speed in mm/s, where it is known.
    pub speed: Option<f64>,
}

/// Wear of the strips of a patch. Segments of one strip are added up.
#[must_use]
pub fn across(task: &DamageTask, of: CellWear, patch: usize) -> WearAcross {
    let figures = &task.figures;
    let mut found = WearAcross::default();
    let (mut usfd, mut archard): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut last = None;
    let mesh = &of.level.mesh;
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        let chord = &segment.chord;
        if last != Some(chord.strip) {
            found.y_mm.push(chord.y);
            found.dy_mm.push(chord.dy);
            found.t_gamma_n_per_mm.push(0.0);
            usfd.push(0.0);
            archard.push(0.0);
            last = Some(chord.strip);
        }
        let place = found.y_mm.len() - 1;
        for i in segment.cells.clone() {
            let length = mesh.right[i] - mesh.left[i];
            found.t_gamma_n_per_mm[place] += of.power[i] / chord.dy;
            let rate = usfd_rate(&figures.usfd, of.power[i] / of.level.area[i]);
            usfd[place] += rate * length * METRES / figures.density * NANOMETRES;
            let pressure = of.level.pressure[i] / figures.hardness;
            let speed = of.slip[i] * of.speed.unwrap_or(0.0);
            let (_, coefficient) = archard_coefficient(&figures.archard, speed, pressure);
            archard[place] += coefficient.value * pressure * of.slip[i] * length * NANOMETRES;
        }
    }
    found.usfd_depth_nm = task.wants(DamageModel::UsfdWear).then_some(usfd);
    found.archard_depth_nm = task.wants(DamageModel::ArchardWear).then_some(archard);
    found
}
