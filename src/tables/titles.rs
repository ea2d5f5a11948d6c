//! Titles of columns: JSON pointers, short names of members, quantities with a unit, and names whose columns are copied to the results.
//!
//! Batches, runs, evolutions and `/v1/evaluate` use this module, so that a title has the same meaning in all of them.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::{Result, TableError, faulty};
use crate::table::{COLUMNS_MAX, TableKind, Title};

/// Most faulty columns and recognised columns that the detail of a refusal names; `errors` has all faulty ones.
const NAMED_MAX: usize = 20;
/// Largest Levenshtein distance between a title and the name that it may be a misspelling of.
const MISSPELT_LETTERS: usize = 2;
/// Shortest name that a misspelt title is compared with.
const MISSPELT_LENGTH: usize = 5;

/// Refuses a table with more than [`COLUMNS_MAX`] columns.
///
/// # Errors
/// `faulty-table`
pub fn require_few(columns: usize) -> Result<()> {
    if columns <= COLUMNS_MAX {
        return Ok(());
    }
    Err(faulty(format!(
        "the table has {columns} columns; allowed: at most {COLUMNS_MAX}"
    )))
}

/// A column with the meaning of its title.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TitledColumn {
    /// The title as sent, which is also the name of a copied column in the results.
    pub name: String,
    /// JSON pointer to the member of the case that the column varies; `None` if it is copied to the results.
    pub pointer: Option<String>,
    /// Factor from the unit of the column to that of the case.
    #[serde(default = "one")]
    pub factor: f64,
    /// The unit in the title or in a line of units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Whether the column holds texts; otherwise it holds numbers.
    pub text: bool,
}

/// Returns a number times the factor of its unit, rounded to 15 digits, so that 64.1 kN are 64100 N.
#[must_use]
pub fn converted(number: f64, factor: f64) -> f64 {
    if factor == 1.0 {
        return number;
    }
    let number = factor * number;
    format!("{number:.14e}").parse().unwrap_or(number)
}

fn one() -> f64 {
    1.0
}

impl TitledColumn {
    /// Converts a number of the column to the unit of the case.
    #[must_use]
    pub fn in_case(&self, number: f64) -> f64 {
        converted(number, self.factor)
    }

    /// The kind of its values.
    #[must_use]
    pub fn kind(&self) -> TableKind {
        match self.text {
            true => TableKind::Texts,
            false => TableKind::Numbers,
        }
    }
}

/// The units of a quantity.
#[derive(Debug)]
struct Units {
    /// Symbol in brackets, suffix of a title, and factor to the unit of the case.
    list: &'static [(&'static str, &'static str, f64)],
    /// The unit that messages suggest.
    usual: &'static str,
}

macro_rules! units {
    ($($name:ident $usual:literal: $($unit:literal $end:literal $factor:expr),+;)*) => {
        $(const $name: Units = Units { list: &[$(($unit, $end, $factor)),+], usual: $usual };)*
    };
}
// Name, usual unit, then symbol, suffix and factor of each unit.
units! {
    FORCE "kN": "N" "n" 1.0, "kN" "kn" 1e3;
    LENGTH "mm": "mm" "mm" 1.0, "m" "m" 1e3, "cm" "cm" 10.0, "µm" "um" 1e-3, "μm" "um" 1e-3, "um" "um" 1e-3;
    CURVATURE "1/m": "1/mm" "per_mm" 1.0, "1/m" "per_m" 1e-3, "rad/mm" "rad_per_mm" 1.0, "rad/m" "rad_per_m" 1e-3;
    ANGLE "mrad": "rad" "rad" 1.0, "mrad" "mrad" 1e-3, "deg" "deg" (PI / 180.0), "°" "degrees" (PI / 180.0);
    SPEED "km/h": "mm/s" "mm_per_s" 1.0, "m/s" "m_per_s" 1e3, "km/h" "km_per_h" (1e3 / 3.6);
    RATIO "-": "-" "" 1.0, "1" "" 1.0, "%" "percent" 1e-2, "pct" "pct" 1e-2, "‰" "permille" 1e-3;
    PRESSURE "MPa": "MPa" "mpa" 1.0, "N/mm²" "n_per_mm2" 1.0;
    TORQUE "N·mm": "N·mm" "n_mm" 1.0, "Nmm" "n_mm" 1.0, "N mm" "n_mm" 1.0;
    ANGULAR_SPEED "rad/s": "rad/s" "rad_per_s" 1.0, "1/s" "per_s" 1.0;
    TEMPERATURE "°C": "°C" "c" 1.0, "C" "c" 1.0, "degC" "c" 1.0;
    TIME "s": "s" "s" 1.0;
}

/// Suffixes of names of members and the units of these members; a longer suffix precedes those that it ends in.
const MEMBER_UNITS: [(&str, &Units); 10] = [
    ("spin_per_mm", &CURVATURE),
    ("_mm_per_s", &SPEED),
    ("_rad_per_s", &ANGULAR_SPEED),
    ("_n_mm", &TORQUE),
    ("_mpa", &PRESSURE),
    ("_rad", &ANGLE),
    ("_mm", &LENGTH),
    ("_n", &FORCE),
    ("_c", &TEMPERATURE),
    ("_s", &TIME),
];

/// A quantity that columns can vary. Names in a list are separated by spaces.
#[derive(Debug)]
struct Quantity {
    /// JSON pointer into the case.
    pointer: &'static str,
    units: &'static Units,
    /// Names of this service.
    names: &'static str,
    /// Names in vehicle-dynamics codes that mean this quantity if the column has one of its units.
    codes: &'static str,
    /// Names that may mean this quantity or another one. They are refused, and the quantity is suggested.
    doubtful: &'static str,
}

macro_rules! quantities {
    ($($pointer:literal $units:ident $names:literal $codes:literal $doubtful:literal;)*) => {
        [$(Quantity { pointer: $pointer, units: &$units, names: $names, codes: $codes, doubtful: $doubtful }),*]
    };
}
/// Symbols of creepages in codes and papers: ν (Simpack, GENSYS), ξ (Universal Mechanism, Kalker), γ (VAMPIRE, Wickens). Greek letters are
/// spelt out before titles are compared.
const QUANTITIES: [Quantity; 13] = quantities! {
    "/load/normal_force_n" FORCE "normal_force"
        "n fn f_n normal_load normal_contact_force contact_normal_force"
        "q fz f_z f_q q_force load force contact_force vertical";
    "/load/vertical_force_n" FORCE "vertical_force wheel_load"
        "vertical_wheel_force vertical_load"
        "q fz f_z f_q q_force load force wheel_force vertical";
    "/load/approach_mm" LENGTH "approach"
        ""
        "penetration interpenetration indentation";
    "/motion/creepage_x" RATIO "creepage_x longitudinal_creepage"
        "nu_x nux xi_x xix xsi_x ksi_x ksix gamma_x gammax creep_x creepx x_creep x_creepage vx_creep creep_vx longitudinal_creep long_creep long_creepage creepage_long creepage_longitudinal creep_longitudinal"
        "nu_1 nu1 xi_1 xi1 gamma_1 gamma1 vx v_x slip_x slipx sx s_x cx longitudinal_slip long_slip creepage creep slip";
    "/motion/creepage_y" RATIO "creepage_y lateral_creepage"
        "nu_y nuy xi_y xiy xsi_y ksi_y ksiy gamma_y gammay creep_y creepy y_creep y_creepage vy_creep creep_vy lateral_creep lat_creep lat_creepage creepage_lat creepage_lateral creep_lateral"
        "nu_2 nu2 xi_2 xi2 gamma_2 gamma2 vy v_y slip_y slipy sy s_y cy lateral_slip lat_slip creepage creep slip";
    "/motion/spin_per_mm" CURVATURE "spin spin_creepage"
        "phi phi_z phi_spin spin_creep creep_spin creepage_spin nu_z nuz nu_phi nu_sp nu_spin xi_z xi_phi xi_sp xi_spin ksi_sp ksi_spin gamma_sp gamma_spin gamma_z omega_spin"
        "nu_3 nu3 xi_3 xi3 gamma_3 gamma3 gamma_s omega_z spin_z";
    "/motion/force_x_n" FORCE "force_x"
        ""
        "fx f_x tx t_x longitudinal_force long_force creep_force_x force traction";
    "/motion/force_y_n" FORCE "force_y"
        ""
        "fy f_y ty t_y lateral_force lat_force creep_force_y force y y_force guiding_force";
    "/friction/coefficient" RATIO "friction_coefficient friction mu"
        "mue cof coefficient_of_friction friction_coeff"
        "f my adhesion adhesion_coefficient";
    "/motion/speed_mm_per_s" SPEED "speed rolling_speed"
        "v velocity vehicle_speed vehicle_velocity running_speed train_speed rolling_velocity v_vehicle v_train"
        "vx v_x v0 v_0 vkmh vel v_rel";
    "/contact/lateral_shift_mm" LENGTH "lateral_shift lateral_displacement"
        "y_rel yrel rel_y y_shift shift_y shift"
        "y dy d_y y_w y_ws y_wheelset y_wr y_wheel u_y lateral_position lateral displacement";
    "/contact/yaw_rad" ANGLE "yaw yaw_angle"
        "psi angle_of_attack attack_angle aoa"
        "alpha attack p";
    "/contact/roll_rad" ANGLE "roll roll_angle"
        ""
        "phi phi_x";
};

/// Members whose names are short names of columns; `friction_coefficient` is a further short name.
const SHORT_NAMES: &str = "/name /load/normal_force_n /load/vertical_force_n /load/approach_mm /motion/creepage_x /motion/creepage_y \
    /motion/spin_per_mm /motion/force_x_n /motion/force_y_n /contact/rolling_mm /contact/lateral_mm /contact/a_mm \
    /contact/b_mm /contact/rolling_radius_mm /contact/lateral_shift_mm /contact/yaw_rad /contact/roll_rad";

/// The short names of columns, each with its JSON pointer.
fn named_members() -> impl Iterator<Item = (&'static str, &'static str)> {
    let members = SHORT_NAMES.split_whitespace();
    let members = members.map(|pointer| (pointer.rsplit('/').next().unwrap_or_default(), pointer));
    members.chain([("friction_coefficient", "/friction/coefficient")])
}

/// Names of places along the track and of times. Their columns are copied to the results, with or without a unit of length or time.
const PLACES_AND_TIMES: &str = "t time clock hour step time_step timestep s s_track track_s km kp pk kilometre kilometer kilometrage chainage station \
    stationing mile mileage milepost position pos place location distance dist distance_travelled distance_traveled \
    track_position track_distance position_along_track distance_along_track track_km track_chainage arc_length latitude \
    longitude date datetime timestamp";

/// Names of sections of a line, of vehicles and their parts, and of rows, also with a suffix of [`NUMBERED`]. Their columns are copied to the
/// results. `row`, `status` and `method` are also result columns; a copied column of that name is refused.
const SECTIONS_AND_THINGS: &str = "section segment track track_section line route curve region direction site switch side rail rail_side left_right id \
    uuid key name title label tag comment remark note description case run scenario variant simulation train vehicle car \
    wagon coach locomotive bogie wheelset axle wheel wheel_side contact_point row status method record frame sample index \
    number no nr num passage";

/// Suffixes of names such as `axle_no`.
const NUMBERED: &[&str] = &[
    "id", "no", "nr", "num", "number", "name", "index", "code", "type",
];

/// Units of places and times, as symbols in brackets and as suffixes of titles.
const PLACE_UNITS: &[&str] = &[
    "s", "ms", "us", "min", "h", "d", "km", "m", "cm", "mm", "mi", "ft", "°",
];

/// Further units that a line of units below the titles may name.
const OTHER_UNITS: &[&str] = &["Hz", "m/s²", "Nm", "°C"];

/// A member of the case that a column varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// JSON pointer into the case.
    pub pointer: String,
    /// Factor from the unit of the column to that of the case.
    pub factor: f64,
}

/// Returns the member that a title names. `below` is the unit of the column by a line of units, or by the title where the client gave the
/// column another name. Returns `None` if the title names no member.
///
/// # Errors
/// The title names a quantity without a unit, or with one that it does not have.
pub fn place(title: &str, below: Option<&str>) -> Result<Option<Place>, String> {
    let (bare, in_title) = parted(title);
    let below = below.map(unbracketed).filter(|unit| !unit.is_empty());
    let unit = match (in_title, below) {
        (Some(one), Some(other)) if one != other => {
            return Err(format!(
                "has two units, `{one}` and `{other}`; they must agree"
            ));
        }
        (in_title, below) => in_title.or(below),
    };
    let found = |pointer: &str, factor| {
        let pointer = pointer.to_owned();
        Ok(Some(Place { pointer, factor }))
    };
    let direct = match bare.starts_with('/') {
        true => Some(bare),
        false => named_members().find_map(|(name, pointer)| (name == title).then_some(pointer)),
    };
    if let Some(pointer) = direct {
        return found(pointer, factor_at(pointer, unit)?);
    }
    let stem = normal(bare);
    for quantity in &QUANTITIES {
        let names = quantity.names.split_whitespace().map(|name| (name, true));
        let codes = quantity.codes.split_whitespace().map(|name| (name, false));
        for (name, own) in names.chain(codes) {
            if let Some(factor) = quantity.factor(&stem, name, own, unit)? {
                return found(quantity.pointer, factor);
            }
        }
    }
    // Such as `rolling_radius [m]` and `rolling_radius_m`, as for `rolling_radius_mm`.
    for (name, pointer) in named_members() {
        let known = MEMBER_UNITS
            .iter()
            .find_map(|(end, units)| Some((name.strip_suffix(end)?, *units)));
        if let Some((base, units)) = known
            && !QUANTITIES.iter().any(|quantity| quantity.may_be(base))
            && let Some(factor) = units.factor_of_title(&stem, base, unit)?
        {
            return found(pointer, factor);
        }
    }
    Ok(None)
}

impl Quantity {
    /// Returns the factor of a title that is this name of the quantity. Returns `None` for another title, and for a name of a code without a
    /// unit of the quantity.
    fn factor(
        &self,
        stem: &str,
        name: &str,
        own: bool,
        unit: Option<&str>,
    ) -> Result<Option<f64>, String> {
        let factor = self.units.factor_of_title(stem, name, unit)?;
        if !own || factor.is_some() || stem != name {
            return Ok(factor);
        }
        match unit {
            Some(unit) => Err(format!("has the unit `{unit}`; {}", self.allowed())),
            // A ratio without a unit is a number.
            None => self
                .units
                .of_suffix("")
                .map(Some)
                .ok_or_else(|| format!("has no unit; {}", self.allowed())),
        }
    }

    fn allowed(&self) -> String {
        let mut units: Vec<&str> = self.units.list.iter().map(|(unit, ..)| *unit).collect();
        units.dedup();
        format!(
            "allowed as in `{} [{}]`: {}",
            self.first_name(),
            self.units.usual,
            units.join(", ")
        )
    }

    /// Returns the quantity as a title, in this unit if the quantity has it.
    fn written(&self, unit: Option<&str>) -> String {
        let unit = unit.filter(|unit| self.units.factor(unit).is_some());
        format!(
            "{} [{}]",
            self.first_name(),
            unit.unwrap_or(self.units.usual)
        )
    }

    fn first_name(&self) -> &'static str {
        self.names.split_whitespace().next().unwrap_or_default()
    }

    /// Whether this is a name of the quantity, or one that may mean it.
    fn may_be(&self, name: &str) -> bool {
        [self.names, self.codes, self.doubtful]
            .iter()
            .any(|names| is_among(name, names))
    }
}

impl Units {
    /// Returns the factor of a title that is this name with a unit in brackets or as a suffix; `None` for another title or unit.
    fn factor_of_title(
        &self,
        stem: &str,
        name: &str,
        unit: Option<&str>,
    ) -> Result<Option<f64>, String> {
        let Some(rest) = stem.strip_prefix(name) else {
            return Ok(None);
        };
        if rest.is_empty() {
            return Ok(unit.and_then(|unit| self.factor(unit)));
        }
        // Another suffix, as in `spin_axis`, makes it another quantity.
        let suffix = rest.strip_prefix('_').filter(|suffix| !suffix.is_empty());
        let factor = suffix.and_then(|suffix| self.of_suffix(suffix));
        match unit {
            Some(unit) if factor.is_some() && self.factor(unit) != factor => Err(format!(
                "ends in one unit and has the unit `{unit}` beside it; they must agree"
            )),
            _ => Ok(factor),
        }
    }

    fn factor(&self, unit: &str) -> Option<f64> {
        let exact = self.list.iter().find(|(known, ..)| *known == unit);
        let lower = || {
            let same = |known: &str| known.to_lowercase() == unit.to_lowercase();
            self.list.iter().find(|(known, ..)| same(known))
        };
        exact.or_else(lower).map(|(.., factor)| *factor)
    }

    fn of_suffix(&self, suffix: &str) -> Option<f64> {
        let found = self.list.iter().find(|(_, known, _)| *known == suffix);
        found.map(|(.., factor)| *factor)
    }
}

/// Returns the factor of a column in `unit` that is named by a pointer. The suffix of the pointer names its unit, so another unit is refused.
fn factor_at(pointer: &str, unit: Option<&str>) -> Result<f64, String> {
    let Some(unit) = unit else {
        return Ok(1.0);
    };
    match units_at(pointer) {
        Some(units) if units.factor(unit) == Some(1.0) => Ok(1.0),
        Some(units) => Err(format!(
            "is in {} by its name, and the column has the unit `{unit}`; they must agree",
            units.list[0].0
        )),
        None => RATIO
            .factor(unit)
            .ok_or_else(|| format!("does not allow the unit `{unit}` of the column by its name")),
    }
}

/// Returns the units of a member, by the suffix of its name.
fn units_at(pointer: &str) -> Option<&'static Units> {
    let known = MEMBER_UNITS.iter().find(|(end, _)| pointer.ends_with(end));
    known.map(|(_, units)| *units)
}

/// Returns the short names as a list for messages.
#[must_use]
pub fn short_names() -> String {
    let names = named_members().map(|(name, _)| format!("`{name}`"));
    names.collect::<Vec<_>>().join(", ")
}

/// Whether a list of names, separated by spaces, contains this name.
fn is_among(name: &str, names: &str) -> bool {
    names.split_whitespace().any(|known| known == name)
}

/// Whether a title names a place, a time, a section or a thing, whose column is copied to the results.
fn is_copied(title: &str, below: Option<&str>) -> bool {
    let unit = unit_of(title, below);
    let unitless = unit.is_none_or(|unit| ["-", "1"].contains(&unit));
    let of_place = unitless || unit.is_some_and(|unit| PLACE_UNITS.contains(&unit));
    // In a table of a batch such a column is a label.
    title.starts_with("label:")
        || is_listed(title, PLACES_AND_TIMES, PLACE_UNITS) && of_place
        || is_thing(title) && unitless
}

/// Whether a title names a section, a vehicle, one of its parts, or a row.
pub(crate) fn is_thing(title: &str) -> bool {
    is_listed(title, SECTIONS_AND_THINGS, NUMBERED)
}

/// Whether a list has the name of a title, possibly with one of these suffixes.
fn is_listed(title: &str, list: &str, suffixes: &[&str]) -> bool {
    let stem = normal(parted(title).0);
    let before = stem
        .rsplit_once('_')
        .filter(|(_, suffix)| suffixes.contains(suffix));
    is_among(&stem, list) || before.is_some_and(|(before, _)| is_among(before, list))
}

/// Returns the quantities that an unknown title may mean, as titles.
fn suggested(title: &str, below: Option<&str>) -> Vec<String> {
    let unit = unit_of(title, below);
    let stem = normal(parted(title).0);
    let written = |quantities: Vec<&Quantity>| -> Vec<String> {
        let in_unit =
            |quantity: &&&Quantity| unit.is_none_or(|unit| quantity.units.factor(unit).is_some());
        let mut fitting: Vec<&&Quantity> = quantities.iter().filter(in_unit).collect();
        if fitting.is_empty() {
            fitting = quantities.iter().collect();
        }
        fitting.iter().map(|found| found.written(unit)).collect()
    };
    // Such as `nu_x` in `cpt_111r.nu_x` and in `nu_x_left`: the longest part of the title that is a name.
    let tokens: Vec<&str> = stem.split('_').collect();
    for length in (1..=tokens.len().min(4)).rev() {
        for part in tokens.windows(length) {
            let part = part.join("_");
            let plain = part.trim_end_matches(|end: char| end.is_ascii_digit());
            // Such as `ql` and `q11r`.
            let sided = part.trim_end_matches(['l', 'r']);
            let sided = sided.trim_end_matches(|end: char| end.is_ascii_digit());
            for name in [part.as_str(), plain, sided] {
                let found: Vec<&Quantity> = QUANTITIES
                    .iter()
                    .filter(|known| known.may_be(name))
                    .collect();
                if !found.is_empty() {
                    return written(found);
                }
            }
        }
    }
    let near = |name: &str| {
        name.len() >= MISSPELT_LENGTH && strsim::levenshtein(name, &stem) <= MISSPELT_LETTERS
    };
    let misspelt = QUANTITIES
        .iter()
        .filter(|quantity| quantity.names.split_whitespace().any(near));
    let misspelt: Vec<&Quantity> = misspelt.collect();
    if !misspelt.is_empty() {
        return written(misspelt);
    }
    let of_unit = |quantity: &&Quantity| {
        unit.is_some_and(|unit| unit != "-" && unit != "1" && quantity.units.factor(unit).is_some())
    };
    written(QUANTITIES.iter().filter(of_unit).collect())
}

/// Returns a question that names the quantities that an unknown title may mean; empty if there are none.
#[must_use]
pub fn question(title: &str, below: Option<&str>) -> String {
    let guesses: Vec<String> = suggested(title, below)
        .into_iter()
        .map(|guess| format!("`{guess}`"))
        .collect();
    match guesses.is_empty() {
        true => String::new(),
        false => format!("is it {}?", guesses.join(" or ")),
    }
}

/// Columns that the query names: the title of each, and the name that gives its meaning; a column with an empty name is copied to the
/// results. `None` for a route whose query names no columns.
#[derive(Debug, Clone, Default)]
pub struct NamedColumns(pub Option<Vec<(String, String)>>);

impl NamedColumns {
    /// Whether the query names the column of this title, with or without its unit.
    #[must_use]
    pub fn names(&self, title: &str) -> bool {
        let mut named = self.0.iter().flatten();
        named.any(|(name, _)| *name == title || *name == parted(title).0)
    }

    /// Returns the columns of these titles.
    ///
    /// # Errors
    /// `faulty-table` with every column at fault: a title is not known, or it names a quantity with a unit that it does not have, or without
    /// one; or there are too many columns; or the query names a column twice, or one that does not exist.
    pub fn columns(&self, titles: &[Title]) -> Result<Vec<TitledColumn>> {
        require_few(titles.len())?;
        let mut named = HashMap::new();
        for (title, name) in self.0.iter().flatten() {
            if named.insert(title.as_str(), name.as_str()).is_some() {
                return Err(faulty(format!("`{title}` is named twice in the query")));
            }
        }
        let mut missing: HashSet<&str> = named.keys().copied().collect();
        let (mut columns, mut faults) = (Vec::with_capacity(titles.len()), BTreeMap::new());
        for (number, title) in titles.iter().enumerate() {
            let (name, below) = (title.name.as_str(), title.unit.as_deref());
            // The query may name a title without its unit.
            let found = [name, parted(name).0]
                .into_iter()
                .find_map(|name| named.get_key_value(name));
            if let Some((name, _)) = found {
                missing.remove(name);
            }
            if name.is_empty() {
                let detail = format!("number {} has no title", number + 1);
                faults.insert(number, (name, detail));
                continue;
            }
            match place_of(name, below, found.map(|(_, name)| *name), self.0.is_some()) {
                Ok(place) => columns.push(TitledColumn {
                    name: name.to_owned(),
                    factor: place.as_ref().map_or(1.0, |place| place.factor),
                    text: title.text || place.is_none() && title.text_if_copied,
                    pointer: place.map(|place| place.pointer),
                    unit: unit_of(name, below).map(str::to_owned),
                }),
                Err(detail) => {
                    faults.insert(number, (name, detail));
                }
            }
        }
        if let Some(title) = self
            .0
            .iter()
            .flatten()
            .map(|(title, _)| title)
            .find(|title| missing.contains(title.as_str()))
        {
            let titles: Vec<String> = titles
                .iter()
                .take(NAMED_MAX)
                .map(|title| format!("`{}`", title.name))
                .collect();
            return Err(faulty(format!(
                "the query names the column `{title}`, which is not a title of the table; its titles: {}",
                titles.join(", ")
            )));
        }
        match faults.is_empty() {
            true => Ok(columns),
            false => Err(refusal(faults.into_values(), &columns)),
        }
    }
}

/// Returns the member that a column varies; `None` if it is copied to the results. `named` is its name in the query, and `in_query` tells
/// whether the query of this route can name columns.
fn place_of(
    title: &str,
    below: Option<&str>,
    named: Option<&str>,
    in_query: bool,
) -> Result<Option<Place>, String> {
    let carry = match in_query {
        true => format!("`?carry={title}` copies it to the results"),
        false => "leave it out if it is none".to_owned(),
    };
    match named {
        Some("") => Ok(None),
        // A row has no name, unlike a job.
        None if title == "name" => Ok(None),
        Some(what) => {
            let unit = unit_of(title, below);
            // The client names both the unit of the column and the member, so that the values are converted.
            let factor = unit.and_then(|unit| units_at(what)?.factor(unit));
            if let Some(factor) = factor.filter(|_| what.starts_with('/')) {
                let pointer = what.to_owned();
                return Ok(Some(Place { pointer, factor }));
            }
            let place = place(what, unit);
            match place.map_err(|detail| format!("`{what}` {detail}"))? {
                Some(place) => Ok(Some(place)),
                None => {
                    let known = QUANTITIES.iter().map(Quantity::first_name);
                    let known: Vec<&str> = known.collect();
                    Err(format!(
                        "`{what}` is named in `column`, but is not a place in a case; allowed: a JSON pointer, a short name, or one of {} with a unit",
                        known.join(", ")
                    ))
                }
            }
        }
        None => match place(title, below).map_err(|detail| format!("{detail}; {carry}"))? {
            Some(place) => Ok(Some(place)),
            None if is_copied(title, below) => Ok(None),
            None => {
                let asked = match question(title, below) {
                    asked if asked.is_empty() => "if it is a quantity of the case,".to_owned(),
                    asked => asked,
                };
                let example = suggested(title, below).into_iter().next();
                let example = example.unwrap_or_else(|| "creepage_x [%]".to_owned());
                let unit = unit_of(title, below);
                Err(match unit {
                    Some(unit) if parted(&example).1 != Some(unit) => format!(
                        "is not known; {asked} convert it, since `{unit}` is not a unit of this quantity; {carry}"
                    ),
                    _ if in_query => format!(
                        "is not known; {asked} `?column={title}:{example}` gives its meaning, and {carry}"
                    ),
                    _ => format!("is not known; {asked} write its title as `{example}`; {carry}"),
                })
            }
        },
    }
}

/// Whether the column of this title holds texts, which have no unit.
#[must_use]
pub fn is_text(title: &str) -> bool {
    title == "name"
        || title == "/name"
        || title.starts_with("label:")
        || title.starts_with("/labels/")
}

/// Returns the unit in a title or in a line of units.
fn unit_of<'a>(title: &'a str, below: Option<&'a str>) -> Option<&'a str> {
    let below = below.map(unbracketed).filter(|unit| !unit.is_empty());
    parted(title).1.or(below)
}

/// Returns the refusal of a table with faulty columns, with the meaning of the other columns.
fn refusal<'a>(
    faults: impl Iterator<Item = (&'a str, String)>,
    good: &[TitledColumn],
) -> TableError {
    let faults: Vec<(&str, String)> = faults
        .map(|(title, detail)| (title, format!("column `{title}`: {detail}")))
        .collect();
    let mut parts: Vec<String> = faults
        .iter()
        .take(NAMED_MAX)
        .map(|(_, detail)| detail.clone())
        .collect();
    if faults.len() > NAMED_MAX {
        parts.push(format!(
            "{} more columns are refused",
            faults.len() - NAMED_MAX
        ));
    }
    let recognised: Vec<String> = good
        .iter()
        .filter_map(|column| Some((column.name.as_str(), column.pointer.as_deref()?)))
        .filter(|(name, pointer)| name != pointer)
        .take(NAMED_MAX)
        .map(|(name, pointer)| format!("`{name}` as `{pointer}`"))
        .collect();
    if !recognised.is_empty() {
        parts.push(format!("recognised: {}", recognised.join(", ")));
    }
    let columns = faults.into_iter();
    TableError::Faulty {
        detail: parts.join("; "),
        columns: columns
            .map(|(title, detail)| (title.to_owned(), detail))
            .collect(),
    }
}

/// Parses `TITLE:NAME` of the query; the title may contain colons.
#[must_use]
pub fn named_column(text: &str) -> Option<(String, String)> {
    let (title, what) = text.rsplit_once(':')?;
    (!title.is_empty()).then(|| (title.trim().to_owned(), what.trim().to_owned()))
}

/// Whether a field can be a unit in a line of units.
fn is_unit(text: &str) -> bool {
    let bare = unbracketed(text);
    let members = MEMBER_UNITS.iter().map(|(_, units)| *units);
    let mut known = members.chain([&RATIO]).flat_map(|units| units.list);
    bare != text
        || text.is_empty()
        || known.any(|(unit, ..)| *unit == bare && *unit != "1")
        || PLACE_UNITS.contains(&bare)
        || OTHER_UNITS.contains(&bare)
}

/// Whether the fields of a line are units; at least one must not be empty.
pub fn is_line_of_units<'a>(fields: impl Iterator<Item = &'a str>) -> bool {
    let mut some = false;
    let all = fields.map(str::trim).all(|field| {
        some |= !field.is_empty();
        is_unit(field)
    });
    all && some
}

/// Splits a title into its name and the unit at its end: in brackets, or after ` / ` or ` in `.
fn parted(title: &str) -> (&str, Option<&str>) {
    let behind = |word: &str| {
        let parts = title.trim().rsplit_once(word);
        parts.filter(|(_, unit)| !unit.is_empty() && is_unit(unit))
    };
    let parts = bracketed(title).or_else(|| behind(" / "));
    match parts.or_else(|| behind(" in ")) {
        Some((stem, unit)) => (stem.trim(), Some(unit)),
        None => (title.trim(), None),
    }
}

fn bracketed(title: &str) -> Option<(&str, &str)> {
    let title = title.trim();
    let (open, rest) = match title.strip_suffix(']') {
        Some(rest) => ('[', rest),
        None => ('(', title.strip_suffix(')')?),
    };
    let (stem, unit) = rest.rsplit_once(open)?;
    Some((stem, unit.trim()))
}

/// Returns a unit without its brackets.
fn unbracketed(unit: &str) -> &str {
    bracketed(unit).map_or(unit.trim(), |(_, unit)| unit)
}

/// Normalises a title for comparison: lower case, Greek letters spelt out, words separated by `_`.
fn normal(title: &str) -> String {
    let mut text = String::with_capacity(title.len());
    let mut before = ' ';
    for letter in title.chars() {
        let hump = letter.is_uppercase() && before.is_lowercase();
        before = letter;
        if hump {
            text.push('_');
        }
        match letter {
            ' ' | '-' | '.' | '/' | ':' | '_' => text.push('_'),
            'µ' | 'μ' => text.push_str("mu"),
            'ν' | 'υ' => text.push_str("nu"),
            'ξ' => text.push_str("xi"),
            'γ' => text.push_str("gamma"),
            'φ' | 'ϕ' => text.push_str("phi"),
            'ψ' => text.push_str("psi"),
            'α' => text.push_str("alpha"),
            'ω' => text.push_str("omega"),
            letter => text.extend(letter.to_lowercase()),
        }
    }
    let words = text.split('_').filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(title: &str, unit: Option<&str>) -> Title {
        Title {
            name: title.to_owned(),
            unit: unit.map(str::to_owned),
            text: false,
            text_if_copied: false,
        }
    }

    fn read(title: &str, unit: Option<&str>) -> Result<Option<(String, f64)>, String> {
        let named = NamedColumns(Some(Vec::new()));
        let columns = named.columns(&[column(title, unit)]);
        let column = columns.map_err(|error| format!("{error:?}"))?.remove(0);
        Ok(column.pointer.map(|pointer| (pointer, column.factor)))
    }

    #[test]
    fn titles_with_units_are_places_and_factors() {
        for (title, unit, place, factor) in [
            ("normal_force_n", None, "/load/normal_force_n", 1.0),
            ("normal_force_n", Some("[N]"), "/load/normal_force_n", 1.0),
            ("Normal force [kN]", None, "/load/normal_force_n", 1e3),
            ("NormalForce [kN]", None, "/load/normal_force_n", 1e3),
            ("wheel_load (kN)", None, "/load/vertical_force_n", 1e3),
            ("normal_force_kn", None, "/load/normal_force_n", 1e3),
            ("FN [kN]", None, "/load/normal_force_n", 1e3),
            ("FN / kN", None, "/load/normal_force_n", 1e3),
            ("Normal force in N", None, "/load/normal_force_n", 1.0),
            ("N", Some("[N]"), "/load/normal_force_n", 1.0),
            ("Longitudinal creepage", None, "/motion/creepage_x", 1.0),
            ("creepage_x", Some("%"), "/motion/creepage_x", 1e-2),
            ("/motion/creepage_x", Some("%"), "/motion/creepage_x", 1e-2),
            ("lateral creepage [%]", None, "/motion/creepage_y", 1e-2),
            ("nu_x", Some("[%]"), "/motion/creepage_x", 1e-2),
            ("nux [-]", None, "/motion/creepage_x", 1.0),
            ("nu.y [‰]", None, "/motion/creepage_y", 1e-3),
            ("ξ_y [-]", None, "/motion/creepage_y", 1.0),
            ("gamma_x", Some("-"), "/motion/creepage_x", 1.0),
            ("phi [1/m]", None, "/motion/spin_per_mm", 1e-3),
            ("spin [1/m]", None, "/motion/spin_per_mm", 1e-3),
            ("spin", Some("[rad/m]"), "/motion/spin_per_mm", 1e-3),
            ("spin_per_m", None, "/motion/spin_per_mm", 1e-3),
            ("speed", Some("km/h"), "/motion/speed_mm_per_s", 1e3 / 3.6),
            ("V [m/s]", None, "/motion/speed_mm_per_s", 1e3),
            ("yaw [mrad]", None, "/contact/yaw_rad", 1e-3),
            ("psi", Some("mrad"), "/contact/yaw_rad", 1e-3),
            ("y_rel [mm]", None, "/contact/lateral_shift_mm", 1.0),
            ("mu", None, "/friction/coefficient", 1.0),
            ("µ", None, "/friction/coefficient", 1.0),
            (
                "lateral_displacement [m]",
                None,
                "/contact/lateral_shift_mm",
                1e3,
            ),
            ("a [mm]", None, "/contact/a_mm", 1.0),
            ("a_m", None, "/contact/a_mm", 1e3),
            ("b", Some("[m]"), "/contact/b_mm", 1e3),
            (
                "Rolling radius [m]",
                None,
                "/contact/rolling_radius_mm",
                1e3,
            ),
        ] {
            let expected = Some((place.to_owned(), factor));
            assert_eq!(read(title, unit), Ok(expected), "{title} {unit:?}");
        }
    }

    #[test]
    fn places_times_and_things_are_carried_along() {
        for (title, unit) in [
            ("time [s]", None),
            ("Time", None),
            ("TIME", Some("[s]")),
            ("t", None),
            ("km", None),
            ("s", Some("m")),
            ("s_track", None),
            ("sTrack", None),
            ("time_s", None),
            ("position [km]", None),
            ("Section", None),
            ("id", None),
            ("Wheel ID", None),
            ("axle_no", None),
            ("vehicle", None),
        ] {
            assert_eq!(read(title, unit), Ok(None), "{title} {unit:?}");
        }
    }

    #[test]
    fn other_titles_are_refused_with_what_they_may_mean() {
        for (title, unit, words) in [
            (
                "Q_left",
                Some("[kN]"),
                &["normal_force [kN]", "vertical_force [kN]"][..],
            ),
            ("Ql", None, &["normal_force [kN]"]),
            ("nu_x", None, &["creepage_x [-]"]),
            ("cpt_111r.nux", None, &["creepage_x [-]"]),
            ("nu_y_left [%]", None, &["creepage_y [%]"]),
            ("phi [rad]", None, &["roll [rad]"]),
            ("alpha", None, &["yaw [mrad]"]),
            ("y [mm]", None, &["lateral_shift [mm]"]),
            ("lateral [mm]", None, &["lateral_shift [mm]"]),
            ("a", None, &["?carry=a"]),
            ("v", None, &["speed [km/h]"]),
            ("normal_forse", None, &["normal_force [kN]"]),
            ("whatever [1/m]", None, &["spin [1/m]"]),
            ("s [%]", None, &["creepage_x [%]"]),
            ("t", Some("kN"), &["normal_force [kN]"]),
            ("curvature", None, &["?carry=curvature"]),
            ("speed_limit", None, &["?carry=speed_limit"]),
            ("rolling_noise", None, &["?carry=rolling_noise"]),
            ("creepage_x [ppm]", None, &["`ppm`"]),
            (
                "Q_left [MN]",
                None,
                &["normal_force [kN]", "convert it", "`MN`"],
            ),
        ] {
            let refused = read(title, unit).expect_err(title);
            assert!(refused.contains(&format!("`{title}`")), "{refused}");
            for word in words {
                assert!(refused.contains(word), "{title} {word}: {refused}");
            }
        }
    }

    #[test]
    fn advice_names_parameters_only_where_the_query_has_them() {
        let columns = NamedColumns::default().columns(&[column("nu_x", None)]);
        let refused = columns.unwrap_err().to_string();
        assert!(
            refused.contains("write its title as `creepage_x [-]`"),
            "{refused}"
        );
        assert!(
            !refused.contains("?column") && !refused.contains("?carry"),
            "{refused}"
        );
    }

    #[test]
    fn a_quantity_without_its_unit_is_refused() {
        for (title, unit, word) in [
            ("spin", None, "has no unit"),
            ("Normal force", None, "kN"),
            ("yaw [grad]", None, "`grad`"),
            ("lateral_shift", Some("s"), "`s`"),
            ("normal_force_n", Some("kN"), "agree"),
            ("/load/normal_force_n", Some("kN"), "agree"),
            ("/motion/wheelset/speed_mm_per_s [m/s]", None, "agree"),
            ("normal_force_kn [N]", None, "agree"),
            ("spin [1/m]", Some("1/mm"), "two units, `1/m` and `1/mm`"),
            ("rolling_radius_m [mm]", None, "agree"),
        ] {
            let refused = read(title, unit).expect_err(title);
            assert!(refused.contains(word), "{refused}");
        }
    }

    #[test]
    fn a_client_says_what_a_column_is() {
        let named = [
            "Q.left:vertical_force [kN]",
            "Q.right:vertical_force",
            "ny: creepage_y",
            "spin:",
            "t:x:/motion/creepage_x",
        ];
        let named = named.iter().filter_map(|text| named_column(text));
        let named = NamedColumns(Some(named.collect()));
        let titles = ["Q.left", "Q.right", "ny [%]", "spin", "t:x"];
        let mut titles = titles.map(|title| column(title, None));
        titles[1].unit = Some("[kN]".to_owned());
        let columns = named.columns(&titles).expect("columns");
        let found: Vec<_> = columns
            .iter()
            .map(|column| (column.pointer.as_deref(), column.factor))
            .collect();
        let vertical = (Some("/load/vertical_force_n"), 1e3);
        let expected = [
            vertical,
            vertical,
            (Some("/motion/creepage_y"), 1e-2),
            (None, 1.0),
            (Some("/motion/creepage_x"), 1.0),
        ];
        assert_eq!(found, expected);
        let of = |named: &[&str]| {
            let named = named.iter().filter_map(|text| named_column(text));
            let named = NamedColumns(Some(named.collect()));
            let columns = named.columns(&[column("a", None)]);
            format!("{:?}", columns.expect_err("a refusal"))
        };
        let nameless = NamedColumns::default().columns(&[column("", None)]);
        let nameless = format!("{:?}", nameless.expect_err("a refusal"));
        assert!(nameless.contains("number 1 has no title"), "{nameless}");
        assert!(of(&["a:load"]).contains("not a place in a case"));
        assert!(of(&["a:creepage_x", "a:creepage_y"]).contains("twice"));
        assert!(of(&["b:creepage_x"]).contains("not a title"));
        let columns = NamedColumns(Some(vec![(
            "v".to_owned(),
            "/motion/wheelset/speed_mm_per_s".to_owned(),
        )]));
        let columns = columns
            .columns(&[column("v [m/s]", None)])
            .expect("a speed");
        assert_eq!(columns[0].factor, 1e3);
        let refused = of(&["a:spin"]);
        assert!(
            refused.contains("`spin` has no unit") && refused.contains("column `a`"),
            "{refused}"
        );
    }

    #[test]
    fn columns_are_bounded() {
        let titles = (0..=COLUMNS_MAX).map(|k| column(&format!("/a/{k}"), None));
        let titles: Vec<Title> = titles.collect();
        let columns = |count: usize| NamedColumns::default().columns(&titles[..count]);
        assert_eq!(columns(COLUMNS_MAX).expect("columns").len(), COLUMNS_MAX);
        assert!(columns(COLUMNS_MAX + 1).is_err());
    }
}
