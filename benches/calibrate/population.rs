//! Random contacts of eight classes for checking the error estimate, the same on every machine.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::profile_shapes::{rail_60e1, rail_head, s1002};
use crate::random::Random;

/// Class of contacts by the source of region and pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Hertz's ellipse with a/b from 1/20 to 20.
    Ellipse,
    /// Smooth pressures on a grid.
    Smooth,
    /// Pressures with a hole, or with a narrow ridge that is cut off.
    Jump,
    /// Crowns of arcs, quartics, two parabolas, skew parabolas and blended radii, as profiles and as grids.
    Gap,
    /// S1002 on 60E1, shifted and yawed, on planes of contact.
    Profiles,
    /// New and worn wheels on new and worn rails, on the tread, at gauge corner and flange, on the curve of the rail.
    Curve,
    /// Crowned rollers, much wider than long: rounded ends, logarithmic crowns and large crown radii, some of them tilted.
    Roller,
    /// Worn, flat-topped and kinked crowns.
    Uneven,
}

impl Class {
    /// Returns the name in the file of reference results and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Class::Ellipse => "ellipse",
            Class::Smooth => "smooth",
            Class::Jump => "jump",
            Class::Gap => "gap",
            Class::Profiles => "profiles",
            Class::Curve => "curve",
            Class::Roller => "roller",
            Class::Uneven => "uneven",
        }
    }

    /// Returns whether the contacts are wheels on rails, whose patches have separate estimates.
    pub fn is_wheel(self) -> bool {
        matches!(self, Class::Profiles | Class::Curve)
    }

    /// Returns the number of cases. The first half is for fitting, the second for checking.
    pub fn count(self) -> usize {
        match self {
            Class::Ellipse => 400,
            Class::Smooth => 320,
            Class::Jump => 80,
            Class::Gap => 200,
            Class::Profiles => 96,
            Class::Curve => 120,
            Class::Roller | Class::Uneven => 80,
        }
    }
}

/// Returns case `number` of a class, without a solver.
pub fn case(class: Class, number: usize) -> Value {
    let seed = 20_261_121 + 1_000_003 * (class as u64 + 1) + number as u64;
    let random = &mut Random(seed.wrapping_mul(0x2545_F491));
    let setting = Setting::new(random);
    match class {
        Class::Ellipse => ellipse(&setting, random),
        Class::Smooth | Class::Jump => pressures(class, &setting, random),
        Class::Gap => gap(&setting, random),
        Class::Profiles => profiles(&setting, random),
        Class::Curve => curve(&setting, random),
        Class::Roller => roller(&setting, random),
        Class::Uneven => uneven(&setting, random),
    }
}

/// Sets planes of contact if the reference results of a class were computed on them.
pub fn on_planes(class: Class, case: &mut Value) {
    if class == Class::Profiles {
        case["contact"]["reference_surface"] = "plane".into();
    }
}

/// Material and friction.
struct Setting {
    poisson: f64,
    friction: f64,
}

const MODULUS: f64 = 82_000.0;

impl Setting {
    fn new(random: &mut Random) -> Setting {
        Setting {
            poisson: if random.below(5) == 0 {
                random.between(0.0, 0.5)
            } else {
                random.between(0.2, 0.35)
            },
            friction: random.between(0.05, 0.6),
        }
    }

    fn case(&self, contact: Value, motion: Value) -> Value {
        json!({
            "material": { "shear_modulus_mpa": MODULUS, "poisson_ratio": self.poisson },
            "friction": { "coefficient": self.friction },
            "contact": contact,
            "motion": motion,
            "outputs": ["resultants"],
        })
    }

    /// Returns creepages and spin for a patch with c = √(A/π) under a load, in practical proportions.
    fn motion(&self, c: f64, force: f64, random: &mut Random) -> Value {
        let unit = self.friction * force * (1.0 - self.poisson) / (2.0 * MODULUS * c * c);
        let (x, y, spin) = match random.below(20) {
            0 | 1 => (true, false, false),
            2 | 3 => (false, true, false),
            4..=7 => (false, false, true),
            8..=11 => (true, false, true),
            12..=14 => (false, true, true),
            15..=18 => (true, true, true),
            _ => (true, true, false),
        };
        let mut part = |moves: bool, low: f64, high: f64| {
            let size = random.decades(low, high) * random.sign();
            if moves { size } else { 0.0 }
        };
        json!({
            "creepage_x": unit * part(x, 0.1, 6.0),
            "creepage_y": unit * part(y, 0.1, 6.0),
            "spin_per_mm": unit / c * part(spin, 0.1, 60.0),
        })
    }

    /// Returns an approximation of √(ab) of the Hertz contact of two radii.
    fn hertz(&self, force: f64, radii: [f64; 2]) -> f64 {
        let radius = (radii[0] * radii[1]).sqrt();
        (0.75 * force * radius * (1.0 - self.poisson) / MODULUS).cbrt()
    }
}

fn ellipse(setting: &Setting, random: &mut Random) -> Value {
    let ratio = random.decades(0.05, 20.0);
    let (c, force) = (5.0, 60_000.0);
    let [a, b] = [c * ratio.sqrt(), c / ratio.sqrt()];
    let contact = json!({ "type": "ellipse", "a_mm": a, "b_mm": b });
    let mut case = setting.case(contact, setting.motion(c, force, random));
    case["load"] = json!({ "normal_force_n": force });
    case
}

fn pressures(class: Class, setting: &Setting, random: &mut Random) -> Value {
    let c = 5.0;
    let ratio = random.decades(0.2, 5.0).sqrt();
    let counts = [12 + random.below(29), 12 + random.below(29)];
    let lens = |x: f64, y: f64| (1.0 - x * x - y * y).max(0.0);
    let shape = random.below(if class == Class::Smooth { 4 } else { 2 });
    let (bend, power) = (random.between(0.1, 0.4), random.between(0.5, 1.5));
    let apart = random.between(0.2, 0.8);
    let (hole, at) = (random.between(0.15, 0.4), random.between(-0.4, 0.4));
    let narrow = random.between(8.0, 40.0);
    let pressure = |x: f64, y: f64| match (class, shape) {
        (Class::Smooth, 0) => lens(x, y).sqrt(),
        (Class::Smooth, 1) => lens(x * (1.0 + bend * y), y).sqrt(),
        (Class::Smooth, 2) => lens(x, y).powf(power),
        (Class::Smooth, _) => {
            let half = 0.5 * (1.0 - 0.5 * apart);
            lens(x / 0.8, (y - 0.5 * apart) / half)
                .max(0.6 * lens(x / 0.6, (y + 0.5 * apart) / half))
                .sqrt()
        }
        (_, 0) if (x - at).hypot(y) < hole => 0.0,
        (_, 0) => lens(x, y).sqrt(),
        _ => (1.0 - x * x).max(0.0) * (-narrow * y * y).exp(),
    };
    let [a, b] = [c * ratio, c / ratio];
    let places = |half: f64, count: usize| -> Vec<f64> {
        let step = 2.6 * half / (count - 1) as f64;
        (0..count).map(|k| k as f64 * step - 1.3 * half).collect()
    };
    let (xs, ys) = (places(a, counts[0]), places(b, counts[1]));
    let force = 60_000.0;
    let largest = 1.5 * force / (PI * a * b);
    let rows: Vec<Vec<f64>> = ys
        .iter()
        .map(|y| {
            xs.iter()
                .map(|x| largest * pressure(x / a, y / b))
                .collect()
        })
        .collect();
    let contact = json!({ "type": "pressure_grid", "x_mm": xs, "y_mm": ys, "pressure_mpa": rows });
    setting.case(contact, setting.motion(c, force, random))
}

/// Returns a crown under a wheel.
fn gap(setting: &Setting, random: &mut Random) -> Value {
    let rolling = random.decades(160.0, 1000.0);
    let force = random.decades(5_000.0, 160_000.0);
    let step = 0.25;
    let places: Vec<f64> = (0..=240).map(|k| f64::from(k) * step - 30.0).collect();
    let mut radius = random.decades(40.0, 500.0);
    let heights: Vec<f64> = match random.below(5) {
        0 => {
            let borders = [random.between(-6.0, -1.0), 0.0, random.between(1.0, 6.0)];
            let radii = [0; 4].map(|_| random.decades(20.0, 400.0));
            radius = radii[1];
            curved(&places, |y| {
                1.0 / radii[borders.iter().filter(|border| y > **border).count()]
            })
        }
        1 => {
            let fourth = random.decades(1e-7, 3e-5);
            places
                .iter()
                .map(|y| 0.5 * y * y / radius + fourth * y.powi(4))
                .collect()
        }
        2 => {
            let (half, other) = (random.between(1.0, 7.0), random.decades(20.0, 300.0));
            let offset = random.between(0.0, 0.02);
            let two = |y: &f64| {
                (0.5 * (y - half).powi(2) / radius).min(0.5 * (y + half).powi(2) / other + offset)
            };
            places.iter().map(two).collect()
        }
        3 => {
            let skew = random.between(-0.6, 0.6);
            curved(&places, |y| (1.0 + skew * (0.3 * y).tanh()) / radius)
        }
        _ => {
            let (small, at) = (random.decades(13.0, 80.0), random.between(-5.0, 5.0));
            let width = random.between(0.5, 3.0);
            curved(&places, |y| {
                let part = 0.5 * (1.0 + ((y - at) / width).tanh());
                (1.0 - part) / radius + part / small
            })
        }
    };
    let c = setting.hertz(force, [rolling, radius]);
    let motion = setting.motion(c, force, random);
    let contact = if random.below(10) < 3 {
        let skew = random.between(-0.3, 0.3);
        let half = 2.0 * (0.75 * force * rolling * (1.0 - setting.poisson) / MODULUS).cbrt() + 4.0;
        let along: Vec<f64> = (0..81)
            .map(|k| half * (f64::from(k) / 40.0 - 1.0))
            .collect();
        let rows: Vec<Vec<f64>> = places
            .iter()
            .zip(&heights)
            .map(|(y, height)| {
                let over = |x: &f64| height + 0.5 * (x + skew * y).powi(2) / rolling;
                along.iter().map(over).collect()
            })
            .collect();
        json!({ "type": "gap_grid", "x_mm": along, "y_mm": places, "gap_mm": rows })
    } else {
        json!({ "type": "gap_profile", "rolling_mm": rolling, "y_mm": places, "gap_mm": heights })
    };
    let mut case = setting.case(contact, motion);
    case["load"] = json!({ "normal_force_n": force });
    case
}

/// Returns a crowned roller on a plane.
fn roller(setting: &Setting, random: &mut Random) -> Value {
    let rolling = random.decades(6.0, 300.0);
    let half = random.decades(1.5, 12.0);
    let along = random.decades(0.03, 0.35) * half.min(0.4 * rolling);
    let modulus = MODULUS / (1.0 - setting.poisson);
    // The load per mm of a cylinder with this half-length of the contact.
    let load = 0.25 * PI * modulus * along * along / rolling;
    let force = 2.0 * half * load;
    let straight = half * random.between(0.3, 1.1);
    let ends = random.decades(0.4, 40.0) * half;
    let crown = random.decades(30.0, 3000.0) * half;
    let depth = load / (PI * modulus) * random.decades(0.4, 2.5);
    let tilt = if random.below(3) == 0 {
        random.between(-3e-5, 3e-5)
    } else {
        0.0
    };
    let kind = random.below(3);
    let rounded = |y: f64| 0.5 * (y.abs() - straight).max(0.0).powi(2) / ends;
    // Lundberg's profile, continued by its tangent before its pole.
    let logarithmic = |y: f64| {
        let (part, last) = ((y / (1.25 * half)).powi(2), 0.98);
        let beyond = (part - last).max(0.0) / (1.0 - last);
        depth * (beyond - (1.0 - part.min(last)).ln())
    };
    let places: Vec<f64> = (-180..=180).map(|k| f64::from(k) * half / 82.0).collect();
    let height = |y: &f64| {
        let shape = match kind {
            0 => rounded(*y),
            1 => logarithmic(*y),
            _ => rounded(*y) + 0.5 * y * y / crown,
        };
        shape + tilt * y
    };
    let heights: Vec<f64> = places.iter().map(height).collect();
    let contact = json!({
        "type": "gap_profile", "rolling_mm": rolling, "y_mm": places, "gap_mm": heights,
    });
    let motion = setting.motion((along * half).sqrt(), force, random);
    let mut case = setting.case(contact, motion);
    case["load"] = json!({ "normal_force_n": force });
    case
}

/// Returns a crown with waves of wear, with a flat top, or with kinks.
fn uneven(setting: &Setting, random: &mut Random) -> Value {
    let radii @ [rolling, across] = [0; 2].map(|_| random.decades(20.0, 900.0));
    let c = random.decades(1.0, 7.0).min(0.15 * rolling.min(across));
    let force = c.powi(3) * MODULUS / (0.75 * (1.0 - setting.poisson) * (rolling * across).sqrt());
    let half = c * (across / rolling).powf(0.3);
    let depth = c * c / (radii[0] * radii[1]).sqrt();
    let places: Vec<f64> = (-160..=160)
        .map(|k| f64::from(k) * 6.0 * half / 160.0)
        .collect();
    let kind = random.below(3);
    let waves = [0; 3].map(|_| {
        let length = random.decades(0.5, 5.0) * half;
        let height = depth * random.decades(0.02, 0.25) * (0.5 * length / half).min(1.0);
        (height, 2.0 * PI / length, random.between(0.0, 6.3))
    });
    let (power, top) = (random.between(2.5, 8.0), half * random.between(0.6, 1.3));
    let (kink, slope) = (
        half * random.between(0.2, 1.2),
        depth / half * random.decades(0.1, 1.5),
    );
    let crown = across * random.decades(1.0, 10.0);
    let height = |y: &f64| match kind {
        0 => {
            let worn =
                |(height, number, phase): &(f64, f64, f64)| height * (number * y + phase).cos();
            0.5 * y * y / across + waves.iter().map(worn).sum::<f64>()
        }
        1 => depth * ((y / top).abs().powf(power).min(30.0) + 1e-4 * (y / half).powi(2)),
        _ => 0.5 * y * y / crown + slope * (y.abs() - kink).max(0.0),
    };
    let heights: Vec<f64> = places.iter().map(height).collect();
    let contact = json!({
        "type": "gap_profile", "rolling_mm": rolling, "y_mm": places, "gap_mm": heights,
    });
    let mut case = setting.case(contact, setting.motion(c, force, random));
    case["load"] = json!({ "normal_force_n": force });
    case
}

/// Returns heights of a given curvature with a minimum of 0 at y = 0, by integrating twice in small steps.
fn curved(places: &[f64], curvature: impl Fn(f64) -> f64) -> Vec<f64> {
    const PARTS: u32 = 50;
    let height = |end: &f64| {
        let step = end / f64::from(PARTS * 4);
        let (mut slope, mut height) = (0.0, 0.0);
        for k in 0..PARTS * 4 {
            let bend = curvature((f64::from(k) + 0.5) * step);
            height += step * (slope + 0.5 * step * bend);
            slope += step * bend;
        }
        height
    };
    places.iter().map(height).collect()
}

/// Returns a wheelset displaced on its track.
fn profiles(setting: &Setting, random: &mut Random) -> Value {
    let contact = json!({
        "type": "profiles", "rail": { "points_mm": rail_60e1() },
        "wheel": { "points_mm": s1002() }, "side": "right",
        "rolling_radius_mm": 460, "gauge_mm": 1435, "gauge_height_mm": 14, "cant_rad": 0.025,
        "flange_back_distance_mm": 1360, "flange_back_position_mm": -70,
        "lateral_shift_mm": random.between(-6.0, 5.0),
        "yaw_rad": random.between(-0.02, 0.02),
    });
    let force = random.decades(20_000.0, 120_000.0);
    let motion = setting.motion(setting.hertz(force, [460.0, 300.0]), force, random);
    let mut case = setting.case(contact, motion);
    case["load"] = json!({ "vertical_force_n": force });
    case
}

/// Returns a wheel on a rail. The wheel may have worn hollow, and the rail may have worn to other radii.
fn curve(setting: &Setting, random: &mut Random) -> Value {
    let mut rail = rail_head([
        (300.0, 0.0, 10.25),
        (80.0, 7.70, 26.05),
        (13.0, 23.015, 23.015 + FACE * 13.0),
    ]);
    let mut wheel = s1002();
    if random.below(2) == 0 {
        let radii = [(150.0, 600.0), (40.0, 150.0), (9.0, 25.0)];
        rail = rail_of_arcs(radii.map(|(low, high)| random.decades(low, high)));
    }
    if random.below(2) == 0 {
        let (depth, middle) = (random.between(0.1, 0.6), random.between(-15.0, 10.0));
        let width = random.between(12.0, 25.0);
        for [y, z] in &mut wheel {
            *z -= depth * (-((*y - middle) / width).powi(2)).exp();
        }
    }
    let shift = match random.below(3) {
        0 => random.between(-3.0, 5.0),
        1 => random.between(-5.9, -3.0),
        _ => random.between(-7.0, -5.9),
    };
    let contact = json!({
        "type": "profiles", "rail": { "points_mm": rail }, "wheel": { "points_mm": wheel },
        "side": "right", "rolling_radius_mm": 460, "gauge_mm": 1435, "gauge_height_mm": 14, "cant_rad": 0.025,
        "flange_back_distance_mm": 1360, "flange_back_position_mm": -70, "accept_rough_profiles": true,
        "reference_surface": "curve", "lateral_shift_mm": shift, "yaw_rad": random.between(-0.02, 0.02),
    });
    let force = random.decades(20_000.0, 140_000.0);
    let motion = match random.below(2) {
        0 => setting.motion(setting.hertz(force, [460.0, 300.0]), force, random),
        _ => json!({ "wheelset": {
            "speed_mm_per_s": 20_000, "free_rolling_radius_mm": 460.0 + random.between(-3.0, 3.0),
        } }),
    };
    let mut case = setting.case(contact, motion);
    case["load"] = json!({ "vertical_force_n": force });
    // The error due to the factors for the curvature follows from the pressures.
    case["outputs"] = json!(["resultants", "pressure"]);
    case
}

/// Sine of the angle between the horizontal and a side inclined 1:20.
const FACE: f64 = 0.998_752_338_877_845_2;

/// Returns a head with arcs of other radii than 60E1, tangent to each other at the same half widths.
fn rail_of_arcs([crown, shoulder, corner]: [f64; 3]) -> Vec<[f64; 2]> {
    let second = 10.25 * (1.0 - shoulder / crown);
    let third = 26.05 - corner * (26.05 - second) / shoulder;
    rail_head([
        (crown, 0.0, 10.25),
        (shoulder, second, 26.05),
        (corner, third, third + FACE * corner),
    ])
}
