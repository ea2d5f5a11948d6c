//! Tests that results in other formats have exactly the same numbers as in JSON.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use serde_json::Value;

use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::results::{number, numbers, path_of};
use crate::server::{Answer, Server, example};

/// The parts with values per cell, and their columns.
pub const PARTS: [(&str, &[&str]); 4] = [
    ("tractions", &["traction_x_mpa", "traction_y_mpa"]),
    ("pressure", &["pressure_mpa"]),
    ("slip", &["slip_x", "slip_y"]),
    ("zones", &["zone"]),
];
const PLACES: [&str; 5] = ["x_mm", "y_mm", "dx_mm", "dy_mm", "strip"];

/// Returns a number, or the code of a zone or of a missing value in binary formats.
fn coded(value: &Value) -> f64 {
    match value {
        Value::String(word) if word == "stick" => 0.0,
        Value::String(word) if word == "slip" => 1.0,
        Value::Null => f64::NAN,
        value => number(value),
    }
}

fn column(values: &Value) -> Vec<f64> {
    values
        .as_array()
        .expect("an array")
        .iter()
        .map(coded)
        .collect()
}

/// Returns all values of rows, in order.
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

/// Returns a column of a CSV. Empty fields are NaN.
fn coded_column(table: &Csv, name: &str) -> Vec<f64> {
    let number = |field: &str| field.parse().expect("a number");
    let coded = |field| match field {
        "stick" => 0.0,
        "slip" => 1.0,
        "" => f64::NAN,
        field => number(field),
    };
    table.column(name).into_iter().map(coded).collect()
}

fn each<const N: usize>(data: &[u8], read: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let numbers = data.as_chunks().0.iter();
    numbers.map(|bytes| read(*bytes)).collect()
}

/// Returns the arrays of an NPZ archive with their shapes as text.
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
            "<f8" => each(data, f64::from_le_bytes),
            "<f4" => each(data, |bytes| f32::from_le_bytes(bytes).into()),
            "<u4" => each(data, |bytes| u32::from_le_bytes(bytes).into()),
            "|i1" => each(data, |[b]| if b == 255 { f64::NAN } else { b.into() }),
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
        let table = Csv::read(&table.text);
        let header: Vec<&str> = PLACES.iter().chain(names).copied().collect();
        assert_eq!(table.head, header, "{part}");
        let archive = server.get(&format!("{path}/{part}?format=npz")).await;
        let disposition = archive.header("content-disposition").expect("a name");
        assert!(disposition.contains(&format!("\"{part}-0-0.npz\"")));
        let mut archive = read_npz(&archive);
        archive.retain(|name, _| !name.starts_with("outline_"));
        assert_eq!(archive.len(), header.len());
        for name in header {
            let expected = column(&cells[name]);
            assert!(expected.len() > 100, "{part} has no {name}");
            let column = bits(&coded_column(&table, name));
            assert_eq!(column, bits(&expected), "{name} of {part} as CSV");
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
        let table = server.get(&format!("{query}&format=csv")).await;
        let table = Csv::read(&table.text);
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
            let column = bits(&coded_column(&table, name));
            assert_eq!(column, bits(&expected), "{name} as CSV");
        }
        for row in 0..45 {
            let place = ["x_mm", "y_mm"].map(|name| table.number(row, name).expect("a place"));
            assert_eq!(place, [x[row % 9], y[row / 9]], "row {row}");
        }
    }
}

#[tokio::test]
async fn the_form_is_chosen_by_query_before_accept() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let ask = async |query: &str, accept: &str| {
        let path = format!("{path}/{query}");
        server.get_with(&path, "accept", accept).await
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
        let vary = answer.header("vary").unwrap_or_default();
        assert!(vary.contains("Accept"), "{query} depends on Accept: {vary}");
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
