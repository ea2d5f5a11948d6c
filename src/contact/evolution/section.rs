//! Sections that wear: points that move along their normals.
//!
//! Points are `[y, z]` in mm, y to the field side and z down, in the order of a [`Profile`]. A point represents the part of the section up to the
//! middles of the chords to its neighbours.

use crate::geometry::plane_curve::arc_lengths;
use crate::geometry::profile::{Body, POINT_SPACING, Profile};
use crate::numerics::roots::bounds;

/// Samples the curve of a profile at points at most [`POINT_SPACING`] apart.
pub(crate) fn sampled(profile: &Profile) -> Vec<[f64; 2]> {
    let places = profile.parameters(POINT_SPACING).into_iter();
    let points = places.map(|s| profile.at(s).at);
    points.map(|[y, z]| [y, -z]).collect()
}

/// Length that each point represents.
pub(crate) fn lengths(points: &[[f64; 2]]) -> Vec<f64> {
    let along = arc_lengths(points);
    let last = along.len() - 1;
    let length = |k: usize| 0.5 * (along[(k + 1).min(last)] - along[k.saturating_sub(1)]);
    (0..=last).map(length).collect()
}

/// Depths of the areas at all points.
pub(crate) fn depths(points: &[[f64; 2]], areas: &[f64]) -> Vec<f64> {
    let lengths = lengths(points);
    let depths = areas.iter().zip(lengths);
    depths.map(|(area, length)| area / length).collect()
}

/// Adds values times a factor.
pub(crate) fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    let pairs = to.iter_mut().zip(from);
    pairs.for_each(|(to, from)| *to += factor * from);
}

/// Sign of z into the body.
fn inward(body: Body) -> f64 {
    match body {
        Body::Rail => 1.0,
        Body::Wheel => -1.0,
    }
}

/// Unit normals into the body.
fn normals(body: Body, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let last = points.len() - 1;
    let normal = |k: usize| {
        let (before, after) = (points[k.saturating_sub(1)], points[(k + 1).min(last)]);
        let [y, z] = [after[0] - before[0], after[1] - before[1]];
        let length = inward(body) * y.hypot(z);
        [-z / length, y / length]
    };
    (0..=last).map(normal).collect()
}

/// Area between a section and a later one with as many points, positive where material is gone.
pub(crate) fn area_between(body: Body, before: &[[f64; 2]], after: &[[f64; 2]]) -> f64 {
    let cross = |a: &[f64; 2], b: &[f64; 2]| a[0] * b[1] - b[0] * a[1];
    let last = before.len() - 1;
    // Differences of parts are exactly 0 where the sections are equal.
    let part = |k: usize| cross(&before[k], &before[k + 1]) - cross(&after[k], &after[k + 1]);
    let ends = cross(&before[last], &after[last]) - cross(&before[0], &after[0]);
    inward(body) * 0.5 * ((0..last).map(part).sum::<f64>() + ends)
}

/// Moves points along their normals so that the section loses the sum of `areas`, given in mm² for each point. Returns the points and the
/// displacement of each into the body in mm.
///
/// A convex section is shorter below its surface. The depths are therefore larger than areas over lengths, by half of the depth times the curvature.
/// The factor is found from the outlines.
pub(crate) fn moved(body: Body, points: &[[f64; 2]], areas: &[f64]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let wanted: f64 = areas.iter().sum();
    let normals = normals(body, points);
    let mut depth = depths(points, areas);
    let by = |depth: &[f64]| {
        let parts = points.iter().zip(&normals).zip(depth);
        let moved = parts.map(|((at, normal), depth)| [0, 1].map(|k| at[k] + depth * normal[k]));
        moved.collect::<Vec<[f64; 2]>>()
    };
    let mut after = by(&depth);
    // Two corrections leave an error of the third order in depth times curvature.
    for _ in 0..2 {
        let found = area_between(body, points, &after);
        if wanted > 0.0 && found > 0.0 {
            depth.iter_mut().for_each(|depth| *depth *= wanted / found);
            after = by(&depth);
        }
    }
    (after, depth)
}

/// Spreads areas along the section by a kernel of this standard deviation in mm. Their sum is preserved.
pub(crate) fn smoothed(areas: &[f64], deviation: f64) -> Vec<f64> {
    // One pass with the weights ¼, ½, ¼ has the variance of half the square of the spacing. The last pass has smaller weights.
    let passes = 2.0 * (deviation / POINT_SPACING).powi(2);
    let mut areas = areas.to_vec();
    for k in 0..passes.ceil() as usize {
        let share = 0.25 * (passes - k as f64).min(1.0);
        let flow = areas.windows(2).map(|pair| share * (pair[1] - pair[0]));
        let flow: Vec<f64> = flow.collect();
        for (k, flow) in flow.into_iter().enumerate() {
            areas[k] += flow;
            areas[k + 1] -= flow;
        }
    }
    areas
}

/// Largest cut along a normal in mm.
const CUT_MAX: f64 = 20.0;

/// Cuts a section to a target section. The target is first shifted in z into the body until it is nowhere outside, and then by `depth` mm more.
///
/// The shift is measured where the present section is less steep than 70°. Every point outside the shifted target is cut along its normal.
pub(crate) fn machined(
    body: Body,
    points: &[[f64; 2]],
    target: &[[f64; 2]],
    depth: f64,
) -> Vec<[f64; 2]> {
    let sign = inward(body);
    let normals = normals(body, points);
    let steep = 70_f64.to_radians().cos();
    let pairs = points.iter().zip(&normals);
    let flat = pairs.filter(|(_, normal)| normal[1].abs() >= steep);
    let outside = flat.filter_map(|(at, _)| Some(sign * (at[1] - height_at(target, at[0])?)));
    let by = bounds(outside)[1] + depth;
    if by == f64::NEG_INFINITY {
        return points.to_vec();
    }
    let target: Vec<[f64; 2]> = target.iter().map(|[y, z]| [*y, z + sign * by]).collect();
    let cut = |(at, normal): (&[f64; 2], &[f64; 2])| {
        let along = |by: f64| [0, 1].map(|k| at[k] + by * normal[k]);
        let found = distance(&target, along(-CUT_MAX), *normal).map(|ahead| ahead - CUT_MAX);
        let cut = found.filter(|cut| (0.0..CUT_MAX).contains(cut));
        cut.map_or(*at, along)
    };
    points.iter().zip(&normals).map(cut).collect()
}

/// z of a section at y, on the first chord that contains it.
fn height_at(points: &[[f64; 2]], y: f64) -> Option<f64> {
    let mut pairs = points.windows(2).map(|pair| (pair[0], pair[1]));
    let (from, to) = pairs.find(|(from, to)| from[0] <= y && y <= to[0])?;
    let width = to[0] - from[0];
    let t = if width > 0.0 {
        (y - from[0]) / width
    } else {
        0.0
    };
    Some(from[1] + t * (to[1] - from[1]))
}

/// Distance in mm from a point to the section in the direction of a unit vector, to the nearest intersection ahead.
pub(crate) fn distance(points: &[[f64; 2]], from: [f64; 2], direction: [f64; 2]) -> Option<f64> {
    let seen = |at: &[f64; 2]| {
        let ([y, z], [dy, dz]) = ([at[0] - from[0], at[1] - from[1]], direction);
        [y * dy + z * dz, z * dy - y * dz]
    };
    let crossings = points.windows(2).filter_map(|pair| {
        let ([near, left], [far, right]) = (seen(&pair[0]), seen(&pair[1]));
        let crosses = (left <= 0.0) != (right <= 0.0);
        crosses.then(|| near + (far - near) * left / (left - right))
    });
    let ahead = crossings.filter(|ahead| *ahead > 0.0);
    ahead.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius: f64, count: usize) -> Vec<[f64; 2]> {
        let angle = |k: usize| -1.2 + 2.4 * k as f64 / (count - 1) as f64;
        let at = |k| [radius * angle(k).sin(), radius * (1.0 - angle(k).cos())];
        (0..count).map(at).collect()
    }

    #[test]
    fn a_cylinder_under_uniform_wear_stays_one_and_loses_the_area() {
        for (body, sign) in [(Body::Rail, 1.0), (Body::Wheel, -1.0)] {
            // A rail with its top at z = 0, a wheel with its lowest point there.
            let points: Vec<[f64; 2]> =
                arc(30.0, 400).iter().map(|[y, z]| [*y, sign * z]).collect();
            let areas: Vec<f64> = lengths(&points).iter().map(|length| 0.5 * length).collect();
            let (after, _) = moved(body, &points, &areas);
            let radii = after.iter().map(|[y, z]| y.hypot(z - sign * 30.0));
            let (least, most) = radii.fold((f64::INFINITY, 0.0_f64), |(least, most), radius| {
                (least.min(radius), most.max(radius))
            });
            assert!(
                most - least < 2e-3 && (most - 29.5).abs() < 0.01,
                "{least} {most}"
            );
            let wanted: f64 = areas.iter().sum();
            let lost = area_between(body, &points, &after);
            assert!((lost / wanted - 1.0).abs() < 1e-5, "{lost} {wanted}");
        }
    }

    #[test]
    fn smoothing_keeps_the_area_and_has_the_variance_it_says() {
        let mut areas = vec![0.0; 101];
        areas[50] = 2.0;
        let spread = smoothed(&areas, 0.6);
        let sum: f64 = spread.iter().sum();
        let variance = |(k, area): (usize, &f64)| area * (0.25 * (k as f64 - 50.0)).powi(2);
        let variance: f64 = spread.iter().enumerate().map(variance).sum();
        assert!(
            (sum - 2.0).abs() < 1e-12 && (variance / sum - 0.36).abs() < 1e-3,
            "{variance}"
        );
    }

    #[test]
    fn grinding_never_adds_material_and_leaves_the_target_shape() {
        let worn: Vec<[f64; 2]> = arc(30.0, 200).iter().map(|[y, z]| [*y, z + 0.2]).collect();
        let target = arc(28.0, 200);
        let ground = machined(Body::Rail, &worn, &target, 0.1);
        assert!(
            ground
                .iter()
                .zip(&worn)
                .all(|(after, before)| after[1] >= before[1])
        );
        let middle = ground.iter().position(|at| at[0] > 0.0).expect("a middle");
        assert!(
            (ground[middle][1] - 0.3).abs() < 1e-3,
            "{:?}",
            ground[middle]
        );
    }

    #[test]
    fn a_cut_runs_out_on_steep_faces_without_a_step() {
        let angles = (0..400).map(|k| -1.5 + 3.0 * f64::from(k) / 399.0);
        let points: Vec<[f64; 2]> = angles
            .map(|angle| [30.0 * angle.sin(), 30.0 * (1.0 - angle.cos())])
            .collect();
        let ground = machined(Body::Rail, &points, &points, 0.3);
        let cut = |k: usize| (ground[k][0] - points[k][0]).hypot(ground[k][1] - points[k][1]);
        assert!((cut(200) - 0.3).abs() < 1e-3, "{}", cut(200));
        for (k, at) in points.iter().enumerate().take(395).skip(5) {
            let (before, here) = (cut(k - 1), cut(k));
            assert!(
                (here - before).abs() < 0.01,
                "{at:?}: {here} after {before}"
            );
        }
    }

    #[test]
    fn distances_are_those_to_the_first_crossing() {
        let points = arc(30.0, 400);
        let down = distance(&points, [0.0, -10.0], [0.0, 1.0]).expect("below");
        assert!((down - 10.0).abs() < 1e-3);
        assert_eq!(distance(&points, [60.0, -10.0], [0.0, 1.0]), None);
    }
}
