//! Wear strip by strip across a patch: what every line of the surface loses while the contact passes over it.

use crate::contact::case::words::damage::DamageModel;
use crate::contact::post::damage::figures::DamageTask;
use crate::contact::post::damage::models::{archard_coefficient, usfd_rate, usfd_regime};
use crate::contact::post::units::{METRES, NANOMETRES};
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::solution::words::damage::{WearAcross, WearRegime};

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
    let (mut usfd, mut archard): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
    let mut last = None;
    let mesh = &of.level.mesh;
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        let chord = &segment.chord;
        if last != Some(chord.strip) {
            found.y_mm.push(chord.y);
            found.dy_mm.push(chord.dy);
            found.t_gamma_n_per_mm.push(0.0);
            usfd.push([0.0; 3]);
            archard.push([0.0; 3]);
            last = Some(chord.strip);
        }
        let place = found.y_mm.len() - 1;
        for i in segment.cells.clone() {
            let length = mesh.right[i] - mesh.left[i];
            found.t_gamma_n_per_mm[place] += of.power[i] / chord.dy;
            let over_area = of.power[i] / of.level.area[i];
            let rate = usfd_rate(&figures.usfd, over_area);
            usfd[place][regime(usfd_regime(&figures.usfd, over_area))] +=
                rate * length * METRES / figures.density * NANOMETRES;
            let pressure = of.level.pressure[i] / figures.hardness;
            let speed = of.slip[i] * of.speed.unwrap_or(0.0);
            let (of_archard, coefficient) = archard_coefficient(&figures.archard, speed, pressure);
            archard[place][regime(of_archard)] +=
                coefficient.value * pressure * of.slip[i] * length * NANOMETRES;
        }
    }
    let sums = |parts: &[[f64; 3]]| parts.iter().map(|parts| parts.iter().sum()).collect();
    if task.wants(DamageModel::UsfdWear) {
        found.usfd_depth_nm = Some(sums(&usfd));
        found.usfd_regimes_nm = Some(usfd);
    }
    if task.wants(DamageModel::ArchardWear) {
        found.archard_depth_nm = Some(sums(&archard));
        found.archard_regimes_nm = Some(archard);
    }
    found
}

/// Place of a regime among mild, severe, and catastrophic or seizure.
fn regime(regime: WearRegime) -> usize {
    match regime {
        WearRegime::Mild => 0,
        WearRegime::Severe => 1,
        WearRegime::Catastrophic | WearRegime::Seizure => 2,
    }
}
