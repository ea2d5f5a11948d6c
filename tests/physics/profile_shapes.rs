//! Cross-sections written from the standards' published definitions in mm, with y to the field side and z down.

/// Returns wheel S1002 (EN 13715, annex B: polynomials of the tread, arcs of the flange), for -69.9 <= y <= 60.
pub fn s1002() -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    let mut y = -69.9_f64;
    while y <= 60.0 {
        points.push([y, s1002_depth(y)]);
        y += if y < -62.0 { 0.1 } else { 0.25 };
    }
    points
}

fn s1002_depth(y: f64) -> f64 {
    const TREAD: [f64; 9] = [
        0.0,
        -3.358_537_058e-2,
        1.565_681_624e-3,
        -2.810_427_944e-5,
        5.844_240_864e-8,
        -1.562_379_023e-8,
        5.309_217_349e-15,
        -5.957_839_843e-12,
        2.646_656_573e-13,
    ];
    const ROOT: [f64; 8] = [
        -4.320_221_063e3,
        -1.038_384_026e3,
        -1.065_501_873e2,
        -6.051_367_875,
        -2.054_332_446e-1,
        -4.169_739_389e-3,
        -4.687_195_829e-5,
        -2.252_755_540e-7,
    ];
    let polynomial = |factors: &[f64]| {
        factors
            .iter()
            .rev()
            .fold(0.0, |sum, factor| sum * y + factor)
    };
    let arc = |centre: [f64; 2], radius: f64| {
        centre[1] + (radius * radius - (y - centre[0]).powi(2)).sqrt()
    };
    match y {
        _ if y >= 32.157_96 => 1.364_323_640 - 0.066_666_667 * y,
        _ if y >= -26.0 => polynomial(&TREAD),
        _ if y >= -35.0 => polynomial(&ROOT),
        _ if y >= -38.426_669_071 => 16.446 - (13.0_f64.powi(2) - (y + 26.210_665).powi(2)).sqrt(),
        _ if y >= -39.764_473_993 => -93.576_667_419 - 2.747_477_419 * y,
        _ if y >= -49.662_510_381 => arc([-58.558_326_413, 8.834_924_130], 20.0),
        _ if y >= -62.764_705_882 => arc([-55.0, 16.0], 12.0),
        _ => arc([-49.5, 9.519_259_302], 20.5),
    }
}

/// Returns the head of the rail 60E1 (EN 13674-1), 72 mm wide, with its origin in the middle of its top. Its arcs of 300, 80 and 13 mm meet at half
/// widths of 10.25 and 26.05 mm, with centres 0, 7.70 and 23.015 mm from the middle. Its sides are inclined 1:20.
pub fn rail_60e1() -> Vec<[f64; 2]> {
    rail_head([
        (300.0, 0.0, 10.25),
        (80.0, 7.70, 26.05),
        (13.0, 23.015, 23.015 + 13.0 / 1.0025_f64.sqrt()),
    ])
}

/// Returns a head with sides inclined 1:20. Each arc has its radius, the distance of its centre from the middle and the half width at which it ends.
pub fn rail_head(arcs: [(f64, f64, f64); 3]) -> Vec<[f64; 2]> {
    let mut half = vec![[0.0, 0.0]];
    for (radius, centre, until) in arcs {
        let [from, depth] = half[half.len() - 1];
        let angle = |y: f64| ((y - centre) / radius).asin();
        let centre_depth = depth + radius * angle(from).cos();
        let (first, last) = (angle(from), angle(until));
        let count = (radius * (last - first) / 0.25).ceil();
        half.extend((1..=count as usize).map(|k| {
            let angle = first + (last - first) * k as f64 / count;
            [
                centre + radius * angle.sin(),
                centre_depth - radius * angle.cos(),
            ]
        }));
    }
    let [y, z] = half[half.len() - 1];
    half.extend((1..=40).map(|k| [y + 0.025 * f64::from(k), z + 0.5 * f64::from(k)]));
    let mirrored = half.iter().skip(1).rev().map(|[y, z]| [-y, *z]);
    mirrored.chain(half.iter().copied()).collect()
}
