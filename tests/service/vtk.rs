//! Tests fields for ParaView: legacy VTK files, read byte by byte.

use crate::formats::flat;
use crate::results::{numbers, path_of};
use crate::server::{Server, example};

/// A parser of a legacy VTK file, with the bytes that remain.
struct Vtk<'a>(&'a [u8]);

impl<'a> Vtk<'a> {
    fn line(&mut self) -> &'a str {
        let end = self.0.iter().position(|b| *b == b'\n').expect("a line");
        let (line, rest) = self.0.split_at(end);
        self.0 = &rest[1..];
        std::str::from_utf8(line).expect("a line is text")
    }

    fn block<const N: usize>(&mut self, count: usize) -> Vec<[u8; N]> {
        let (block, rest) = self.0.split_at(count * N);
        assert_eq!(rest[0], b'\n', "a block ends with its line");
        self.0 = &rest[1..];
        block.as_chunks().0.to_vec()
    }

    fn doubles(&mut self, count: usize) -> Vec<f64> {
        let block = self.block(count);
        block.into_iter().map(f64::from_be_bytes).collect()
    }

    fn integers(&mut self, count: usize) -> Vec<i32> {
        let block = self.block(count);
        block.into_iter().map(i32::from_be_bytes).collect()
    }
}

#[tokio::test]
async fn vtk_has_one_quadrilateral_per_cell() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let cells = server.read(&format!("{path}/tractions")).await["cells"].take();
    let (dx, dy) = (numbers(&cells["dx_mm"]), numbers(&cells["dy_mm"]));
    let n = dx.len();
    let file = server.get(&format!("{path}/tractions?format=vtk")).await;
    let mut vtk = Vtk(&file.bytes);
    assert_eq!(vtk.line(), "# vtk DataFile Version 3.0");
    assert!(vtk.line().starts_with("tractions, patch 0, motion 0"));
    assert_eq!(vtk.line(), "BINARY");
    assert_eq!(vtk.line(), "DATASET UNSTRUCTURED_GRID");
    assert_eq!(vtk.line(), format!("POINTS {} double", 4 * n));
    let points = vtk.doubles(12 * n);
    assert_eq!(vtk.line(), format!("CELLS {n} {}", 5 * n));
    let corners = vtk.integers(5 * n);
    assert_eq!(vtk.line(), format!("CELL_TYPES {n}"));
    assert_eq!(vtk.integers(n), vec![9; n]);
    for (cell, corners) in corners.chunks(5).enumerate() {
        let at = |corner: i32| {
            let place = 3 * usize::try_from(corner).expect("a point");
            (points[place], points[place + 1])
        };
        let ring: Vec<(f64, f64)> = corners[1..].iter().map(|corner| at(*corner)).collect();
        let next = ring.iter().cycle().skip(1);
        let twice: f64 = ring
            .iter()
            .zip(next)
            .map(|(a, b)| a.0 * b.1 - b.0 * a.1)
            .sum();
        let area = dx[cell] * dy[cell];
        assert!(
            corners[0] == 4 && (0.5 * twice - area).abs() < 1e-9 * area,
            "cell {cell} runs around {twice}, not twice {area}"
        );
    }
    assert_eq!(vtk.line(), format!("CELL_DATA {n}"));
    assert_eq!(vtk.line(), "SCALARS strip int 1");
    assert_eq!(vtk.line(), "LOOKUP_TABLE default");
    let strips: Vec<f64> = vtk.integers(n).into_iter().map(f64::from).collect();
    assert_eq!(strips, numbers(&cells["strip"]));
    assert_eq!(vtk.line(), "VECTORS traction_mpa double");
    let vectors = vtk.doubles(3 * n);
    let component =
        |axis: usize| -> Vec<f64> { vectors.iter().skip(axis).step_by(3).copied().collect() };
    assert_eq!(component(0), numbers(&cells["traction_x_mpa"]));
    assert_eq!(component(1), numbers(&cells["traction_y_mpa"]));
    assert_eq!(component(2), vec![0.0; n]);
    assert!(vtk.0.is_empty());
}

#[tokio::test]
async fn vtk_of_a_grid_is_structured_points() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let field = server.read(&format!("{path}/zones?grid=8x4")).await;
    let (x, y) = (numbers(&field["x_mm"]), numbers(&field["y_mm"]));
    let file = server
        .get(&format!("{path}/zones?grid=8x4&format=vtk"))
        .await;
    let mut vtk = Vtk(&file.bytes);
    let head: Vec<&str> = (0..9).map(|_| vtk.line()).collect();
    assert_eq!(head[3], "DATASET STRUCTURED_POINTS");
    assert_eq!(head[4], "DIMENSIONS 8 4 1");
    let numbers_of = |line: &str| -> Vec<f64> {
        line.split(' ')
            .skip(1)
            .map(|word| word.parse().expect("a number"))
            .collect()
    };
    assert_eq!(numbers_of(head[5])[..2], [x[0], y[0]]);
    let steps = numbers_of(head[6]);
    assert!((x[0] + 7.0 * steps[0] - x[7]).abs() < 1e-12);
    assert!((y[0] + 3.0 * steps[1] - y[3]).abs() < 1e-12);
    assert_eq!(head[7..], ["POINT_DATA 32", "SCALARS zone int 1"]);
    vtk.line();
    let expected: Vec<i32> = flat(&field["zone"])
        .iter()
        .map(|zone| {
            if zone.is_nan() {
                -1
            } else {
                i32::from(*zone > 0.5)
            }
        })
        .collect();
    assert_eq!(vtk.integers(32), expected);
    assert!(expected.contains(&-1) && expected.contains(&1));
}
