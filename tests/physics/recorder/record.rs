//! The recorded quantities of an answer and their text: one quantity per line, with numbers as the shortest decimals that restore every bit.

use std::fmt::{self, Display, Formatter};

use railhead_contact::solution::words::answer::{Fields, PatchFields, PointSolution, Solution};

/// The scale by which a change of a quantity is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The largest number of the line.
    Number,
    /// The friction limit μN.
    Force,
    /// μN√(A/π).
    Moment,
    /// No scale: counts, meshes, remarks and digests are equal or not, and differ between machines.
    Exact,
}

/// Returns the kind of a quantity.
pub fn kind(quantity: &str) -> Kind {
    match quantity {
        "force_x"
        | "force_y"
        | "error_x"
        | "error_y"
        | "profile_uncertainty"
        | "friction_power"
        | "power_without_spin"
        | "total_force"
        | "total_error" => Kind::Force,
        "moment_z" | "error_z" | "total_moment" => Kind::Moment,
        "patches" | "lowering" | "position" | "creepage_x" | "creepage_y" | "spin"
        | "traction_max" | "stick_area" | "slip_area" => Kind::Number,
        _ => Kind::Exact,
    }
}

/// One answer: its quantities in order, each with its numbers or words.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Record(pub Vec<(String, Vec<String>)>);

/// The answers to all cases, with the revision and the arithmetic that gave them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recording {
    pub revision: u32,
    pub arithmetic: String,
    pub answers: Vec<(String, Record)>,
}

fn number(value: f64) -> String {
    format!("{value:e}")
}

fn numbers(values: impl IntoIterator<Item = f64>) -> Vec<String> {
    values.into_iter().map(number).collect()
}

/// Returns the text of a number that may be missing.
fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}

impl Record {
    /// Returns the record of a case without an answer, with the reason.
    pub fn refused(reason: &str) -> Record {
        let words = reason.split_whitespace().map(str::to_owned).collect();
        Record(vec![("refused".to_owned(), words)])
    }

    /// Returns the record of the answer to a case with this friction coefficient.
    pub fn of(friction: f64, solution: &Solution, fields: &Fields) -> Record {
        let mut record = Record::default();
        let load: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
        let area: f64 = solution.patches.iter().map(|p| p.area_mm2).sum();
        let length = (area / std::f64::consts::PI).sqrt();
        record.put("scales", numbers([friction * load, length]));
        let remark = |entry: &railhead_contact::remark::entry::RemarkEntry| {
            let place = |index: Option<usize>| index.map_or("-".to_owned(), |at| at.to_string());
            let also = &entry.also_at_points;
            let [patch, point] = [entry.patch, entry.point].map(place);
            format!("{}@{patch}/{point}{also:?}", entry.code).replace(' ', "")
        };
        record.put("remarks", solution.remarks.iter().map(remark).collect());
        record.put_normal(solution);
        record.put_points(solution);
        record.put_totals(solution);
        let meshes = fields.patches.iter().flat_map(|patch| {
            let points = 0..patch.points.len();
            points.map(|point| mesh_digest(patch, point))
        });
        record.put("mesh_digests", meshes.collect());
        let values = fields.patches.iter().flat_map(|patch| {
            let points = 0..patch.points.len();
            points.map(|point| value_digest(patch, point))
        });
        record.put("field_digests", values.collect());
        record
    }

    /// Adds a quantity, unless all its values are missing.
    fn put(&mut self, quantity: &str, values: Vec<String>) {
        if values.iter().any(|value| value != "-") {
            self.0.push((quantity.to_owned(), values));
        }
    }

    fn put_normal(&mut self, solution: &Solution) {
        let patches = solution.patches.iter().flat_map(|patch| {
            let mut all = numbers([patch.normal_force_n, patch.area_mm2, patch.pressure_max_mpa]);
            all.push(optional(patch.approach_mm));
            all.extend(numbers(patch.extent_mm));
            all
        });
        self.put("patches", patches.collect());
        let places = solution
            .patches
            .iter()
            .filter_map(|patch| patch.position)
            .flat_map(|at| {
                let mut all = at.track_mm.to_vec();
                all.extend(at.rail_mm);
                all.extend(at.wheel_mm);
                all.extend([at.contact_angle_rad, at.rolling_radius_mm]);
                numbers(all)
            });
        self.put("position", places.collect());
        self.put("lowering", vec![optional(solution.wheel_lowering_mm)]);
        if let Some(normal) = &solution.normal {
            let counts = [normal.cells[0], normal.cells[1], normal.grids];
            let mut all: Vec<String> = counts.iter().map(u32::to_string).collect();
            all.push(normal.iterations.to_string());
            let rests = [normal.residual, normal.pressure_change];
            all.extend(numbers(rests.into_iter().chain([normal.force_residual])));
            self.put("normal_work", all);
        }
    }

    fn put_points(&mut self, solution: &Solution) {
        let mut each = |quantity: &str, value: &dyn Fn(&PointSolution) -> String| {
            let points = solution.patches.iter().flat_map(|patch| &patch.points);
            self.put(quantity, points.map(value).collect());
        };
        each("creepage_x", &|p| number(p.motion.creepage_x));
        each("creepage_y", &|p| number(p.motion.creepage_y));
        each("spin", &|p| number(p.motion.spin_per_mm));
        each("force_x", &|p| number(p.force_x_n));
        each("force_y", &|p| number(p.force_y_n));
        each("moment_z", &|p| number(p.moment_z_n_mm));
        each("error_x", &|p| {
            optional(p.error_estimate.map(|e| e.force_x_n))
        });
        each("error_y", &|p| {
            optional(p.error_estimate.map(|e| e.force_y_n))
        });
        each("error_z", &|p| {
            optional(p.error_estimate.map(|e| e.moment_z_n_mm))
        });
        each("profile_uncertainty", &|p| {
            optional(p.profile_uncertainty.map(|u| u.force_x_n + u.force_y_n))
        });
        each("stick_area", &|p| optional(p.stick_area_mm2));
        each("slip_area", &|p| optional(p.slip_area_mm2));
        each("traction_max", &|p| optional(p.traction_max_mpa));
        each("friction_power", &|p| number(p.friction_power_n));
        each("power_without_spin", &|p| {
            number(p.friction_power_without_spin_n)
        });
        each("stick_cells", &|p| optional(p.stick_cells.map(f64::from)));
        each("slip_cells", &|p| optional(p.slip_cells.map(f64::from)));
        each("mesh", &|p| {
            let mesh = p.solver.mesh;
            mesh.map_or("-".to_owned(), |mesh| {
                format!("{}x{}", mesh.strips, mesh.cells)
            })
        });
        each("iterations", &|p| p.solver.iterations.to_string());
        each("products", &|p| p.solver.products.to_string());
        each("skips", &|p| p.solver.skipped.len().to_string());
        each("residual", &|p| number(p.solver.residual));
        each("target_met", &|p| {
            p.target_met.map_or("-".to_owned(), |met| met.to_string())
        });
        each("saturated", &|p| p.saturated.to_string());
    }

    fn put_totals(&mut self, solution: &Solution) {
        let forces = solution.total.iter().flat_map(|total| {
            let mut all = numbers([total.force_x_n, total.force_y_n]);
            all.push(optional(total.force_z_n));
            all
        });
        self.put("total_force", forces.collect());
        let moments = solution.total.iter().map(|total| total.moment_z_n_mm);
        self.put("total_moment", numbers(moments));
        let errors = solution.total.iter().flat_map(|total| {
            let error = total.error_estimate;
            let both = [error.map(|e| e.force_x_n), error.map(|e| e.force_y_n)];
            both.map(optional)
        });
        self.put("total_error", errors.collect());
    }

    pub fn get(&self, quantity: &str) -> Option<&[String]> {
        let found = self.0.iter().find(|(name, _)| name == quantity);
        found.map(|(_, values)| values.as_slice())
    }
}

/// FNV-1a with 64 bits (Fowler, Noll, Vo). Equal digests mean equal values to the last bit.
pub struct Digest(u64);

impl Digest {
    pub fn new() -> Digest {
        Digest(0xCBF2_9CE4_8422_2325)
    }

    pub fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
        }
    }

    fn values(&mut self, values: Option<&Vec<f64>>) {
        self.word(u64::from(values.is_some()));
        for value in values.into_iter().flatten() {
            // Positive and negative zero count as equal.
            self.word((value + 0.0).to_bits());
        }
    }

    pub fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}

/// Returns the digest of the cells of a motion, with their pressure.
fn mesh_digest(patch: &PatchFields, point: usize) -> String {
    let (cells, mut digest) = (patch.cells(point), Digest::new());
    for values in [&cells.x_mm, &cells.y_mm, &cells.dx_mm, &cells.dy_mm] {
        digest.values(Some(values));
    }
    for strip in &cells.strip {
        digest.word(u64::from(*strip));
    }
    digest.values(cells.pressure_mpa.as_ref());
    format!("{}:{}", cells.x_mm.len(), digest.text())
}

/// Returns the digest of zones, tractions and slips of a motion.
fn value_digest(patch: &PatchFields, point: usize) -> String {
    let (values, mut digest) = (&patch.points[point], Digest::new());
    for zone in values.zone.iter().flatten() {
        digest.word(u64::from(zone.name() == "slip"));
    }
    for values in [
        &values.traction_x_mpa,
        &values.traction_y_mpa,
        &values.slip_x,
        &values.slip_y,
    ] {
        digest.values(values.as_ref());
    }
    digest.text()
}

impl Display for Recording {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        writeln!(f, "revision {}", self.revision)?;
        writeln!(f, "arithmetic {}", self.arithmetic)?;
        for (name, record) in &self.answers {
            writeln!(f, "\n[{name}]")?;
            for (quantity, values) in &record.0 {
                writeln!(f, "{quantity} {}", values.join(" "))?;
            }
        }
        Ok(())
    }
}

impl Recording {
    /// Parses the output of [`Display`]. Returns `None` for any other text.
    pub fn read(text: &str) -> Option<Recording> {
        let mut recording = Recording::default();
        for line in text.lines().filter(|line| !line.is_empty()) {
            if let Some(name) = line.strip_prefix('[') {
                let name = name.strip_suffix(']')?.to_owned();
                recording.answers.push((name, Record::default()));
                continue;
            }
            let (word, rest) = line.split_once(' ')?;
            match (recording.answers.last_mut(), word) {
                (Some((_, record)), _) => {
                    let values = rest.split(' ').map(str::to_owned).collect();
                    record.0.push((word.to_owned(), values));
                }
                (None, "revision") => recording.revision = rest.parse().ok()?,
                (None, "arithmetic") => rest.clone_into(&mut recording.arithmetic),
                (None, _) => return None,
            }
        }
        Some(recording)
    }
}
