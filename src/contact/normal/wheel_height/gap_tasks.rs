//! The gaps under a wheel at rest, each under the load that it carries there.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::local_gap::{GapSampling, LocalGap};
use crate::contact::normal::gap::preview::PreviewCache;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::NormalLoad;
use crate::contact::normal::wheel_height::lowered::depth;
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};

impl WheelTask {
    /// The gap of every contact of a wheel at rest in the axes of that contact, from its first touch and under its normal force.
    ///
    /// # Errors
    /// A sentence, if an overlap reaches the end of a profile.
    pub(crate) fn gap_tasks(
        &self,
        search: &ContactLocus,
        wheel: &WheelContact,
    ) -> Result<Vec<GapTask>, String> {
        let gaps = search.gaps(wheel.lowering, GapSampling::Fine)?;
        let apart =
            |gap: &LocalGap, contact: &GapContact| (gap.frame.rail - contact.frame.rail).abs();
        let of_contact = |contact: &GapContact| {
            let nearest = gaps
                .iter()
                .min_by(|a, b| apart(a, contact).total_cmp(&apart(b, contact)));
            nearest.map(|gap| self.gap_task(gap, contact))
        };
        let tasks: Option<Vec<GapTask>> = wheel.patches.iter().map(of_contact).collect();
        tasks.ok_or_else(|| "wheel and rail do not overlap at this height of the wheel".to_owned())
    }

    fn gap_task(&self, gap: &LocalGap, contact: &GapContact) -> GapTask {
        let from = [1, 2].map(|k| contact.frame.origin[k]);
        let along = contact.frame.origin[0] - gap.frame.origin[0];
        let [across, _] = gap.frame.plane().across(from);
        let moved = |axis: &[f64], by: f64| axis.iter().map(|at| at - by).collect::<Vec<f64>>();
        let depth = depth(gap);
        let rows = gap.gap.iter();
        let above: Vec<Vec<f64>> = rows
            .map(|row| row.iter().map(|height| height + depth).collect())
            .collect();
        GapTask {
            gap: GapSurface::grid(&moved(&gap.x, along), &moved(&gap.y, across), &above),
            loading: NormalLoad::Force(contact.normal_force()),
            contact_modulus: self.contact_modulus,
            seen: PreviewCache::default(),
        }
    }
}
