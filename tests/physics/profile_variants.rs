//! Sections of wheels and rails as instruments, drawings and programs give them: more or less of the section, with every orientation, order, spacing
//! and format.

use serde_json::{Value, json};

use crate::profile_shapes::{rail_60e1, s1002};

pub type Points = Vec<[f64; 2]>;

/// A section with y to the field side and z down. Its contact on the tread is that of the base.
pub struct Variant {
    pub name: &'static str,
    pub points: Points,
    /// Whether the shape shows its orientation, so that no statement is needed.
    pub clear: bool,
    /// y of the back of its flange, if the points show it.
    pub back: Option<f64>,
}

/// Returns evenly spaced points on a straight line, without its first point.
fn line(from: [f64; 2], to: [f64; 2]) -> Points {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let count = (length / 0.25).ceil();
    let at = |k: usize| [0, 1].map(|i| from[i] + (to[i] - from[i]) * k as f64 / count);
    (1..=count as usize).map(at).collect()
}

/// Returns the points with further ones along these corners.
fn extended(mut points: Points, corners: &[[f64; 2]]) -> Points {
    for corner in corners {
        points.extend(line(points[points.len() - 1], *corner));
    }
    points
}

fn before(points: Points, corners: &[[f64; 2]]) -> Points {
    let reversed: Points = points.into_iter().rev().collect();
    let mut whole = extended(reversed, corners);
    whole.reverse();
    whole
}

fn between(points: Points, from: f64, to: f64) -> Points {
    let kept = points.into_iter();
    kept.filter(|at| (from..=to).contains(&at[0])).collect()
}

/// A chamfer and the face of a rim, up to 33 mm above the tread.
const RIM: [[f64; 2]; 2] = [[65.0, -7.6], [65.2, -33.0]];
/// A chamfer, the face of a rim and the inner side of the rim.
const WHOLE_RIM: [[f64; 2]; 3] = [[65.0, -7.6], [65.2, -60.0], [50.0, -72.0]];
/// The back of the flange, up to 30 mm above the tread.
const BACK: [[f64; 2]; 2] = [[-70.0, 9.6], [-70.0, -30.0]];

/// Returns wheels with tread and root of S1002 and more or less of the rest.
pub fn wheels() -> Vec<Variant> {
    let variant = |(name, points): (&'static str, Points), clear, back: bool| Variant {
        name,
        points,
        clear,
        back: back.then_some(-70.0),
    };
    let whole = with_back().into_iter().map(|v| variant(v, true, true));
    let parts = parts_of_flange()
        .into_iter()
        .map(|v| variant(v, true, false));
    let unclear = without_flange()
        .into_iter()
        .map(|v| variant(v, false, false));
    whole.chain(parts).chain(unclear).collect()
}

fn with_back() -> [(&'static str, Points); 8] {
    let wheel = s1002();
    // The wheel is worn by 4 mm at the face of its flange, but not at its root.
    let thin = |[y, z]: &[f64; 2]| {
        let worn = ((z - 6.0) / 10.0).clamp(0.0, 1.0) * ((y + 60.0) / 20.0).clamp(0.0, 1.0);
        [y - 4.0 * worn, *z]
    };
    let high = |[y, z]: &[f64; 2]| [*y, z + 0.4 * (z - 8.0).max(0.0)];
    let high: Points = wheel.iter().map(high).collect();
    let rim = extended(wheel.clone(), &RIM);
    [
        ("with its whole rim", extended(wheel.clone(), &WHOLE_RIM)),
        ("with its back", before(wheel.clone(), &BACK)),
        ("with back and rim", before(rim.clone(), &BACK)),
        ("with its rim", rim),
        ("half of the tread", between(wheel.clone(), -70.0, 30.0)),
        ("thin flange", wheel.iter().map(thin).collect()),
        ("high flange with rim", extended(high, &RIM)),
        ("as defined", wheel),
    ]
}

fn parts_of_flange() -> [(&'static str, Points); 2] {
    [
        ("to the tip", between(s1002(), -58.0, 60.0)),
        ("to the face", between(s1002(), -44.0, 60.0)),
    ]
}

fn without_flange() -> [(&'static str, Points); 4] {
    let tread = between(s1002(), -27.0, 60.0);
    let flangeless = |y: f64| [y, -y / 40.0 - 0.08 * (y.abs() - 20.0).max(0.0).powi(2)];
    let roller: Points = (-60..=60).map(|k| flangeless(0.5 * f64::from(k))).collect();
    let rims = before(
        extended(roller.clone(), &[[30.2, -40.0]]),
        &[[-30.2, -40.0]],
    );
    [
        ("tread with rim", extended(tread.clone(), &RIM)),
        ("tread only", tread),
        ("flangeless", roller),
        ("flangeless with rims", rims),
    ]
}

/// Returns 60E1 with more or less of its section. The case gives the inclination.
pub fn rails() -> Vec<Variant> {
    let rail = rail_60e1();
    let variant = |name, points, clear| Variant {
        name,
        points,
        clear,
        back: None,
    };
    let foot = [
        [37.0, 36.0],
        [9.0, 50.0],
        [8.25, 110.0],
        [20.0, 122.0],
        [60.0, 128.0],
        [60.0, 140.0],
    ];
    let mirrored: Vec<[f64; 2]> = foot.iter().map(|[y, z]| [-y, *z]).collect();
    // A groove of 40 mm with a lip that ends 16 mm below the top of the rail.
    let lip = [
        [-38.0, 45.0],
        [-52.0, 50.0],
        [-68.0, 46.0],
        [-77.0, 25.0],
        [-79.0, 17.0],
        [-82.0, 16.0],
        [-105.0, 16.0],
    ];
    // A groove with a flat bottom and a keeper that ends 4 mm below the top of the rail.
    let keeper = [
        [-38.0, 43.0],
        [-46.0, 47.0],
        [-68.0, 47.0],
        [-76.0, 43.0],
        [-78.0, 6.0],
        [-80.0, 4.0],
        [-101.0, 4.0],
        [-103.0, 6.0],
        [-103.0, 40.0],
    ];
    vec![
        variant("as defined", rail.clone(), true),
        variant("with a keeper", before(rail.clone(), &keeper), true),
        variant(
            "with its foot",
            before(extended(rail.clone(), &foot), &mirrored),
            true,
        ),
        variant("inner half", between(rail.clone(), -40.0, 12.0), true),
        variant("with a lip", before(rail.clone(), &lip), true),
        variant(
            "inner half with a lip",
            before(between(rail, -40.0, 22.0), &lip),
            true,
        ),
    ]
}

/// The form in which a section is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    Points,
    Columns,
    Miniprof,
    /// A Simpack file with settings that undo the mirroring.
    Simpack,
}

#[derive(Debug, Clone, Copy)]
pub struct Encoding {
    pub mirror_y: bool,
    pub mirror_z: bool,
    pub reversed: bool,
    /// Shift of the origin in mm.
    pub origin: [f64; 2],
    /// One point in this number of points is kept.
    pub every: usize,
    pub form: Form,
}

impl Encoding {
    pub const PLAIN: Encoding = Encoding {
        mirror_y: false,
        mirror_z: false,
        reversed: false,
        origin: [0.0; 2],
        every: 1,
        form: Form::Points,
    };

    /// Returns the four combinations of mirroring.
    pub fn senses() -> impl Iterator<Item = Encoding> {
        [(false, false), (true, false), (false, true), (true, true)]
            .into_iter()
            .map(|(mirror_y, mirror_z)| Encoding {
                mirror_y,
                mirror_z,
                ..Encoding::PLAIN
            })
    }

    pub fn section(&self, points: &[[f64; 2]]) -> Value {
        let sign = |mirrored: bool| if mirrored { -1.0 } else { 1.0 };
        let signs = [sign(self.mirror_y), sign(self.mirror_z)];
        let given = |at: &[f64; 2]| [0, 1].map(|k| signs[k] * (at[k] + self.origin[k]));
        let mut given: Points = points.iter().step_by(self.every).map(given).collect();
        if self.reversed {
            given.reverse();
        }
        let row = |[y, z]: &[f64; 2]| format!("{y:.6} {z:.6}\n");
        let rows: String = given.iter().map(row).collect();
        let flag = u8::from;
        let (format, text) = match self.form {
            Form::Points => return json!({ "points_mm": given }),
            Form::Columns => ("columns", rows),
            Form::Miniprof => (
                "miniprof",
                format!(
                    "ProgramName=test\nXYPoints={}\nColumnDef=X,Y\n\n{rows}",
                    given.len()
                ),
            ),
            Form::Simpack => (
                "simpack",
                format!(
                    "header.begin\nversion = 1\nheader.end\nspline.begin\nmirror.y = {}\nmirror.z = {}\nunits.len.f = 1000\npoint.begin\n{rows}\
                     point.end\nspline.end\n",
                    flag(self.mirror_y),
                    flag(self.mirror_z)
                ),
            ),
        };
        json!({ "format": format, "text": text })
    }

    /// Returns the section with its orientation stated.
    pub fn stated(&self, points: &[[f64; 2]]) -> Value {
        let mut section = self.section(points);
        let undone = self.form == Form::Simpack;
        section["mirror_y"] = json!(self.mirror_y && !undone);
        section["mirror_z"] = json!(self.mirror_z && !undone);
        section
    }
}
