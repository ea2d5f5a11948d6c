//! What the columns of rows are called: a JSON pointer, a short name or a name with a unit varies the case, any other name is carried along to the
//! answers. A client may say what a column is whose title does not.

use std::f64::consts::PI;

use crate::http::extract::batch::table::short_pointer;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::run::head::RunColumn;

pub(super) fn faulty(detail: impl Into<String>) -> ApiError {
    ApiError::new(ProblemKind::FaultyTable, detail)
}

/// Units of a quantity by their names in brackets and at the end of a title, and what makes a value one of the case.
type Units = &'static [(&'static str, &'static str, f64)];

const FORCE: Units = &[("N", "n", 1.0), ("kN", "kn", 1e3)];
const LENGTH: Units = &[("mm", "mm", 1.0), ("m", "m", 1e3), ("cm", "cm", 10.0)];
const CURVATURE: Units = &[
    ("1/mm", "per_mm", 1.0),
    ("1/m", "per_m", 1e-3),
    ("rad/mm", "rad_per_mm", 1.0),
    ("rad/m", "rad_per_m", 1e-3),
];
const ANGLE: Units = &[
    ("rad", "rad", 1.0),
    ("mrad", "mrad", 1e-3),
    ("deg", "deg", PI / 180.0),
    ("°", "degrees", PI / 180.0),
];
const SPEED: Units = &[
    ("mm/s", "mm_per_s", 1.0),
    ("m/s", "m_per_s", 1e3),
    ("km/h", "km_per_h", 1e3 / 3.6),
];
const RATIO: Units = &[("-", "", 1.0), ("1", "", 1.0), ("%", "percent", 1e-2)];

/// Names that simulations give the quantities of a case, where they stand in it, and their units.
const QUANTITIES: [(&[&str], &str, Units); 12] = [
    (&["normal_force"], "/load/normal_force_n", FORCE),
    (
        &["vertical_force", "wheel_load"],
        "/load/vertical_force_n",
        FORCE,
    ),
    (
        &["creepage_x", "longitudinal_creepage"],
        "/motion/creepage_x",
        RATIO,
    ),
    (
        &["creepage_y", "lateral_creepage"],
        "/motion/creepage_y",
        RATIO,
    ),
    (&["spin", "spin_creepage"], "/motion/spin_per_mm", CURVATURE),
    (&["force_x"], "/motion/force_x_n", FORCE),
    (&["force_y"], "/motion/force_y_n", FORCE),
    (
        &["friction_coefficient", "friction", "mu"],
        "/friction/coefficient",
        RATIO,
    ),
    (&["speed", "rolling_speed"], "/motion/speed_mm_per_s", SPEED),
    (
        &["lateral_shift", "lateral_displacement"],
        "/contact/lateral_shift_mm",
        LENGTH,
    ),
    (&["yaw", "yaw_angle"], "/contact/yaw_rad", ANGLE),
    (&["roll", "roll_angle"], "/contact/roll_rad", ANGLE),
];

/// Units of what is carried along, as a line of units below the titles may name them.
const OTHER_UNITS: [&str; 6] = ["s", "ms", "h", "km", "Hz", "m/s²"];

/// Columns that a client named: the title of each, and what it is.
#[derive(Debug, Clone, Default)]
pub struct NamedColumns(pub Vec<(String, String)>);

impl NamedColumns {
    /// The column of this title; `unit` is what stands below it, if there is a line of units.
    ///
    /// # Errors
    /// `faulty-table`: the title names a quantity with a unit that it does not have, or without one; or the client named it so.
    pub(super) fn column(
        &self,
        title: &str,
        unit: Option<&str>,
        text: bool,
    ) -> Result<RunColumn, ApiError> {
        let named = self.0.iter().find(|(name, _)| name == title);
        let place = match named {
            // Carried along, whatever it is called.
            Some((_, what)) if what.is_empty() => Ok(None),
            Some((_, what)) => place(what, None).and_then(|place| {
                let unknown = || {
                    let known = QUANTITIES.iter().map(|(names, ..)| names[0]);
                    let known: Vec<&str> = known.collect();
                    format!(
                        "`{what}` is named in `column`, which is no place in a case; allowed: a JSON pointer, a short name, or one of {} with a unit",
                        known.join(", ")
                    )
                };
                place.map(Some).ok_or_else(unknown)
            }),
            None => place(title, unit),
        };
        let place = place.map_err(|detail| faulty(format!("column `{title}`: {detail}")))?;
        Ok(RunColumn {
            name: title.to_owned(),
            pointer: place.as_ref().map(|(pointer, _)| pointer.clone()),
            factor: place.map_or(1.0, |(_, factor)| factor),
            text,
        })
    }

    /// The columns of these titles; a title that was named has to be among them.
    ///
    /// # Errors
    /// As [`NamedColumns::column`].
    pub(super) fn columns<'a>(
        &self,
        titles: impl Iterator<Item = (&'a str, bool)>,
    ) -> Result<Vec<RunColumn>, ApiError> {
        let columns: Vec<RunColumn> = titles
            .map(|(title, text)| self.column(title, None, text))
            .collect::<Result<_, _>>()?;
        self.all_among(&columns)?;
        Ok(columns)
    }

    /// Every title that was named is that of a column, and was named once.
    ///
    /// # Errors
    /// `faulty-table`: one is not.
    pub(super) fn all_among(&self, columns: &[RunColumn]) -> Result<(), ApiError> {
        let titles = || self.0.iter().map(|(title, _)| title);
        if let Some(twice) = titles().enumerate().find_map(|(place, title)| {
            titles()
                .take(place)
                .any(|other| other == title)
                .then_some(title)
        }) {
            return Err(faulty(format!("`column` names `{twice}` twice")));
        }
        let missing = |title: &String| columns.iter().all(|column| column.name != *title);
        match self.0.iter().find(|(title, _)| missing(title)) {
            None => Ok(()),
            Some((title, _)) => {
                let titles: Vec<&str> = columns.iter().map(|column| &*column.name).collect();
                Err(faulty(format!(
                    "`column` names `{title}`, which is no title of the table; its titles: {}",
                    titles.join(", ")
                )))
            }
        }
    }
}

/// Reads `TITLE:NAME` of the query; the title may contain colons.
#[must_use]
pub fn named_column(text: &str) -> Option<(String, String)> {
    let (title, what) = text.rsplit_once(':')?;
    (!title.is_empty()).then(|| (title.trim().to_owned(), what.trim().to_owned()))
}

/// Could this be a unit in a line of units?
pub(super) fn is_unit(text: &str) -> bool {
    let bare = bracketed(text).map_or(text, |(_, unit)| unit);
    let known = QUANTITIES.iter().flat_map(|(_, _, units)| *units);
    bare != text
        || text.is_empty()
        || known
            .map(|(unit, ..)| *unit)
            .any(|unit| unit == bare && unit != "1")
        || OTHER_UNITS.contains(&bare)
}

/// Where a title stands in the case, and what makes its values those of the case; nothing if it is no quantity of a case.
fn place(title: &str, below: Option<&str>) -> Result<Option<(String, f64)>, String> {
    if title.starts_with('/') {
        return Ok(Some((title.to_owned(), 1.0)));
    }
    if let Some(pointer) = short_pointer(title) {
        return Ok(Some((pointer.to_owned(), 1.0)));
    }
    let (stem, in_title) = match bracketed(title) {
        Some((stem, unit)) => (stem, Some(unit)),
        None => (title, None),
    };
    let below = below.filter(|unit| !unit.is_empty());
    let below = below.map(|unit| bracketed(unit).map_or(unit, |(_, unit)| unit));
    let stem = stem.trim().to_lowercase().replace([' ', '-', '.'], "_");
    for (names, pointer, units) in &QUANTITIES {
        for name in *names {
            let Some(rest) = stem.strip_prefix(name) else {
                continue;
            };
            let suffix = rest.strip_prefix('_');
            let unit = match (rest, in_title.or(below)) {
                ("", Some(unit)) => units.iter().find(|(known, ..)| *known == unit),
                // A ratio without a unit is a number.
                ("", None) => units.iter().find(|(_, suffix, _)| suffix.is_empty()),
                _ => units.iter().find(|(_, known, _)| Some(*known) == suffix),
            };
            match unit {
                Some((.., factor)) => return Ok(Some(((*pointer).to_owned(), *factor))),
                None if rest.is_empty() => {
                    let known: Vec<&str> = units.iter().map(|(unit, ..)| *unit).collect();
                    let given = match in_title.or(below) {
                        Some(unit) => format!("has the unit `{unit}`"),
                        None => "has no unit".to_owned(),
                    };
                    return Err(format!(
                        "{given}; allowed as in `{name} [{}]`: {}; with `?column={title}:` the column is carried along to the answers",
                        known[known.len() - 1],
                        known.join(", ")
                    ));
                }
                // Such as `spin_axis_mm`: another quantity.
                None => {}
            }
        }
    }
    Ok(None)
}

/// A title and the unit in brackets at its end.
fn bracketed(title: &str) -> Option<(&str, &str)> {
    let title = title.trim();
    let (open, rest) = match title.strip_suffix(']') {
        Some(rest) => ('[', rest),
        None => ('(', title.strip_suffix(')')?),
    };
    let (stem, unit) = rest.rsplit_once(open)?;
    Some((stem, unit.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(title: &str, unit: Option<&str>) -> Result<Option<(String, f64)>, String> {
        let column = NamedColumns::default().column(title, unit, false);
        let column = column.map_err(|error| format!("{error:?}"))?;
        Ok(column.pointer.map(|pointer| (pointer, column.factor)))
    }

    #[test]
    fn titles_with_units_are_places_and_factors() {
        for (title, unit, place, factor) in [
            ("normal_force_n", None, "/load/normal_force_n", 1.0),
            ("Normal force [kN]", None, "/load/normal_force_n", 1e3),
            ("wheel_load (kN)", None, "/load/vertical_force_n", 1e3),
            ("normal_force_kn", None, "/load/normal_force_n", 1e3),
            ("Longitudinal creepage", None, "/motion/creepage_x", 1.0),
            ("lateral creepage [%]", None, "/motion/creepage_y", 1e-2),
            ("spin [1/m]", None, "/motion/spin_per_mm", 1e-3),
            ("spin", Some("[rad/m]"), "/motion/spin_per_mm", 1e-3),
            ("spin_per_m", None, "/motion/spin_per_mm", 1e-3),
            ("speed", Some("km/h"), "/motion/speed_mm_per_s", 1e3 / 3.6),
            ("yaw [mrad]", None, "/contact/yaw_rad", 1e-3),
            (
                "lateral_displacement [m]",
                None,
                "/contact/lateral_shift_mm",
                1e3,
            ),
            ("mu", None, "/friction/coefficient", 1.0),
        ] {
            let expected = Some((place.to_owned(), factor));
            assert_eq!(read(title, unit), Ok(expected), "{title} {unit:?}");
        }
        for carried in [
            "time [s]",
            "km",
            "curvature [1/m]",
            "speed_limit",
            "rolling_noise",
            "Q",
        ] {
            assert_eq!(read(carried, None), Ok(None), "{carried}");
        }
    }

    #[test]
    fn a_quantity_without_its_unit_is_refused() {
        for (title, unit, word) in [
            ("spin", None, "has no unit"),
            ("Normal force", None, "kN"),
            ("yaw [grad]", None, "`grad`"),
            ("lateral_shift", Some("s"), "`s`"),
        ] {
            let refused = read(title, unit).expect_err(title);
            assert!(refused.contains(word), "{refused}");
        }
    }

    #[test]
    fn a_client_says_what_a_column_is() {
        let named = [
            "Q.left:vertical_force [kN]",
            "ny: creepage_y",
            "spin:",
            "t:x:/motion/creepage_x",
        ];
        let named = NamedColumns(named.iter().filter_map(|text| named_column(text)).collect());
        let of = |title: &str| {
            let column = named.column(title, None, false).expect("a column");
            (column.pointer, column.factor)
        };
        assert_eq!(
            of("Q.left"),
            (Some("/load/vertical_force_n".to_owned()), 1e3)
        );
        assert_eq!(of("ny"), (Some("/motion/creepage_y".to_owned()), 1.0));
        assert_eq!(of("spin"), (None, 1.0));
        assert_eq!(of("t:x"), (Some("/motion/creepage_x".to_owned()), 1.0));
        let wrong = NamedColumns(vec![("a".to_owned(), "load".to_owned())]);
        assert!(wrong.column("a", None, false).is_err());
        let twice = ["a:creepage_x", "a:creepage_y"]
            .into_iter()
            .filter_map(named_column);
        let twice = NamedColumns(twice.collect()).columns(std::iter::once(("a", false)));
        assert!(format!("{twice:?}").contains("twice"));
        assert!(
            named
                .columns(["ny"].into_iter().map(|title| (title, false)))
                .is_err()
        );
    }
}
