//! Results in other forms than JSON: each form says the same numbers, to the last bit.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::process::Command;

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guides::python;
use crate::results::{number, numbers, path_of};
use crate::server::{Answer, Server, example};

/// Parts per cell and the columns that belong to them.
const PARTS: [(&str, &[&str]); 4] = [
    ("tractions", &["traction_x_mpa", "traction_y_mpa"]),
    ("pressure", &["pressure_mpa"]),
    ("slip", &["slip_x", "slip_y"]),
    ("zones", &["zone"]),
];
const PLACES: [&str; 5] = ["x_mm", "y_mm", "dx_mm", "dy_mm", "strip"];

/// A number, or the code that binary forms have for a zone or for nothing.
fn coded(value: &Value) -> f64 {
    match value {
        Value::String(word) if word == "stick" => 0.0,
        Value::String(word) if word == "slip" => 1.0,
        Value::Null => f64::NAN,
        value => number(value),
    }
}

pub fn column(values: &Value) -> Vec<f64> {
    values
        .as_array()
        .expect("an array")
        .iter()
        .map(coded)
        .collect()
}

/// All values of rows, in order.
pub fn flat(rows: &Value) -> Vec<f64> {
    rows.as_array()
        .expect("rows")
        .iter()
        .flat_map(column)
        .collect()
}

pub fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// The columns of a CSV; empty fields are NaN.
fn read_csv(answer: &Answer) -> BTreeMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_reader(answer.text.as_bytes());
    let names = reader.headers().expect("a header").clone();
    let mut columns: BTreeMap<String, Vec<f64>> =
        names.iter().map(|name| (name.to_owned(), vec![])).collect();
    for record in reader.records() {
        for (name, field) in names.iter().zip(&record.expect("a record")) {
            let value = match field {
                "stick" => 0.0,
                "slip" => 1.0,
                "" => f64::NAN,
                field => field.parse().expect("a number"),
            };
            columns.get_mut(name).expect("a column").push(value);
        }
    }
    columns
}

/// The arrays of an NPZ with their shapes as written.
pub fn read_npz(answer: &Answer) -> BTreeMap<String, (String, Vec<f64>)> {
    let mut archive = zip::ZipArchive::new(Cursor::new(&answer.bytes)).expect("an archive");
    let mut arrays = BTreeMap::new();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).expect("an entry");
        let name = entry
            .name()
            .expect("a name")
            .trim_end_matches(".npy")
            .to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("an array");
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00", "{name}");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = String::from_utf8_lossy(&bytes[10..10 + length]).into_owned();
        let data = &bytes[10 + length..];
        let after = |key: &str, end: &str| {
            let (_, rest) = header.split_once(key).expect("a key");
            rest.split(end).next().expect("a value").to_owned()
        };
        let values = match after("'descr': '", "'").as_str() {
            "<f8" => data
                .as_chunks()
                .0
                .iter()
                .map(|b| f64::from_le_bytes(*b))
                .collect(),
            "<f4" => {
                let numbers = data.as_chunks().0.iter();
                numbers.map(|b| f32::from_le_bytes(*b).into()).collect()
            }
            "<u4" => data
                .as_chunks()
                .0
                .iter()
                .map(|b| u32::from_le_bytes(*b).into())
                .collect(),
            "|i1" => data
                .iter()
                .map(|b| if *b == 255 { f64::NAN } else { f64::from(*b) })
                .collect(),
            other => panic!("{name} is of kind {other}"),
        };
        arrays.insert(name, (after("'shape': (", ")"), values));
    }
    arrays
}

#[tokio::test]
async fn every_form_of_the_cells_says_the_same_numbers() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    for (part, names) in PARTS {
        let cells = server.read(&format!("{path}/{part}")).await["cells"].take();
        let table = server.get(&format!("{path}/{part}?format=csv")).await;
        let header: Vec<&str> = PLACES.iter().chain(names).copied().collect();
        assert_eq!(
            table.text.lines().next(),
            Some(header.join(",").as_str()),
            "{part}"
        );
        let table = read_csv(&table);
        let archive = server.get(&format!("{path}/{part}?format=npz")).await;
        assert!(
            archive
                .header("content-disposition")
                .is_some_and(|value| value.contains(&format!("\"{part}-0-0.npz\"")))
        );
        let mut archive = read_npz(&archive);
        archive.retain(|name, _| !name.starts_with("outline_"));
        assert_eq!((table.len(), archive.len()), (header.len(), header.len()));
        for name in header {
            let expected = column(&cells[name]);
            assert!(expected.len() > 100, "{part} has no {name}");
            assert_eq!(
                bits(&table[name]),
                bits(&expected),
                "{name} of {part} as CSV"
            );
            let (shape, values) = &archive[name];
            assert_eq!(*shape, format!("{},", expected.len()));
            assert_eq!(bits(values), bits(&expected), "{name} of {part} as NPZ");
        }
    }
}

#[tokio::test]
async fn every_form_of_a_grid_says_the_same_numbers() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    for (part, names) in PARTS {
        let query = format!("{path}/{part}?grid=9x5");
        let field = server.read(&query).await;
        let table = read_csv(&server.get(&format!("{query}&format=csv")).await);
        let archive = read_npz(&server.get(&format!("{query}&format=npz")).await);
        let (x, y) = (numbers(&field["x_mm"]), numbers(&field["y_mm"]));
        assert_eq!(
            (&archive["x_mm"].1, &archive["y_mm"].1),
            (&x, &y),
            "the axes of {part}"
        );
        for name in names {
            let expected = flat(&field[*name]);
            assert!(expected.iter().any(|value| value.is_nan()), "{name}");
            let (shape, values) = &archive[*name];
            assert_eq!(shape, "5, 9", "{name}");
            assert_eq!(bits(values), bits(&expected), "{name} as NPZ");
            assert_eq!(bits(&table[*name]), bits(&expected), "{name} as CSV");
        }
        for (row, (table_x, table_y)) in table["x_mm"].iter().zip(&table["y_mm"]).enumerate() {
            assert_eq!((*table_x, *table_y), (x[row % 9], y[row / 9]), "row {row}");
        }
    }
}

#[tokio::test]
async fn numpy_reads_the_archive() {
    // Without it the archive is read by this test's own reader only.
    let Some(python) = python() else {
        return;
    };
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("field.npz");
    let archive = server.get(&format!("{path}/tractions?format=npz")).await;
    std::fs::write(&file, archive.bytes).expect("a file");
    let sum = "import numpy, sys; f = numpy.load(sys.argv[1]); print(repr(float((f['traction_y_mpa'] * f['dx_mm'] * f['dy_mm']).sum())))";
    let output = Command::new(&python).args(["-c", sum]).arg(&file).output();
    let output = output.expect("python runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let force: f64 = text.trim().parse().unwrap_or_else(|_| panic!("{output:?}"));
    let cells = server.read(&format!("{path}/tractions")).await["cells"].take();
    let column = |name: &str| numbers(&cells[name]);
    let (values, dx, dy) = (column("traction_y_mpa"), column("dx_mm"), column("dy_mm"));
    let areas = dx.iter().zip(&dy).map(|(dx, dy)| dx * dy);
    let expected: f64 = values
        .iter()
        .zip(areas)
        .map(|(value, area)| value * area)
        .sum();
    assert!(
        (force - expected).abs() < 1e-9 * expected.abs(),
        "{force} and {expected}"
    );
}

#[tokio::test]
async fn the_form_is_chosen_by_query_before_accept() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let ask = async |query: &str, accept: &str| {
        let path = format!("{path}/{query}");
        let send = server.get_with(&path, "accept", accept);
        send.await
    };
    for (query, accept, expected) in [
        ("tractions", "*/*", "application/json"),
        ("tractions", "text/csv", "text/csv; charset=utf-8"),
        (
            "slip",
            "application/x-npz, application/json;q=0.5",
            "application/x-npz",
        ),
        ("zones", "application/x-vtk", "application/x-vtk"),
        (
            "pressure?format=csv",
            "application/json",
            "text/csv; charset=utf-8",
        ),
        ("pressure?format=json", "text/csv", "application/json"),
        ("resultants", "text/csv", "text/csv; charset=utf-8"),
        (
            "resultants?format=csv",
            "image/png",
            "text/csv; charset=utf-8",
        ),
    ] {
        let answer = ask(query, accept).await;
        let found = (answer.status, answer.header("content-type"));
        assert_eq!(found, (200, Some(expected)), "{query} as {accept}");
        assert!(
            answer
                .header("vary")
                .is_some_and(|vary| vary.contains("Accept")),
            "{query} does not say that it depends on Accept"
        );
    }
    for part in ["tractions", "zones", "resultants"] {
        let answer = ask(part, "application/xml").await;
        assert_problem(&answer, 406, "not-acceptable", "`text/csv`");
        let answer = ask(&format!("{part}?format=xml"), "*/*").await;
        assert_problem(&answer, 400, "bad-query", "`csv`");
    }
    let answer = ask("resultants?format=npz", "*/*").await;
    assert_problem(&answer, 400, "bad-query", "`json`, `csv`");
}

#[tokio::test]
async fn resultants_as_a_table_have_a_line_per_patch_motion_and_sum() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("two-patches.case.json")).await);
    let whole = server.read(&format!("{path}/resultants")).await;
    let patches = whole["patches"].as_array().expect("patches");
    let motions = whole["total"].as_array().expect("totals").len();
    assert!(patches.len() > 1);
    let table = server
        .get(&format!("{path}/resultants?format=csv"))
        .await
        .text;
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let names = reader.headers().expect("a header").clone();
    let lines: Vec<BTreeMap<String, String>> = reader
        .records()
        .map(|record| {
            let record = record.expect("a record");
            let fields = names.iter().zip(&record);
            fields
                .map(|(name, field)| (name.to_owned(), field.to_owned()))
                .collect()
        })
        .collect();
    assert_eq!(lines.len(), (patches.len() + 1) * motions);
    for (index, line) in lines.iter().enumerate() {
        let (row, point) = (index / motions, index % motions);
        let source = match patches.get(row) {
            Some(patch) => &patch["points"][point],
            None => &whole["total"][point],
        };
        let label = patches
            .get(row)
            .map_or("total".to_owned(), |_| row.to_string());
        assert_eq!(
            (&line["patch"], &line["point"]),
            (&label, &point.to_string())
        );
        for name in ["force_x_n", "force_y_n", "moment_z_n_mm"] {
            assert_eq!(
                line[name].parse::<f64>().expect("a number"),
                number(&source[name])
            );
            let error = &source["error_estimate"][name];
            let written = line[&format!("error_{name}")].parse::<f64>().ok();
            assert_eq!(written, error.as_f64(), "{name} of line {index}");
        }
        let motion = &patches[0]["points"][point]["motion"];
        assert_eq!(
            json!(line["spin_per_mm"].parse::<f64>().expect("a number")),
            json!(number(&motion["spin_per_mm"]))
        );
    }
    let load = |line: &BTreeMap<String, String>| line["normal_force_n"].parse::<f64>().expect("N");
    let parts: f64 = lines[..patches.len() * motions]
        .iter()
        .step_by(motions)
        .map(load)
        .sum();
    assert!((load(lines.last().expect("a line")) - parts).abs() < 1e-6);
    let one = server
        .get(&format!("{path}/resultants?format=csv&patch=1"))
        .await
        .text;
    assert_eq!(one.lines().count(), 1 + 2 * motions, "{one}");
}
