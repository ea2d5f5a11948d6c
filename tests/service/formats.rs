//! Tests that results in other formats, and all fields of a motion in one response, have exactly the same numbers as in JSON.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use serde_json::{Value, json};

use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::results::{number, numbers, path_of};
use crate::server::{Answer, Server, example, link};

/// The parts with values per cell, and their columns.
const PARTS: [(&str, &[&str]); 4] = [
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

fn bits(values: &[f64]) -> Vec<u64> {
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
fn read_npz(answer: &Answer) -> BTreeMap<String, (String, Vec<f64>)> {
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

async fn solved(server: &Server, outputs: Value) -> Value {
    let mut case = example("spin.case.json");
    case["outputs"] = outputs;
    server.solve(&case).await
}

#[tokio::test]
async fn one_answer_has_all_fields_of_a_motion_as_their_parts_have_them() {
    let server = Server::start().await;
    let all = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    let job = solved(&server, all).await;
    let path = path_of(&job);
    let link = link(&job["result"], "fields");
    let fields = server.read(link).await;
    let grid = server.read(&format!("{link}?grid=20x30")).await;
    for (part, names) in PARTS {
        let cells = server.read(&format!("{path}/{part}")).await;
        let sampled = server.read(&format!("{path}/{part}?grid=20x30")).await;
        assert_eq!(cells["outlines"]["patch"], fields["outlines"]["patch"]);
        assert_eq!(sampled["outlines"]["patch"], fields["outlines"]["patch"]);
        for name in names.iter().copied().chain(["x_mm", "y_mm"]) {
            assert!(fields["cells"][name].is_array(), "{name}");
            assert_eq!(fields["cells"][name], cells["cells"][name], "{name}");
            assert_eq!(grid[name], sampled[name], "{name} on a grid");
        }
    }
}

#[tokio::test]
async fn parts_are_chosen_by_name_and_must_be_there() {
    let server = Server::start().await;
    let some = json!(["resultants", "pressure", "tractions"]);
    let path = path_of(&solved(&server, some).await);
    let fields = server.read(&format!("{path}/fields")).await;
    assert!(
        fields["cells"]["pressure_mpa"].is_array() && fields["cells"]["traction_x_mpa"].is_array()
    );
    assert!(fields["cells"]["zone"].is_null() && fields["outlines"]["stick"].is_null());
    let one = server.read(&format!("{path}/fields?parts=pressure")).await;
    assert!(one["cells"]["pressure_mpa"].is_array() && one["cells"]["traction_x_mpa"].is_null());
    let missing = server
        .get(&format!("{path}/fields?parts=pressure,slip"))
        .await;
    assert_problem(&missing, 404, "output-not-asked", "slip");
    for parts in ["resultants", "pressure,pressure", "", "pressure, slip"] {
        let path = format!("{path}/fields?parts={}", parts.replace(' ', "%20"));
        let answer = server.get(&path).await;
        assert_problem(&answer, 400, "bad-query", "parts");
    }
    let none = path_of(&solved(&server, json!(["resultants"])).await);
    let nothing = server.get(&format!("{none}/fields")).await;
    assert_problem(&nothing, 404, "output-not-asked", "outputs");
    let nothing = server.get(&format!("{none}/fields?parts=slip")).await;
    assert_problem(&nothing, 404, "output-not-asked", "outputs");
}

#[tokio::test]
async fn single_precision_rounds_each_number_and_is_smaller() {
    let server = Server::start().await;
    let all = json!(["resultants", "zones", "pressure", "tractions"]);
    let path = path_of(&solved(&server, all).await);
    let whole = format!("{path}/fields?grid=60x40");
    let exact = server.get(&whole).await;
    let single = format!("{whole}&precision=single");
    let json = server.get(&single).await;
    let npz = server.get(&format!("{single}&format=npz")).await;
    let double = server.get(&format!("{whole}&format=npz")).await;
    assert!(json.bytes.len() < exact.bytes.len() && npz.bytes.len() < double.bytes.len());
    let archive = read_npz(&npz);
    #[expect(clippy::cast_possible_truncation, reason = "that is what is asked for")]
    let rounded = |values: Vec<f64>| {
        values
            .iter()
            .map(|value| f64::from(*value as f32))
            .collect::<Vec<_>>()
    };
    for name in ["pressure_mpa", "traction_x_mpa", "zone"] {
        let expected = flat(&exact.json[name]);
        let expected = match name {
            "zone" => expected,
            _ => rounded(expected),
        };
        assert_eq!(bits(&archive[name].1), bits(&expected), "{name}");
        let read = rounded(flat(&json.json[name]));
        assert_eq!(bits(&read), bits(&expected), "{name} as JSON");
    }
    let border = &exact.json["outlines"]["patch"][0];
    let corners = flat(border);
    let (shape, values) = &archive["outline_patch_mm"];
    assert_eq!(*shape, format!("{}, 2", corners.len() / 2));
    assert_eq!(bits(values), bits(&rounded(corners)));
    assert_eq!(archive["outline_patch_start"].1, [0.0]);
}
