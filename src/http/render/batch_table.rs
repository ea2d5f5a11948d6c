//! Results of a batch as a table: one line per job and motion, or per patch too, with the columns that were asked for.

use std::ops::Range;

use crate::contact::remark::entry::RemarkEntry;
use crate::contact::solution::words::answer::{PatchSolution, PointSolution, Solution};
use crate::http::render::forces::Forces;
use crate::jobs::codec::table::{RowTable, TableColumn, TableKind};
use crate::jobs::model::BatchItem;

/// Columns of a table for which none are named: these, [`Forces::COLUMNS`] and the rest.
const FIRST: [&str; 5] = ["index", "id", "name", "state", "point"];
const LAST: [&str; 6] = [
    "friction_power_n",
    "area_mm2",
    "pressure_max_mpa",
    "target_met",
    "remarks",
    "error",
];

/// What else can be named, besides labels.
const MORE: [&str; 22] = [
    "patch",
    "cached",
    "friction_coefficient",
    "friction_limit_n",
    "friction_power_without_spin_n",
    "traction_max_mpa",
    "stick_share",
    "saturated",
    "contact_angle_rad",
    "rolling_radius_mm",
    "track_y_mm",
    "track_z_mm",
    "force_track_y_n",
    "force_track_z_n",
    "semi_axis_x_mm",
    "semi_axis_y_mm",
    "wheel_lowering_mm",
    "usfd_depth_nm",
    "archard_depth_nm",
    "wlrm_damage",
    "von_mises_max_mpa",
    "temperature_max_c",
];

/// Before the key of a label.
const LABEL: &str = "label:";

/// The columns of a table.
#[derive(Debug, Clone)]
pub(crate) struct Columns(Vec<String>);

impl Columns {
    /// The usual columns, and before `remarks` one for each of these labels.
    #[must_use]
    pub(crate) fn with_labels(keys: &[String]) -> Columns {
        let mut names: Vec<String> = default_names().map(str::to_owned).collect();
        let place = names.iter().position(|name| name == "remarks");
        let place = place.unwrap_or(names.len());
        names.splice(place..place, keys.iter().map(|key| format!("{LABEL}{key}")));
        Columns(names)
    }

    /// Reads names with commas between.
    #[must_use]
    pub(crate) fn read(text: &str) -> Option<Columns> {
        let known = |name: &str| {
            default_names().any(|own| own == name)
                || MORE.contains(&name)
                || name.strip_prefix(LABEL).is_some_and(|key| !key.is_empty())
        };
        let names: Vec<String> = text.split(',').map(str::to_owned).collect();
        names
            .iter()
            .all(|name| known(name))
            .then_some(Columns(names))
    }

    /// The names that there are, in words.
    #[must_use]
    pub(crate) fn allowed() -> String {
        let names: Vec<&str> = default_names().chain(MORE).collect();
        format!(
            "names with commas between, of {} and `label:KEY`",
            names.join(", ")
        )
    }

    /// The names with the kinds of their values.
    pub(crate) fn kinds(&self) -> Vec<(String, TableKind)> {
        let kind = |name: &String| match name.as_str() {
            "index" | "point" | "patch" => TableKind::Integers,
            "id" | "name" | "state" | "cached" | "target_met" | "saturated" | "remarks"
            | "error" => TableKind::Texts,
            name if name.starts_with(LABEL) => TableKind::Texts,
            _ => TableKind::Numbers,
        };
        self.0
            .iter()
            .map(|name| (name.clone(), kind(name)))
            .collect()
    }

    /// A table without rows.
    #[must_use]
    pub(crate) fn empty(&self) -> RowTable {
        let columns = self.kinds().into_iter();
        let columns = columns.map(|(name, kind)| (name, kind.without_values(0)));
        RowTable {
            columns: columns.collect(),
        }
    }

    /// Adds the line of a job without a result, with `error` saying why.
    pub(crate) fn add_without_result(&self, table: &mut RowTable, item: &BatchItem, error: &str) {
        for (name, column) in &mut table.columns {
            match column {
                TableColumn::Integers(values) => values.push(match name.as_str() {
                    "index" => i64::from(item.index),
                    _ => 0,
                }),
                TableColumn::Numbers(values) => values.push(f64::NAN),
                TableColumn::Texts(values) => values.push(match name.as_str() {
                    "error" => Some(error.to_owned()).filter(|error| !error.is_empty()),
                    name => of_job(item, name),
                }),
            }
        }
    }

    /// Adds the lines of these motions of a job.
    pub(crate) fn add(
        &self,
        table: &mut RowTable,
        item: &BatchItem,
        solution: &Solution,
        points: Range<usize>,
    ) {
        let by_patch = self.0.iter().any(|name| name == "patch");
        for point in points {
            let patches: Vec<_> = match by_patch {
                true => (0..solution.patches.len()).map(Some).collect(),
                false => vec![None],
            };
            for patch in patches {
                let line = TableLine {
                    item,
                    solution,
                    point,
                    patch,
                };
                for (name, column) in &mut table.columns {
                    match column {
                        TableColumn::Integers(values) => values.push(line.place_of(name)),
                        TableColumn::Numbers(values) => {
                            values.push(line.number(name).unwrap_or(f64::NAN));
                        }
                        TableColumn::Texts(values) => values.push(line.text(name)),
                    }
                }
            }
        }
    }
}

fn default_names() -> impl Iterator<Item = &'static str> {
    FIRST.into_iter().chain(Forces::COLUMNS).chain(LAST)
}

/// Value of a text column that describes the job.
fn of_job(item: &BatchItem, name: &str) -> Option<String> {
    let job = &item.job;
    match name {
        "id" => Some(job.id.to_string()),
        "name" => job.name.clone(),
        "state" => Some(job.state.name().to_owned()),
        "cached" => Some(job.cached.to_string()),
        _ => job.labels.get(name.strip_prefix(LABEL)?).cloned(),
    }
}

/// One line: a motion of a job, of one patch or of all of them together.
struct TableLine<'a> {
    item: &'a BatchItem,
    solution: &'a Solution,
    point: usize,
    patch: Option<usize>,
}

impl TableLine<'_> {
    fn place_of(&self, name: &str) -> i64 {
        match name {
            "index" => i64::from(self.item.index),
            "point" => self.point as i64,
            _ => self.patch.unwrap_or(0) as i64,
        }
    }

    fn text(&self, name: &str) -> Option<String> {
        match name {
            "remarks" => Some(codes(&self.solution.remarks, self.point, self.patch)),
            "target_met" => self.verdict(|point| point.target_met, false),
            "saturated" => self.verdict(|point| Some(point.saturated), true),
            name => of_job(self.item, name),
        }
    }

    /// The patches of the line, each with the motion of the line.
    fn parts(&self) -> impl Iterator<Item = (&PatchSolution, &PointSolution)> + Clone {
        let patches = self.solution.patches.iter().enumerate();
        let own = patches.filter(|(place, _)| self.patch.is_none_or(|patch| patch == *place));
        own.filter_map(|(_, patch)| Some((patch, patch.points.get(self.point)?)))
    }

    /// True if it is of all patches, or of any of them; nothing where it is not told.
    fn verdict(&self, of: fn(&PointSolution) -> Option<bool>, any: bool) -> Option<String> {
        let mut told = self.parts().filter_map(|(_, point)| of(point)).peekable();
        told.peek()?;
        let verdict = match any {
            true => told.any(|verdict| verdict),
            false => told.all(|verdict| verdict),
        };
        Some(verdict.to_string())
    }

    fn number(&self, name: &str) -> Option<f64> {
        let of_patches = |of: fn(&PatchSolution) -> Option<f64>| {
            self.parts()
                .map(|(patch, _)| of(patch))
                .sum::<Option<f64>>()
        };
        let largest = |of: fn(&(&PatchSolution, &PointSolution)) -> Option<f64>| {
            self.parts().filter_map(|part| of(&part)).reduce(f64::max)
        };
        let of_points = |of: fn(&PointSolution) -> Option<f64>| {
            self.parts()
                .map(|(_, point)| of(point))
                .sum::<Option<f64>>()
        };
        match name {
            "normal_force_n" => of_patches(|patch| Some(patch.normal_force_n)),
            "area_mm2" => of_patches(|patch| Some(patch.area_mm2)),
            "friction_limit_n" => of_patches(|patch| patch.friction_limit_n),
            "pressure_max_mpa" => largest(|(patch, _)| Some(patch.pressure_max_mpa)),
            "traction_max_mpa" => largest(|(_, point)| point.traction_max_mpa),
            "friction_power_n" => of_points(|point| Some(point.friction_power_n)),
            "friction_power_without_spin_n" => {
                of_points(|point| Some(point.friction_power_without_spin_n))
            }
            "stick_share" => {
                let stick = of_points(|point| point.stick_area_mm2)?;
                Some(stick / of_patches(|patch| Some(patch.area_mm2))?)
            }
            "friction_coefficient" => Some(self.solution.asked.as_ref()?.friction_coefficient),
            "wheel_lowering_mm" => self.solution.wheel_lowering_mm,
            "usfd_depth_nm" | "archard_depth_nm" | "wlrm_damage" | "von_mises_max_mpa"
            | "temperature_max_c" => {
                let worst = self.parts().map(|(_, point)| maintenance(point, name));
                worst.reduce(|a, b| Some(a?.max(b?))).flatten()
            }
            _ => self.force(name).or_else(|| self.place(name)),
        }
    }

    /// Motion, forces and their errors.
    fn force(&self, name: &str) -> Option<f64> {
        let first = self.parts().next().map(|(_, point)| point);
        let motion = first.map(|point| point.motion);
        let forces = match self.patch {
            None => Forces::of_total(motion, self.solution.total.get(self.point)?),
            Some(_) => {
                let point = first?;
                Forces {
                    motion,
                    resultants: [point.force_x_n, point.force_y_n, point.moment_z_n_mm],
                    error: point.error_estimate,
                }
            }
        };
        forces.number(name)
    }

    /// Where a patch lies, and its force in track axes; nothing for several patches together.
    fn place(&self, name: &str) -> Option<f64> {
        self.patch
            .or((self.solution.patches.len() == 1).then_some(0))?;
        let (patch, point) = self.parts().next()?;
        if let Some([x, y]) = patch.semi_axes_mm {
            match name {
                "semi_axis_x_mm" => return Some(x),
                "semi_axis_y_mm" => return Some(y),
                _ => {}
            }
        }
        let position = patch.position?;
        match name {
            "contact_angle_rad" => Some(position.contact_angle_rad),
            "rolling_radius_mm" => Some(position.rolling_radius_mm),
            "track_y_mm" => Some(position.track_mm[1]),
            "track_z_mm" => Some(position.track_mm[2]),
            "force_track_y_n" => Some(point.force_track_n?[1]),
            "force_track_z_n" => Some(point.force_track_n?[2]),
            _ => None,
        }
    }
}

/// Damage, stress and temperature of one patch.
fn maintenance(point: &PointSolution, name: &str) -> Option<f64> {
    let damage = point.damage.as_deref();
    match name {
        "usfd_depth_nm" => Some(damage?.usfd_wear?.depth_nm.value),
        "archard_depth_nm" => Some(damage?.archard_wear?.depth_nm.value),
        "wlrm_damage" => Some(damage?.wlrm?.damage_per_pass.value),
        "von_mises_max_mpa" => Some(point.subsurface?.worst?.von_mises_mpa),
        "temperature_max_c" => Some(point.temperature?.max_c),
        _ => None,
    }
}

/// The codes of the remarks that hold for a motion, and for a patch if one is given, each once.
fn codes(remarks: &[RemarkEntry], point: usize, patch: Option<usize>) -> String {
    let mut codes: Vec<&str> = Vec::new();
    for remark in remarks.iter().filter(|remark| remark.holds_at(point)) {
        let elsewhere = patch.is_some() && remark.patch.is_some() && remark.patch != patch;
        if !elsewhere && !codes.contains(&&*remark.code) {
            codes.push(&remark.code);
        }
    }
    codes.join(" ")
}
