//! Tests a generated wheel that is worn to the shape of its rail. Tread and gauge corner touch side by side, inclined to each other by about half a
//! radian, where two overlaps may or may not share a gap.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::geometry::wheel_rail::WheelRail;
use railhead_contact::normal::footprint::NormalTask;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::profile_cases::{generated, on_planes, put};
use crate::profile_worn::{solved, worn};

/// A place where a worn wheel comes nearest to the rail: its distance from the middle of the rail, the radius of the clearance and the smallest
/// clearance, all in mm.
type Lobe = (f64, f64, f64);

/// Lobes on tread and gauge corner, 17 mm apart.
const LOBES: [Lobe; 2] = [(-12.0, 500.0, 0.0), (-29.3, 30.0, 0.0)];
/// Difference in mm below which the clearances of two lobes blend.
const BLEND: f64 = 0.01;
/// Part of the rail's head that the wheel follows, in mm from its middle. Beyond it, the gauge face is too steep to be a height over y.
const FOLLOWED: [f64; 2] = [-35.3, 30.0];
/// Depth in mm of the flange's tip below the tread, and slope of the flange.
const TIP: f64 = 28.0;
const FLANGE_SLOPE: f64 = 2.5;

/// Returns the height in mm of the worn wheel over the rail, `y` mm from the middle of the rail.
fn clearance(lobes: &[Lobe], y: f64) -> f64 {
    let of = |(middle, radius, least): &Lobe| (y - middle).powi(2) / (2.0 * radius) + least;
    let sum: f64 = lobes.iter().map(|lobe| (-of(lobe) / BLEND).exp()).sum();
    // Far from all lobes the sum vanishes, and the nearest lobe determines the clearance.
    let least = lobes.iter().map(of).fold(f64::INFINITY, f64::min);
    if sum > 1e-200 {
        -BLEND * sum.ln()
    } else {
        least
    }
}

/// Returns the placed wheel and rail of a case.
fn geometry(case: &Value) -> WheelRail {
    let checked = check(case, &Limits::default()).expect("a case");
    let NormalTask::Wheel(contact) = &checked.problem.task else {
        unreachable!("profiles were given")
    };
    contact.geometry.clone()
}

/// Returns the points of the wheel, with z down: the rail's shape plus the clearance, then a straight flange with its tip.
fn worn_wheel(case: &Value, lobes: &[Lobe]) -> Vec<[f64; 2]> {
    let geometry = geometry(case);
    let sign = geometry.placement.side.sign();
    let [rail, wheel] = geometry.parameters(0.1);
    // A wheel without yaw and roll differs from its profile by a shift and the sign of z.
    let middle = wheel[wheel.len() / 2];
    let at = geometry.lowest(middle).expect("no yaw");
    let own = geometry.on_wheel(middle);
    let shift = [sign * at[1] - own[0], at[2] + own[1]];
    let head: Vec<[f64; 2]> = rail
        .iter()
        .map(|s| geometry.rail_at(*s).at)
        .map(|[y, z]| [sign * y, z])
        .collect();
    let top = head.iter().map(|at| at[0]);
    let centre =
        0.5 * (top.clone().fold(f64::INFINITY, f64::min) + top.fold(f64::NEG_INFINITY, f64::max));
    let mut points: Vec<[f64; 2]> = head
        .into_iter()
        .filter(|[y, _]| (FOLLOWED[0]..=FOLLOWED[1]).contains(&(y - centre)))
        .map(|[y, z]| [y - shift[0], -(z + clearance(lobes, y - centre) - shift[1])])
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let level = points[points.len() / 2][1];
    points.iter_mut().for_each(|at| at[1] -= level);
    let [corner, depth] = points[0];
    let down = |k: u32| {
        [
            corner - 0.2 * f64::from(k),
            depth + 0.2 * FLANGE_SLOPE * f64::from(k),
        ]
    };
    let flange: Vec<[f64; 2]> = (1..).map(down).take_while(|at| at[1] < TIP).collect();
    let tip = flange.last().expect("a flange")[0];
    let back = |k: u32| [tip - 0.2 * f64::from(k), TIP - f64::from(k).powi(2) * 0.004];
    let back = (1..=50).map(back);
    points.extend(flange.into_iter().chain(back));
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

/// Returns the worn wheel on a new rail 60E1, in the position in which it was worn.
pub fn conforming() -> Value {
    worn_with(&LOBES)
}

fn worn_with(lobes: &[Lobe]) -> Value {
    let case = generated();
    let wheel = worn_wheel(&case, lobes);
    let back = wheel[0][0];
    put(
        &case,
        "contact",
        json!({ "wheel": { "points_mm": wheel }, "flange_back_position_mm": back.min(-70.0) }),
    )
}

/// Returns the largest second difference of a sequence of values, relative to the values. A jump appears in it in full.
fn bend(values: &[f64]) -> f64 {
    let bend = |w: &[f64]| ((w[2] - 2.0 * w[1] + w[0]) / w[1]).abs();
    values.windows(3).map(bend).fold(0.0, f64::max)
}

fn peak(solution: &Solution) -> f64 {
    let peaks = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    peaks.fold(0.0, f64::max)
}

/// Returns the pairs of these tests: generated ones, and measured ones if the reference files are available.
fn pairs() -> Vec<(&'static str, Value)> {
    let shifted = |shift: f64| {
        put(
            &generated(),
            "contact",
            json!({ "lateral_shift_mm": shift }),
        )
    };
    let mut pairs = vec![
        ("conforming", conforming()),
        ("two points", shifted(-5.4)),
        ("one", shifted(-6.0)),
    ];
    for (shift, yaw) in [(-14.7, 0.005), (-14.74, 0.0), (-14.0, 0.0)] {
        pairs.extend(worn(shift, 100e3, yaw).map(|case| ("worn", case)));
    }
    pairs
}

#[test]
fn forces_rise_smoothly_as_the_wheel_is_lowered() {
    for (name, case) in pairs() {
        let (mut forces, mut peaks) = (Vec::new(), Vec::new());
        for k in 0..=46 {
            let mut case = case.clone();
            case["load"] = json!({ "approach_mm": 0.056 + 0.002 * f64::from(k) });
            case["solver"] = json!({ "target_error": 0.005 });
            let solution = solved(&case).expect("an answer");
            let each = solution.patches.iter().map(|patch| patch.normal_force_n);
            forces.push(each.sum::<f64>());
            peaks.push(peak(&solution));
        }
        let rising = forces.windows(2).all(|pair| pair[1] > pair[0]);
        assert!(rising, "{name}: {forces:?}");
        // A power 3/2 has second differences of at most 1e-3 here, and the grids cause the rest. A patch that joins another gap causes 0.05.
        assert!(
            bend(&forces) < 0.008,
            "{name}: {} of {forces:?}",
            bend(&forces)
        );
        assert!(bend(&peaks) < 0.02, "{name}: {} of {peaks:?}", bend(&peaks));
    }
}

#[test]
fn forces_and_pressures_do_not_jump_with_the_load() {
    let mut pairs = vec![("conforming", conforming())];
    pairs.extend(worn(-14.7, 0.0, 0.005).map(|case| ("worn", case)));
    for (name, mut case) in pairs {
        case["motion"] = json!({ "creepage_x": 0.001, "spin_per_mm": 0.0003 });
        let (mut lateral, mut peaks) = (Vec::new(), Vec::new());
        for k in 0..=10 {
            case["load"] = json!({ "vertical_force_n": 100e3 + 5e3 * f64::from(k) });
            let solution = solved(&case).expect("an answer");
            lateral.push(solution.total[0].force_y_n);
            peaks.push(peak(&solution));
        }
        // Creepages also depend on the meshes of the tangential problem.
        assert!(bend(&lateral) < 0.015, "{name}: {lateral:?}");
        assert!(bend(&peaks) < 0.015, "{name}: {peaks:?}");
    }
}

/// Tests light to heavy loads with yaw: the wheel reaches equilibrium and carries its load however the two overlaps behave.
#[test]
fn a_wheel_on_two_patches_side_by_side_always_comes_to_rest() {
    let case = conforming();
    for force in [20e3, 60e3, 95e3, 140e3] {
        for (shift, yaw) in [(0.0, 0.0), (0.3, 0.005), (-0.2, -0.01)] {
            let mut case = put(
                &case,
                "contact",
                json!({ "lateral_shift_mm": shift, "yaw_rad": yaw, "accept_rough_profiles": true }),
            );
            case["load"] = json!({ "vertical_force_n": force });
            let solution = solved(&case).unwrap_or_else(|e| panic!("{force} {shift} {yaw}: {e}"));
            let vertical = -solution.total[0].force_z_n.expect("a vertical force");
            assert!(
                (vertical / force - 1.0).abs() < 1e-3,
                "{force} {shift} {yaw}: {vertical}"
            );
        }
    }
}

/// Lateral extent of a patch: its ends along the rail in mm, and the inclinations of the rail in rad.
struct Place {
    ends: [f64; 2],
    angle: f64,
    own_angle: f64,
    force: f64,
}

fn places(case: &Value, solution: &Solution) -> Vec<Place> {
    let geometry = geometry(case);
    let [rail, _] = geometry.parameters(0.02);
    let inclination = |y: f64, z: f64| {
        let apart = |s: &f64| {
            let at = geometry.rail_at(*s).at;
            (at[0] - y).hypot(at[1] - z)
        };
        let nearest = rail.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let [dy, dz] = geometry.rail_at(*nearest.expect("a rail")).slope;
        (dz / dy).atan()
    };
    let place = |patch: &railhead_contact::solution::words::answer::PatchSolution| {
        let position = patch.position.expect("a place");
        let [.., low, high] = patch.extent_mm;
        let [_, y, z] = position.track_mm;
        let (sin, cos) = position.contact_angle_rad.sin_cos();
        let along = y * cos + z * sin;
        Place {
            ends: [low + along, high + along],
            angle: position.contact_angle_rad,
            own_angle: inclination(y, z),
            force: patch.normal_force_n,
        }
    };
    solution.patches.iter().map(place).collect()
}

/// Tests tread and flange, 32 mm apart and inclined to each other by 0.6 rad. The gap between them is about 70 µm everywhere and carries at most one
/// or two percent of the load, on either plane.
#[test]
fn a_thin_overlap_between_two_places_does_not_put_them_into_one_plane() {
    let lateral: Vec<f64> = [0.0, 0.005, 0.02]
        .into_iter()
        .map(|lift| {
            let lobes = [
                (1.5, 600.0, 0.0),
                (-30.6, 40.0, 0.045),
                (-14.0, 2000.0, 0.066 + lift),
            ];
            let mut case = put(
                &on_planes(&worn_with(&lobes)),
                "contact",
                json!({ "accept_rough_profiles": true }),
            );
            case["load"] = json!({ "vertical_force_n": 100e3 });
            let solution = solved(&case).expect("an answer");
            let places = places(&case, &solution);
            let total: f64 = places.iter().map(|place| place.force).sum();
            for place in places.iter().filter(|place| place.force > 0.05 * total) {
                assert!(
                    (place.angle - place.own_angle).abs() < 0.03,
                    "{lift}: {} on a rail at {}",
                    place.angle,
                    place.own_angle
                );
            }
            assert!(places.iter().any(|place| place.own_angle.abs() > 0.45));
            solution.total[0].force_y_n
        })
        .collect();
    for other in &lateral[1..] {
        assert!((other / lateral[0] - 1.0).abs() < 0.08, "{lateral:?}");
    }
}

/// Tests random pairs and positions: neighbours in one plane are at most 12 mm apart, and no two differ by more than half a radian.
#[test]
fn patches_far_apart_or_inclined_to_each_other_never_share_a_plane() {
    let mut random = crate::random::Random(17);
    let mut shared = 0;
    for round in 0..24 {
        let base = if round % 2 == 0 {
            generated()
        } else {
            let lobes = [
                (random.between(-8.0, 6.0), random.decades(200.0, 900.0), 0.0),
                (
                    random.between(-32.0, -26.0),
                    random.decades(20.0, 60.0),
                    random.between(0.0, 0.06),
                ),
                (
                    random.between(-22.0, -10.0),
                    random.decades(100.0, 3000.0),
                    random.between(0.02, 0.12),
                ),
            ];
            worn_with(&lobes)
        };
        let shift = if round % 2 == 0 {
            random.between(-6.5, 1.0)
        } else {
            random.between(-0.3, 0.1)
        };
        let mut case = put(
            &base,
            "contact",
            json!({ "lateral_shift_mm": shift, "yaw_rad": random.between(-0.004, 0.004), "accept_rough_profiles": true }),
        );
        case["load"] = json!({ "vertical_force_n": random.decades(2e4, 1.5e5) });
        case["solver"] = json!({ "target_error": 0.02, "method": "fastsim" });
        let Ok(solution) = solved(&case) else {
            continue;
        };
        let places = places(&case, &solution);
        for pair in places.chunk_by(|a, b| (a.angle - b.angle).abs() < 1e-9) {
            shared += usize::from(pair.len() > 1);
            for (k, one) in pair.iter().enumerate() {
                let reached = pair[..=k]
                    .iter()
                    .map(|p| p.ends[1])
                    .fold(f64::MIN, f64::max);
                if let Some(next) = pair.get(k + 1) {
                    assert!(next.ends[0] - reached < 12.3, "{round}");
                }
                for other in &pair[k + 1..] {
                    let turned = (one.own_angle - other.own_angle).abs();
                    // The criterion is the mean inclination under the pressure on the curve, not the inclination at the load centres.
                    assert!(turned < 0.65, "{round}: {turned}");
                }
            }
        }
    }
    assert!(shared > 0);
}
