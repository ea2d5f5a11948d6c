//! Measures the cost of the parts of a solve, by mesh and storage: rows of influence coefficients, one product, the solve on a whole mesh.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use railhead_contact::case::solver::Limits;
use railhead_contact::half_space::strip_operator::kind::Precision;
use railhead_contact::half_space::strip_operator::operator::{OperatorScratch, StripOperator};
use railhead_contact::mesh::{Chord, Grading, Mesh, equal_strips};
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::json;

const MESHES: [(usize, usize); 3] = [(12, 6), (24, 12), (32, 16)];

fn circle(cells: usize, strips: usize) -> Mesh {
    let chord = |(strip, (y, dy)): (usize, (f64, f64))| {
        let half = (1.0_f64 - y * y).sqrt();
        Chord {
            patch: 0,
            strip,
            y,
            dy,
            left: -half,
            right: half,
        }
    };
    let chords: Vec<Chord> = equal_strips(-1.0, 1.0, strips)
        .into_iter()
        .enumerate()
        .map(chord)
        .collect();
    Mesh::new(&chords, &Grading::cosine(cells))
}

fn kinds() -> [(&'static str, bool, Precision); 4] {
    [
        ("full f64", false, Precision::Double),
        ("full f32", false, Precision::Single),
        ("folded f64", true, Precision::Double),
        ("folded f32", true, Precision::Single),
    ]
}

fn influence(c: &mut Criterion) {
    let mut group = c.benchmark_group("influence");
    for (cells, strips) in MESHES {
        let mesh = circle(cells, strips);
        for (name, folded, precision) in kinds() {
            let id = BenchmarkId::new(name, format!("{cells}x{strips}"));
            group.bench_with_input(id, &mesh, |b, mesh| {
                b.iter(|| {
                    StripOperator::new(black_box(mesh), 0.28, folded, precision, &Unmonitored)
                });
            });
        }
    }
    group.finish();
}

fn product(c: &mut Criterion) {
    let mut group = c.benchmark_group("product");
    for (cells, strips) in MESHES {
        let mesh = circle(cells, strips);
        for (name, folded, precision) in kinds() {
            let differences = StripOperator::new(&mesh, 0.28, folded, precision, &Unmonitored)
                .expect("never stopped");
            let t: Vec<f64> = (0..differences.padded(None))
                .map(|i| (i as f64).sin())
                .collect();
            let rows = (cells + 2) * strips;
            let mut scratch = OperatorScratch::default();
            let (mut ux, mut uy) = (vec![0.0; rows], vec![0.0; rows]);
            group.bench_function(BenchmarkId::new(name, format!("{cells}x{strips}")), |b| {
                b.iter(|| {
                    let t = black_box(&t);
                    differences.apply(None, t, t, &mut ux, &mut uy, &mut scratch);
                });
            });
        }
    }
    group.finish();
}

fn cases(c: &mut Criterion) {
    let mut group = c.benchmark_group("case");
    let whole = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    for (name, motion, outputs) in [
        (
            "longitudinal",
            json!({ "creepage_x": 0.001 }),
            json!(["resultants"]),
        ),
        (
            "spin",
            json!({ "spin_per_mm": 0.0004 }),
            json!(["resultants"]),
        ),
        (
            "both",
            json!({ "creepage_x": 0.001, "spin_per_mm": 0.0004 }),
            json!(["resultants"]),
        ),
        (
            "both, all outputs",
            json!({ "creepage_x": 0.001, "spin_per_mm": 0.0004 }),
            whole,
        ),
        (
            "sweep of 51",
            json!({ "sweep": { "creepage_x": { "from": 0, "to": 0.005, "points": 51 } } }),
            json!(["resultants"]),
        ),
    ] {
        let case = json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": motion,
            "outputs": outputs,
        });
        let problem = check(&case, &Limits::default()).expect("a valid case");
        group.bench_function(name, |b| {
            b.iter(|| solve(black_box(&problem), &Unmonitored));
        });
    }
    group.finish();
}

criterion_group! {
    name = kernels;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = influence, product, cases
}
criterion_main!(kernels);
