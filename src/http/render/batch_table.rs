//! Results of a batch as a table, with a row per job and motion, or per job, motion and patch.

use std::collections::HashSet;

use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::answer::{
    ErrorEstimate, PatchPoint, PointSolution, Solution,
};
use railhead_jobs::model::BatchItem;
use railhead_tables::table::{RowTable, TableColumn, TableKind};

/// Returns the value of a column in a row.
#[derive(Debug, Clone, Copy)]
enum Of {
    Place(fn(&TableLine<'_>) -> i64),
    Number(fn(&TableLine<'_>) -> Option<f64>),
    Text(fn(&TableLine<'_>) -> Option<String>),
    /// The label whose key follows [`LABEL`] in the name.
    Label,
}

/// Number of the default columns.
const USUAL: usize = 21;

macro_rules! columns {
    ($($name:literal $of:ident $value:expr;)*) => {
        [$(($name, Of::$of($value))),*]
    };
}

/// All columns except labels, the default ones first.
const COLUMNS: [(&str, Of); 43] = columns! {
    "index" Place |line| line.item.index.into();
    "id" Text |line| Some(line.item.job.id.to_string());
    "name" Text |line| line.item.job.name.clone();
    "state" Text |line| Some(line.item.job.state.name().into());
    "point" Place |line| line.point as i64;
    "creepage_x" Number |line| Some(line.parts().next()?.point.motion.creepage_x);
    "creepage_y" Number |line| Some(line.parts().next()?.point.motion.creepage_y);
    "spin_per_mm" Number |line| Some(line.parts().next()?.point.motion.spin_per_mm);
    "normal_force_n" Number |line| line.sum(|part| Some(part.region.normal_force_n));
    "force_x_n" Number |line| Some(line.forces()?.0[0]);
    "force_y_n" Number |line| Some(line.forces()?.0[1]);
    "moment_z_n_mm" Number |line| Some(line.forces()?.0[2]);
    "error_force_x_n" Number |line| Some(line.forces()?.1?.force_x_n);
    "error_force_y_n" Number |line| Some(line.forces()?.1?.force_y_n);
    "error_moment_z_n_mm" Number |line| Some(line.forces()?.1?.moment_z_n_mm);
    "friction_power_n" Number |line| line.sum(|part| Some(part.point.friction_power_n));
    "area_mm2" Number |line| line.sum(|part| Some(part.region.area_mm2));
    "pressure_max_mpa" Number |line| line.largest(|part| Some(part.region.pressure_max_mpa));
    "target_met" Text |line| line.verdict(|point| point.target_met, false);
    "remarks" Text |line| line.solution.map(|_| line.codes());
    "error" Text |line| Some(line.error.to_owned()).filter(|error| !error.is_empty());
    "patch" Place |line| line.patch.unwrap_or(0) as i64;
    "cached" Text |line| Some(line.item.job.cached.to_string());
    "friction_coefficient" Number |line| Some(line.solution?.asked.as_ref()?.friction_coefficient);
    "friction_limit_n" Number |line| line.sum(|part| part.region.friction_limit_n);
    "friction_power_without_spin_n" Number |line| line.sum(|part| Some(part.point.friction_power_without_spin_n));
    "traction_max_mpa" Number |line| line.largest(|part| part.point.traction_max_mpa);
    "stick_share" Number |line| { Some(line.sum(|part| part.point.stick_area_mm2)? / line.sum(|part| Some(part.region.area_mm2))?) };
    "saturated" Text |line| line.verdict(|point| Some(point.saturated), true);
    "contact_angle_rad" Number |line| line.of_one(|part| Some(part.patch.position?.contact_angle_rad));
    "rolling_radius_mm" Number |line| line.of_one(|part| Some(part.patch.position?.rolling_radius_mm));
    "track_y_mm" Number |line| line.of_one(|part| Some(part.patch.position?.track_mm[1]));
    "track_z_mm" Number |line| line.of_one(|part| Some(part.patch.position?.track_mm[2]));
    "force_track_y_n" Number |line| line.of_one(|part| Some(part.point.force_track_n?[1]));
    "force_track_z_n" Number |line| line.of_one(|part| Some(part.point.force_track_n?[2]));
    "semi_axis_x_mm" Number |line| line.of_one(|part| Some(part.patch.semi_axes_mm?[0]));
    "semi_axis_y_mm" Number |line| line.of_one(|part| Some(part.patch.semi_axes_mm?[1]));
    "wheel_lowering_mm" Number |line| line.solution?.wheel_lowering_mm;
    "usfd_depth_nm" Number |line| line.worst(|point| Some(point.damage.as_deref()?.usfd_wear?.depth_nm.value));
    "archard_depth_nm" Number |line| line.worst(|point| Some(point.damage.as_deref()?.archard_wear?.depth_nm.value));
    "wlrm_damage" Number |line| line.worst(|point| Some(point.damage.as_deref()?.wlrm?.damage_per_pass.value));
    "von_mises_max_mpa" Number |line| line.worst(|point| Some(point.subsurface?.worst?.von_mises_mpa));
    "temperature_max_c" Number |line| line.worst(|point| Some(point.temperature?.max_c));
};

/// Prefix of the column of a label.
const LABEL: &str = "label:";

/// The columns of a table.
#[derive(Debug, Clone)]
pub(crate) struct Columns(Vec<(String, Of)>);

impl Columns {
    /// Returns the default columns, with the columns of these labels before `remarks`.
    #[must_use]
    pub(crate) fn with_labels(keys: &[String]) -> Columns {
        let usual = COLUMNS[..USUAL].iter();
        let mut columns: Vec<_> = usual.map(|(name, of)| ((*name).to_owned(), *of)).collect();
        let place = columns.iter().position(|(name, _)| name == "remarks");
        let place = place.unwrap_or(columns.len());
        let labels = keys.iter().map(|key| (format!("{LABEL}{key}"), Of::Label));
        columns.splice(place..place, labels);
        Columns(columns)
    }

    /// Parses a comma-separated list of names.
    #[must_use]
    pub(crate) fn read(text: &str) -> Option<Columns> {
        let column = |name: &str| {
            let label = name.strip_prefix(LABEL).filter(|key| !key.is_empty());
            let known = COLUMNS.iter().find(|(known, _)| *known == name);
            let of = label.map(|_| Of::Label).or(known.map(|(_, of)| *of))?;
            Some((name.to_owned(), of))
        };
        let mut columns: Vec<(String, Of)> = text.split(',').map(column).collect::<Option<_>>()?;
        let mut seen = HashSet::new();
        columns.retain(|(name, _)| seen.insert(name.clone()));
        Some(Columns(columns))
    }

    /// Returns a description of the allowed names.
    #[must_use]
    pub(crate) fn allowed() -> String {
        let names = COLUMNS.map(|(name, _)| name).join(", ");
        format!("comma-separated names, of {names} and `label:KEY`")
    }

    /// Returns the names of the columns with the kinds of their values.
    pub(crate) fn kinds(&self) -> Vec<(String, TableKind)> {
        let columns = self.0.iter().map(|(name, of)| {
            let kind = match of {
                Of::Place(_) => TableKind::Integers,
                Of::Number(_) => TableKind::Numbers,
                Of::Text(_) | Of::Label => TableKind::Texts,
            };
            (name.clone(), kind)
        });
        columns.collect()
    }

    /// Returns a table without rows.
    #[must_use]
    pub(crate) fn empty(&self) -> RowTable {
        let columns = self.kinds().into_iter();
        let columns = columns.map(|(name, kind)| (name, kind.without_values(0)));
        RowTable {
            columns: columns.collect(),
        }
    }

    /// Adds the row of a job without a result; `error` is the reason.
    pub(crate) fn add_without_result(&self, table: &mut RowTable, item: &BatchItem, error: &str) {
        self.add_line(
            table,
            &TableLine {
                item,
                solution: None,
                point: 0,
                patch: None,
                error,
            },
        );
    }

    /// Adds the rows of the motions of a job.
    pub(crate) fn add(&self, table: &mut RowTable, item: &BatchItem, solution: &Solution) {
        let by_patch = self.0.iter().any(|(name, _)| name == "patch");
        for point in 0..solution.total.len() {
            let patches: Vec<_> = match by_patch {
                true => solution.at(point).map(|part| Some(part.number)).collect(),
                false => vec![None],
            };
            for patch in patches {
                let line = TableLine {
                    item,
                    solution: Some(solution),
                    point,
                    patch,
                    error: "",
                };
                self.add_line(table, &line);
            }
        }
    }

    fn add_line(&self, table: &mut RowTable, line: &TableLine<'_>) {
        for ((name, of), (_, column)) in self.0.iter().zip(&mut table.columns) {
            match (of, column) {
                (Of::Place(of), TableColumn::Integers(values)) => values.push(of(line)),
                (Of::Number(of), TableColumn::Numbers(values)) => {
                    values.push(of(line).unwrap_or(f64::NAN));
                }
                (Of::Text(of), TableColumn::Texts(values)) => values.push(of(line)),
                (Of::Label, TableColumn::Texts(values)) => {
                    let key = name.strip_prefix(LABEL).unwrap_or_default();
                    values.push(line.item.job.labels.get(key).cloned());
                }
                _ => unreachable!("the table has the kinds of these columns"),
            }
        }
    }
}

/// A row: a motion of a job, for one patch or for all patches together, or a job without a result.
struct TableLine<'a> {
    item: &'a BatchItem,
    solution: Option<&'a Solution>,
    point: usize,
    patch: Option<usize>,
    error: &'a str,
}

/// Returns a number of a patch for the motion of the row.
type OfPart = fn(&PatchPoint<'_>) -> Option<f64>;

impl TableLine<'_> {
    /// Returns the patches of the row, with its motion.
    fn parts(&self) -> impl Iterator<Item = PatchPoint<'_>> + Clone {
        let parts = self
            .solution
            .into_iter()
            .flat_map(|found| found.at(self.point));
        parts.filter(|part| self.patch.is_none_or(|patch| patch == part.number))
    }

    /// Whether `of` holds for all patches, or for any patch; `None` if no patch has the value.
    fn verdict(&self, of: fn(&PointSolution) -> Option<bool>, any: bool) -> Option<String> {
        let verdicts = self.parts().filter_map(|part| of(part.point));
        let verdict = verdicts.reduce(|a, b| if any { a || b } else { a && b })?;
        Some(verdict.to_string())
    }

    fn sum(&self, of: OfPart) -> Option<f64> {
        self.solution?;
        self.parts().map(|part| of(&part)).sum()
    }

    fn largest(&self, of: OfPart) -> Option<f64> {
        let values = self.parts().filter_map(|part| of(&part));
        values.reduce(f64::max)
    }

    /// Returns the largest value; `None` unless every patch has one.
    fn worst(&self, of: fn(&PointSolution) -> Option<f64>) -> Option<f64> {
        let values = self.parts().map(|part| of(part.point));
        values.reduce(|a, b| Some(a?.max(b?))).flatten()
    }

    /// Returns the value of the only patch; `None` for several patches together.
    fn of_one(&self, of: OfPart) -> Option<f64> {
        let mut parts = self.parts();
        let part = parts.next()?;
        of(&part).filter(|_| parts.next().is_none())
    }

    /// Returns longitudinal and lateral force in N, moment in N·mm, and their errors.
    fn forces(&self) -> Option<([f64; 3], Option<ErrorEstimate>)> {
        if self.patch.is_some() {
            let point = self.parts().next()?.point;
            let forces = [point.force_x_n, point.force_y_n, point.moment_z_n_mm];
            return Some((forces, point.error_estimate));
        }
        let total = self.solution?.total.get(self.point)?;
        let forces = [total.force_x_n, total.force_y_n, total.moment_z_n_mm];
        Some((forces, total.error_estimate))
    }

    /// Returns the codes of the remarks about the row, each once.
    fn codes(&self) -> String {
        let remarks = self.solution.into_iter().flat_map(|found| &found.remarks);
        RemarkEntry::codes(remarks.filter(|remark| {
            let is_part = |patch| self.parts().any(|part| part.number == patch);
            remark.patch.is_none_or(is_part) && remark.holds_at(self.point)
        }))
    }
}
