//! Kalker's coefficients of linear theory, the forces per creepage before anything slips.
//!
//! `F_x = G c² C11 ν_x`, `F_y = G c² C22 ν_y + G c³ C23 φ` and `M_z = −G c³ C23 ν_y + G c⁴ C33 φ` with `c = √(ab)` (Kalker 1990, §2.2.3). The values were
//! computed with the boundary element method at vanishing creepage on two meshes and extrapolated; `tests/physics/kalker_table.rs` computes them again and
//! compares. They agree with Kalker's printed table to its rounding, about 1 % for slender ellipses.

use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::numerics::interpolation;

/// Rows of the table: a/b from 1/32 to 32, two to an octave.
pub const RATIOS: usize = 21;
/// Columns of the table.
pub const POISSON_RATIOS: [f64; 5] = [0.0, 0.125, 0.25, 0.375, 0.5];

/// a/b of a row.
pub fn ratio(row: usize) -> f64 {
    (0.5 * (row as f64 - 0.5 * (RATIOS - 1) as f64)).exp2()
}

/// `[C11, C22, C23]` for semi-axes a along rolling and b across, and Poisson's ratio 0 to 0.5.
///
/// Between the entries `ln C` is a cubic in `ln a/b` and a quartic in ν, accurate to one part in a thousand. Beyond 1/32 and 32 the last entry is continued in
/// proportion to the asymptotes of slender ellipses.
pub fn coefficients(a_over_b: f64, poisson_ratio: f64) -> [f64; 3] {
    let inside = a_over_b.clamp(ratio(0), ratio(RATIOS - 1));
    let [c11, c22, c23, _] = coefficients_with_spin(inside, poisson_ratio);
    let mut found = [c11, c22, c23];
    if a_over_b.to_bits() != inside.to_bits() {
        let (here, edge) = (
            slender(a_over_b, poisson_ratio),
            slender(inside, poisson_ratio),
        );
        for k in 0..3 {
            found[k] *= here[k] / edge[k];
        }
    }
    found
}

/// `[C11, C22, C23, C33]` for a/b from 1/32 to 32, clamped, and Poisson's ratio 0 to 0.5; interpolated like [`coefficients`].
pub fn coefficients_with_spin(a_over_b: f64, poisson_ratio: f64) -> [f64; 4] {
    let (first, along, across) = places(a_over_b.clamp(ratio(0), ratio(RATIOS - 1)), poisson_ratio);
    let rows = &LOGARITHMS[first..first + 4];
    [0, 1, 2, 3].map(|k| {
        let of_row = |row: &[[f64; 5]; 4]| -> f64 {
            let entries = row[k].iter().zip(across);
            entries.map(|(ln, weight)| weight * ln).sum()
        };
        let rows = rows.iter().zip(along);
        rows.map(|(row, weight)| weight * of_row(row))
            .sum::<f64>()
            .exp()
    })
}

/// The logarithms of the entries of [`TABLE`] and [`SPIN`].
static LOGARITHMS: LazyLock<[[[f64; 5]; 4]; RATIOS]> = LazyLock::new(|| {
    std::array::from_fn(|row| {
        let [c11, c22, c23] = TABLE[row];
        [c11, c22, c23, SPIN[row]].map(|entries| entries.map(f64::ln))
    })
});

/// The first of four rows, the weights of these rows, and the weights of the columns.
fn places(inside: f64, poisson_ratio: f64) -> (usize, [f64; 4], [f64; 5]) {
    let place = 2.0 * inside.log2() + 0.5 * (RATIOS - 1) as f64;
    let first = (place.floor() as usize).clamp(1, RATIOS - 3) - 1;
    let along = interpolation::polynomial_weights(&[0.0, 1.0, 2.0, 3.0], place - first as f64);
    (
        first,
        along,
        interpolation::polynomial_weights(&POISSON_RATIOS, poisson_ratio),
    )
}

/// `[C11, C22, C23]` of very slender ellipses (Kalker 1967; Kalker 1990, table E3).
fn slender(a_over_b: f64, poisson_ratio: f64) -> [f64; 3] {
    let nu = poisson_ratio;
    if a_over_b < 1.0 {
        let g = a_over_b;
        let long = (16.0 / g).ln();
        return [
            0.25 * PI * PI / (1.0 - nu),
            0.25 * PI * PI,
            PI * g.sqrt() / (3.0 * (1.0 - nu)) * (1.0 + nu * (long - 5.0)),
        ];
    }
    let g = 1.0 / a_over_b;
    let long = (16.0 / (g * g)).ln();
    let x = long - 2.0 * nu;
    let y = (1.0 - nu) * long + 2.0 * nu;
    let spin = (1.0 - nu) * long - 2.0 + 4.0 * nu;
    let beside = 3.0 - 4.0_f64.ln();
    [
        2.0 * PI / (x * g) * (1.0 + beside / x),
        2.0 * PI / (g * y) * (1.0 + (1.0 - nu) * beside / y),
        2.0 * PI / (3.0 * g.powf(1.5) * spin),
    ]
}

/// `[[C11], [C22], [C23]]` at [`POISSON_RATIOS`] for each a/b.
const TABLE: [[[f64; 5]; 3]; RATIOS] = [
    [
        [2.47442, 2.82584, 3.29305, 3.94455, 4.91616],
        [2.47442, 2.47568, 2.47646, 2.47651, 2.47528],
        [0.18544, 0.24560, 0.32536, 0.43611, 0.60002],
    ],
    [
        [2.47959, 2.83027, 3.29569, 3.94313, 4.90534],
        [2.47959, 2.48183, 2.48340, 2.48390, 2.48261],
        [0.22080, 0.28215, 0.36323, 0.47522, 0.63968],
    ],
    [
        [2.48891, 2.83852, 3.30129, 3.94274, 4.89105],
        [2.48891, 2.49282, 2.49581, 2.49736, 2.49650],
        [0.26318, 0.32459, 0.40533, 0.51601, 0.67674],
    ],
    [
        [2.50424, 2.85219, 3.31099, 3.94355, 4.87159],
        [2.50424, 2.51091, 2.51641, 2.52008, 2.52068],
        [0.31419, 0.37431, 0.45276, 0.55917, 0.71137],
    ],
    [
        [2.52971, 2.87534, 3.32856, 3.94877, 4.84895],
        [2.52971, 2.54081, 2.55053, 2.55808, 2.56204],
        [0.37608, 0.43366, 0.50795, 0.60731, 0.74665],
    ],
    [
        [2.57096, 2.91350, 3.35928, 3.96308, 4.82679],
        [2.57096, 2.58895, 2.60550, 2.61973, 2.63012],
        [0.45214, 0.50619, 0.57489, 0.66501, 0.78824],
    ],
    [
        [2.63548, 2.97414, 3.41044, 3.99352, 4.81208],
        [2.63548, 2.66381, 2.69094, 2.71599, 2.73744],
        [0.54702, 0.59726, 0.65976, 0.73971, 0.84567],
    ],
    [
        [2.73411, 3.06840, 3.49365, 4.05255, 4.81942],
        [2.73411, 2.77738, 2.82027, 2.86195, 2.90105],
        [0.66803, 0.71528, 0.77244, 0.84322, 0.93352],
    ],
    [
        [2.88049, 3.21041, 3.62373, 4.15631, 4.86802],
        [2.88049, 2.94474, 3.01032, 3.07657, 3.14244],
        [0.82621, 0.87294, 0.92757, 0.99263, 1.07197],
    ],
    [
        [3.09221, 3.41870, 3.82066, 4.32736, 4.98541],
        [3.09221, 3.18513, 3.28245, 3.38396, 3.48915],
        [1.03878, 1.08970, 1.14727, 1.21320, 1.28995],
    ],
    [
        [3.39164, 3.71670, 4.10941, 4.59309, 5.20307],
        [3.39164, 3.52307, 3.66399, 3.81509, 3.97693],
        [1.33226, 1.39515, 1.46475, 1.54233, 1.62957],
    ],
    [
        [3.80649, 4.13343, 4.52088, 4.98715, 5.55872],
        [3.80649, 3.98896, 4.18894, 4.40880, 4.65122],
        [1.74734, 1.83432, 1.93020, 2.03634, 2.15440],
    ],
    [
        [4.37230, 4.70581, 5.09375, 5.55046, 6.09586],
        [4.37230, 4.62201, 4.90130, 5.21555, 5.57143],
        [2.34655, 2.47621, 2.62042, 2.78157, 2.96251],
    ],
    [
        [5.13321, 5.47944, 5.87535, 6.33237, 6.86579],
        [5.13321, 5.47108, 5.85610, 6.29874, 6.81271],
        [3.22474, 3.42542, 3.65201, 3.90962, 4.20468],
    ],
    [
        [6.15278, 6.51935, 6.93211, 7.40035, 7.93606],
        [6.15278, 6.60695, 7.13318, 7.74999, 8.48274],
        [4.53267, 4.84850, 5.21098, 5.63100, 6.12303],
    ],
    [
        [7.51011, 7.90637, 8.34662, 8.83863, 9.39215],
        [7.51011, 8.11785, 8.83238, 9.68446, 10.71784],
        [6.50046, 7.00020, 7.58265, 8.27001, 9.09302],
    ],
    [
        [9.30598, 9.74323, 10.22360, 10.75385, 11.34231],
        [9.30598, 10.11654, 11.08169, 12.25026, 13.69403],
        [9.47997, 10.27083, 11.20546, 12.32685, 13.69692],
    ],
    [
        [11.69558, 12.18780, 12.72334, 13.30823, 13.94977],
        [11.69558, 12.77668, 14.07799, 15.67439, 17.67895],
        [14.04796, 15.30145, 16.80060, 18.62541, 20.89478],
    ],
    [
        [14.85338, 15.41766, 16.02670, 16.68618, 17.40281],
        [14.85338, 16.29392, 18.04404, 20.21559, 22.98156],
        [21.06028, 23.04474, 25.44265, 28.39839, 32.13226],
    ],
    [
        [19.08941, 19.74791, 20.45356, 21.21170, 22.02853],
        [19.08941, 21.01567, 23.37435, 26.32946, 30.13982],
        [32.00779, 35.16294, 39.00865, 43.79961, 49.93323],
    ],
    [
        [24.67944, 25.45835, 26.28831, 27.17461, 28.12338],
        [24.67944, 27.25237, 30.42446, 34.43267, 39.65772],
        [48.94854, 53.95409, 60.10133, 67.83137, 77.84653],
    ],
];

/// `[C33]` at [`POISSON_RATIOS`] for each a/b.
const SPIN: [[f64; 5]; RATIOS] = [
    [19.89006, 22.67151, 26.35056, 31.44515, 38.96354],
    [14.14085, 16.08910, 18.65496, 22.18722, 27.35622],
    [10.09413, 11.45181, 13.22851, 15.65418, 19.16307],
    [7.24678, 8.18398, 9.40030, 11.04224, 13.38020],
    [5.25072, 5.88900, 6.70856, 7.79891, 9.32077],
    [3.85548, 4.28097, 4.82007, 5.52477, 6.48509],
    [2.88318, 3.15691, 3.49829, 3.93571, 4.51593],
    [2.20844, 2.37397, 2.57695, 2.83159, 3.16025],
    [1.74210, 1.82992, 1.93592, 2.06632, 2.23051],
    [1.42094, 1.45264, 1.49079, 1.53744, 1.59560],
    [1.20161, 1.19187, 1.18165, 1.17102, 1.16012],
    [1.05289, 1.01194, 0.96658, 0.91611, 0.85963],
    [0.95320, 0.88812, 0.81645, 0.73735, 0.64995],
    [0.88603, 0.80230, 0.71071, 0.61069, 0.50203],
    [0.84300, 0.74393, 0.63616, 0.51961, 0.39524],
    [0.81556, 0.70392, 0.58289, 0.45308, 0.31705],
    [0.79579, 0.67458, 0.54335, 0.40343, 0.25926],
    [0.78475, 0.65501, 0.51463, 0.36571, 0.21494],
    [0.77394, 0.63829, 0.49137, 0.33608, 0.18126],
    [0.77385, 0.63070, 0.47567, 0.31269, 0.15317],
    [0.76621, 0.61943, 0.46032, 0.29338, 0.13241],
];
