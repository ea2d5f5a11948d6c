//! Damaged profiles: sound pairs of rail and wheel, the damage by measuring and exporting, and the remarks of the answer.

use std::f64::consts::TAU;

use railhead_contact::case::solver::Limits;
use railhead_contact::geometry::formats::{Format, read};
use railhead_contact::geometry::profile::{Body, Profile, Reading};
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::profile_reference_files::reference_file;
use crate::profile_shapes::{rail_60e1, s1002};
use crate::random::Random;

/// Points of one cross-section, with y to the field side and z down.
pub type Points = Vec<[f64; 2]>;

/// A rail and a wheel without damage.
#[derive(Clone)]
pub struct Pair {
    pub rail: Points,
    pub wheel: Points,
    pub placement: Value,
    /// Lateral shifts in mm, between which positions are drawn at random.
    pub shifts: [f64; 2],
}

/// A position of a wheelset on a pair.
pub struct Place {
    pub case: Value,
    /// Solution of the case with sound profiles.
    pub sound: Solution,
    /// Positions of the main patch on the rail and wheel profiles in mm.
    pub at: [[f64; 2]; 2],
}

/// A kind of damage to the points.
#[derive(Debug, Clone, Copy)]
pub enum Damage {
    /// Points with this spacing.
    Coarse(f64),
    /// No points over this length.
    Hole(f64),
    /// Chords of this length, resampled linearly.
    Polygon(f64),
    /// Coordinates rounded to multiples of this.
    Rounded(f64),
    /// White noise with this standard deviation.
    Noise(f64),
    /// One point off by this distance.
    Outlier(f64),
    /// All points on one side raised by this height.
    Step(f64),
    /// Waves with this amplitude and wavelength.
    Waves(f64, f64),
}

impl Damage {
    /// Names of the kinds.
    pub const NAMES: [&'static str; Damage::KINDS] = [
        "coarse", "hole", "polygon", "rounded", "noise", "outlier", "step", "waves",
    ];

    /// Returns a random damage of a kind, from harmless to severe.
    pub fn random(kind: usize, random: &mut Random) -> Damage {
        match kind {
            0 => Damage::Coarse(random.decades(0.5, 10.0)),
            1 => Damage::Hole(random.decades(1.0, 50.0)),
            2 => Damage::Polygon(random.decades(0.25, 2.5)),
            3 => Damage::Rounded([0.001, 0.01][random.below(2)]),
            4 => Damage::Noise(random.decades(2e-5, 2e-2)),
            5 => Damage::Outlier(random.decades(5e-4, 0.2)),
            6 => Damage::Step(random.decades(5e-4, 0.05)),
            _ => {
                let length = random.decades(1.0, 4.0);
                Damage::Waves(random.decades(1e-4, 2e-2), length)
            }
        }
    }

    /// Number of kinds.
    pub const KINDS: usize = 8;

    /// Returns the points with the damage at or near a place.
    pub fn done_to(self, points: &[[f64; 2]], at: [f64; 2], random: &mut Random) -> Points {
        let even = |step: f64| resampled(points, step);
        let nearest = |points: &[[f64; 2]]| {
            let far = |p: &[f64; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
            let places = 0..points.len();
            places
                .min_by(|a, b| far(&points[*a]).total_cmp(&far(&points[*b])))
                .expect("points")
        };
        match self {
            Damage::Coarse(step) => even(step),
            Damage::Hole(length) => {
                let points = even(0.25);
                let off = random.between(-0.5, 0.5) * length;
                let middle = nearest(&points) as f64 + off / 0.25;
                let half = 0.5 * length / 0.25;
                let kept =
                    |k: usize| (k as f64 - middle).abs() > half || k < 8 || k + 8 > points.len();
                (0..points.len())
                    .filter(|k| kept(*k))
                    .map(|k| points[k])
                    .collect()
            }
            Damage::Polygon(chord) => linear(&even(chord), 5000),
            Damage::Rounded(step) => {
                let round = |v: f64| (v / step).round() * step;
                even(0.25).into_iter().map(|p| p.map(round)).collect()
            }
            Damage::Noise(deviation) => off_normal(&even(0.25), |_, _| deviation * normal(random)),
            Damage::Outlier(height) => {
                let points = even(0.25);
                let place = nearest(&points) as f64 + random.between(-8.0, 8.0);
                let sign = random.sign();
                off_normal(&points, |k, _| {
                    if k == place as usize {
                        sign * height
                    } else {
                        0.0
                    }
                })
            }
            Damage::Step(height) => {
                let points = even(0.25);
                let place = nearest(&points) as f64 + random.between(-8.0, 8.0);
                let sign = random.sign();
                off_normal(
                    &points,
                    |k, _| {
                        if k as f64 > place { sign * height } else { 0.0 }
                    },
                )
            }
            Damage::Waves(amplitude, length) => {
                let phase = random.between(0.0, TAU);
                off_normal(&even(0.25), |_, s| {
                    amplitude * (TAU * s / length + phase).sin()
                })
            }
        }
    }
}

pub fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * (1.0 - random.part()).ln()).sqrt();
    radius * (TAU * random.part()).cos()
}

fn curve(points: &[[f64; 2]]) -> Profile {
    let reading = Reading {
        mirror_y: Some(false),
        mirror_z: Some(false),
        smoothing: 0.0,
    };
    Profile::new(Body::Rail, points, reading).expect("a sound profile")
}

/// Returns true points at equal distances.
pub fn resampled(points: &[[f64; 2]], step: f64) -> Points {
    let curve = curve(points);
    let places = curve.parameters(step);
    places
        .into_iter()
        .map(|s| curve.at(s).at)
        .map(|[y, z]| [y, -z])
        .collect()
}

/// Returns `count` points at equal distances on the chords.
pub fn linear(points: &[[f64; 2]], count: usize) -> Points {
    let mut along = vec![0.0];
    for pair in points.windows(2) {
        let chord = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        along.push(along[along.len() - 1] + chord);
    }
    let length = along[along.len() - 1];
    (0..count)
        .map(|k| {
            let s = length * k as f64 / (count - 1) as f64;
            let i = along
                .partition_point(|knot| *knot <= s)
                .clamp(1, points.len() - 1);
            let t = (s - along[i - 1]) / (along[i] - along[i - 1]);
            [0, 1].map(|part| points[i - 1][part] * (1.0 - t) + points[i][part] * t)
        })
        .collect()
}

/// Returns the points moved along the normal of their curve by a function of number and length.
pub fn off_normal(points: &[[f64; 2]], mut by: impl FnMut(usize, f64) -> f64) -> Points {
    let mut along = 0.0;
    (0..points.len())
        .map(|k| {
            let (a, b) = (
                points[k.saturating_sub(1)],
                points[(k + 1).min(points.len() - 1)],
            );
            let [y, z] = [b[0] - a[0], b[1] - a[1]];
            let length = y.hypot(z);
            if k > 0 {
                along += (points[k][0] - points[k - 1][0]).hypot(points[k][1] - points[k - 1][1]);
            }
            let h = by(k, along);
            [points[k][0] + h * z / length, points[k][1] - h * y / length]
        })
        .collect()
}

/// Returns a profile with smooth wear, each mark with its place, width and depth.
fn worn(points: &[[f64; 2]], marks: &[[f64; 3]]) -> Points {
    let points = resampled(points, 0.2);
    off_normal(&points.clone(), |k, _| {
        let y = points[k][0];
        let mark = |[at, width, depth]: &[f64; 3]| depth * (-((y - at) / width).powi(2)).exp();
        -marks.iter().map(mark).sum::<f64>()
    })
}

fn placed(cant: f64) -> Value {
    json!({
        "type": "profiles", "side": "right", "rolling_radius_mm": 460, "gauge_mm": 1435,
        "gauge_height_mm": 14, "cant_rad": cant, "flange_back_distance_mm": 1360,
        "flange_back_position_mm": -70,
    })
}

/// Returns pairs on which no threshold was chosen, with other wear and other inclinations.
pub fn held_out() -> Vec<Pair> {
    let pair = |rail, wheel, cant, shifts| Pair {
        rail,
        wheel,
        placement: placed(cant),
        shifts,
    };
    vec![
        pair(
            // 60E1 and S1002, both worn.
            worn(&rail_60e1(), &[[-24.0, 9.0, 0.6], [2.0, 16.0, 0.35]]),
            worn(&s1002(), &[[-4.0, 22.0, 0.5], [-33.0, 9.0, 0.4]]),
            0.025,
            [-7.0, 7.0],
        ),
        pair(
            // 60E1 without inclination, S1002 worn hollow.
            rail_60e1(),
            worn(&s1002(), &[[3.0, 15.0, 0.9]]),
            0.0,
            [-6.0, 6.0],
        ),
        pair(
            // 60E1 inclined 1:20 and worn, S1002.
            worn(&rail_60e1(), &[[-15.0, 12.0, 0.3]]),
            s1002(),
            0.05,
            [-7.0, 6.0],
        ),
    ]
}

/// Returns pairs on which the thresholds were chosen, with the benchmark's if its files are available.
pub fn tuned_on() -> Vec<Pair> {
    let mut pairs = vec![Pair {
        rail: rail_60e1(),
        wheel: s1002(),
        placement: placed(0.025),
        shifts: [-7.0, 6.0],
    }];
    let file = |name: &str| {
        let contents = read(Format::Simpack, &reference_file(name)?);
        Some(contents.expect("a file of the reference").points)
    };
    let rail = file("profiles/MBench_UIC60_v3.prr");
    if let (Some(rail), Some(wheel)) = (rail, file("profiles/MBench_S1002_v3.prw")) {
        pairs.push(Pair {
            rail,
            wheel,
            placement: placed(0.0),
            shifts: [-8.0, 8.0],
        });
    }
    pairs
}

impl Pair {
    /// Returns a random position in which the sound pair has an answer.
    pub fn place(&self, random: &mut Random) -> Option<Place> {
        let mut contact = self.placement.clone();
        let members = contact.as_object_mut().expect("an object");
        let [low, high] = self.shifts;
        members.insert("lateral_shift_mm".into(), json!(random.between(low, high)));
        members.insert("yaw_rad".into(), json!(random.between(-0.004, 0.004)));
        let case = json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": contact,
            "load": { "vertical_force_n": random.between(4e4, 1.2e5) },
            "motion": { "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": random.between(459.0, 461.0) } },
            "solver": { "target_error": 0.02 },
            "outputs": ["resultants"],
        });
        let sound = answer(&with(&case, &self.rail, &self.wheel, 0.0))?;
        let mut place = Place {
            case,
            sound,
            at: [[0.0; 2]; 2],
        };
        let main = place
            .sound
            .patches
            .iter()
            .max_by(|a, b| a.normal_force_n.total_cmp(&b.normal_force_n))?;
        let position = main.position?;
        place.at = [position.rail_mm, position.wheel_mm];
        Some(place)
    }
}

/// Returns the case with these points.
pub fn with(
    case: &Value,
    rail: &[[f64; 2]],
    wheel: &[[f64; 2]],
    smoothing: impl Into<Value>,
) -> Value {
    let smoothing = smoothing.into();
    let mut case = case.clone();
    let section = |points: &[[f64; 2]]| json!({ "points_mm": points, "mirror_y": false, "mirror_z": false, "smoothing_mm": smoothing.clone() });
    case["contact"]["rail"] = section(rail);
    case["contact"]["wheel"] = section(wheel);
    case
}

/// Returns the answer, if there is one.
pub fn answer(case: &Value) -> Option<Solution> {
    let checked = check(case, &Limits::default()).ok()?;
    solve(&checked, &Unmonitored)
        .ok()
        .map(|(solution, _)| solution)
}

/// Codes of remarks that blame a profile, or the place of the contact on it.
const BLAMES: [&str; 9] = [
    "profile-outlier",
    "profile-step",
    "profile-polygon",
    "profile-noise",
    "profile-waves",
    "profile-spacing",
    "profile-hole",
    "contact-on-flange-tip",
    "contact-at-profile-end",
];

/// Returns the codes of the remarks that blame a profile.
pub fn blamed(solution: &Solution) -> Vec<String> {
    let codes = solution.remarks.iter().map(|remark| remark.code.clone());
    codes
        .filter(|code| BLAMES.contains(&code.as_str()))
        .collect()
}

/// Returns the largest pressure of all patches in MPa.
pub fn pressure_max(solution: &Solution) -> f64 {
    let all = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    all.fold(0.0, f64::max)
}
