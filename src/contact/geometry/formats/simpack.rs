//! Simpack's rail and wheel profiles, `.prr` and `.prw`.
//!
//! A header with the type, a spline block with settings `name = value`, and points between `point.begin` and
//! `point.end`. What starts with `!` is a remark. The settings are applied in the order of their numbers in the file:
//! shift, rotation, mirroring; lengths are divided by `units.len.f` per metre.

use std::f64::consts::TAU;

use crate::contact::geometry::formats::profile_file::{ProfileFile, numbers, unreadable};

#[derive(Debug, Clone, Copy)]
struct SimpackSettings {
    wheel: Option<bool>,
    in_spline: bool,
    shift: [f64; 2],
    rotate: f64,
    /// Allowed range of y and of z; not applied if the lower bound exceeds the upper one.
    bounds: [[f64; 2]; 2],
    mirror: [bool; 2],
    per_metre: f64,
    per_radian: f64,
}

/// Reads the points; their weights are ignored.
pub(crate) fn read(text: &str) -> Result<ProfileFile, String> {
    let mut settings = SimpackSettings {
        wheel: None,
        in_spline: false,
        shift: [0.0; 2],
        rotate: 0.0,
        bounds: [[1.0, 0.0]; 2],
        mirror: [false; 2],
        per_metre: 1000.0,
        per_radian: 1.0,
    };
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut in_points = false;
    let mut ended = false;
    for (k, line) in text.lines().enumerate() {
        let line = line.split('!').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        match line {
            "point.begin" => in_points = true,
            "point.end" => (in_points, ended) = (false, true),
            "spline.begin" => settings.in_spline = true,
            "spline.end" => settings.in_spline = false,
            _ if in_points => match numbers(line).as_deref() {
                Some([y, z] | [y, z, _]) => points.push([*y, *z]),
                _ => return Err(unreadable(k, line, "a point y, z with an optional weight")),
            },
            _ => {
                if let Some((name, value)) = line.split_once('=') {
                    settings
                        .take(name.trim(), value.trim())
                        .ok_or_else(|| unreadable(k, line, "a number"))?;
                }
            }
        }
    }
    if !ended {
        return Err("no block from point.begin to point.end found".to_owned());
    }
    settings.apply(points)
}

impl SimpackSettings {
    /// Stores one setting; `None` if a known setting has no valid number.
    fn take(&mut self, name: &str, value: &str) -> Option<()> {
        let number = || {
            value
                .parse::<f64>()
                .ok()
                .filter(|number| number.is_finite())
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
            "units.len.f" => self.per_metre = number().filter(|f| *f > 0.0)?,
            "units.ang.f" => self.per_radian = number().filter(|f| *f > 0.0)?,
            _ => {}
        }
        Some(())
    }

    fn apply(&self, mut points: Vec<[f64; 2]>) -> Result<ProfileFile, String> {
        let angle = self.rotate / self.per_radian;
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
        let scale =
            [0, 1].map(|k| 1000.0 / self.per_metre * if self.mirror[k] { -1.0 } else { 1.0 });
        for point in &mut points {
            *point = [point[0] * scale[0], point[1] * scale[1]];
        }
        Ok(ProfileFile {
            points,
            // After the file's own mirroring, y is positive to the field side and z down.
            mirror_y: Some(false),
            mirror_z: Some(false),
            wheel: self.wheel,
        })
    }
}
