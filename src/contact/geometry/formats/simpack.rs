//! Simpack's rail and wheel profiles, `.prr` and `.prw`.
//!
//! A header with the type, a spline block with settings `name = value`, and points between `point.begin` and
//! `point.end`, in any order and in any case. The settings are applied in the order of their numbers in the file:
//! shift, rotation, mirroring; lengths are divided by `units.len.f` per metre.

use std::f64::consts::TAU;

use crate::contact::geometry::formats::lines::{
    Comma, Held, comma_of, has_decimal_commas, held, keyword, lines, unreadable,
};
use crate::contact::geometry::formats::profile_file::ProfileFile;
use crate::contact::geometry::length_unit::LengthUnit;

#[derive(Debug, Clone, Default)]
struct SimpackSettings {
    wheel: Option<bool>,
    in_spline: bool,
    shift: [f64; 2],
    rotate: f64,
    /// Allowed range of y and of z; not applied if the lower bound is not below the upper one.
    bounds: [[f64; 2]; 2],
    mirror: [bool; 2],
    per_metre: Option<f64>,
    unit: Option<LengthUnit>,
    per_radian: Option<f64>,
    /// Name of another file that holds the points.
    file: Option<String>,
}

/// Reads the points; their weights are ignored.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let mut settings = SimpackSettings::default();
    let mut points: Vec<[f64; 2]> = Vec::new();
    let lines = lines(text)?;
    let comma = comma_of(&lines);
    let mut in_points = false;
    let mut blocks = 0;
    for line in &lines {
        let word = line.bare.split_whitespace().next().unwrap_or_default();
        match word.to_ascii_lowercase().as_str() {
            "" => {}
            "point.begin" if blocks > 0 => {
                return Err(format!(
                    "line {}: a second block of points begins; one cross-section is needed",
                    line.place
                ));
            }
            "point.begin" => in_points = true,
            "point.end" => (in_points, blocks) = (false, blocks + 1),
            "spline.begin" => settings.in_spline = true,
            "spline.end" => settings.in_spline = false,
            _ if in_points => {
                let mixed = comma == Comma::Separator && has_decimal_commas(&line.bare);
                match held(&line.bare, comma) {
                    Held::Row(numbers) if !mixed => points.push([numbers[0], numbers[1]]),
                    _ => {
                        let needed = "a point y, z with an optional weight";
                        return Err(unreadable(line, needed, comma));
                    }
                }
            }
            _ => {
                if let Some((name, value)) = keyword(line) {
                    settings
                        .take(&name, &value)
                        .ok_or_else(|| unreadable(line, "a number", comma))?;
                }
            }
        }
    }
    match settings.file.take() {
        Some(file) if points.is_empty() => Err(format!(
            "the points are in another file, {}: send its text, with the format columns if it holds columns of y and z",
            file.chars().take(100).collect::<String>()
        )),
        _ if in_points => Err("point.end is missing: the text ends within its points".to_owned()),
        _ if blocks == 0 => Err("no block from point.begin to point.end found".to_owned()),
        _ => settings.apply(points),
    }
}

impl SimpackSettings {
    /// Stores one setting; `None` if a known setting has no valid number.
    fn take(&mut self, name: &str, value: &str) -> Option<()> {
        let number = || match held(&format!("0 {value}"), Comma::Separator) {
            Held::Row(numbers) => Some(numbers[1]),
            _ => None,
        };
        let flag = || number().map(|number| number != 0.0);
        match name {
            "type" if !self.in_spline => self.wheel = Some(flag()?),
            "shift.y" => self.shift[0] = number()?,
            "shift.z" => self.shift[1] = number()?,
            "rotate" => self.rotate = number()?,
            "bound.y.min" => self.bounds[0][0] = number()?,
            "bound.y.max" => self.bounds[0][1] = number()?,
            "bound.z.min" => self.bounds[1][0] = number()?,
            "bound.z.max" => self.bounds[1][1] = number()?,
            "mirror.y" => self.mirror[0] = flag()?,
            "mirror.z" => self.mirror[1] = flag()?,
            "units.len" => self.unit = LengthUnit::named(value),
            "units.len.f" => self.per_metre = Some(number().filter(|f| *f > 0.0)?),
            "units.ang.f" => self.per_radian = Some(number().filter(|f| *f > 0.0)?),
            "file" if value != "-" && !value.is_empty() => self.file = Some(value.to_owned()),
            _ => {}
        }
        Some(())
    }

    fn apply(&self, mut points: Vec<[f64; 2]>) -> Result<ProfileFile, String> {
        let angle = self.rotate / self.per_radian.unwrap_or(1.0);
        if angle.abs() > TAU {
            return Err(format!(
                "a rotation of {angle} rad is more than a whole turn"
            ));
        }
        let (sin, cos) = angle.sin_cos();
        for point in &mut points {
            let [y, z] = [point[0] + self.shift[0], point[1] + self.shift[1]];
            *point = [cos * y - sin * z, sin * y + cos * z];
        }
        points.retain(|point| {
            let within = |k: usize| {
                let [low, high] = self.bounds[k];
                low >= high || (low..=high).contains(&point[k])
            };
            within(0) && within(1)
        });
        let unit_mm = self.per_metre.map(|per_metre| 1000.0 / per_metre);
        let unit_mm = unit_mm.or(self.unit.map(LengthUnit::mm));
        let mm = unit_mm.unwrap_or(1.0);
        let scale = self.mirror.map(|mirror| if mirror { -mm } else { mm });
        for point in &mut points {
            *point = [point[0] * scale[0], point[1] * scale[1]];
        }
        Ok(ProfileFile {
            points,
            unit_mm,
            // After the file's own mirroring, y is positive to the field side and z down.
            mirror_y: Some(false),
            mirror_z: Some(false),
            wheel: self.wheel,
            ..ProfileFile::default()
        })
    }
}
