//! Tests rows in every table format of requests and responses, and limits of their number.

use std::io::Cursor;

use axum::body::Bytes;
use railhead::tables::arrow::read;
use railhead::tables::parquet::{TableReader, encode};
use railhead::tables::read::TableForm;
use railhead::tables::table::{RowTable, TableColumn};
use railhead::tables::write::RowWriter;
use reqwest::Body;
use serde_json::{Value, json};

use crate::batches::results;
use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::evaluate::npz;
use crate::runs::{columns, ended, template};
use crate::server::{Answer, Server, Setup, link};

pub const ARROW: &str = "application/vnd.apache.arrow.stream";
pub const PARQUET: &str = "application/vnd.apache.parquet";
pub const NPZ: &str = "application/x-npz";

/// Submits a template for tables and returns the id of its job.
pub async fn kept_template(server: &Server) -> String {
    let mut case = template("table");
    case["load"]["normal_force_n"] = json!(1e5);
    server.keep(&case).await
}

/// Sends rows for a kept template. `query` begins with its id and may add parameters.
pub async fn send_rows(server: &Server, query: &str, form: &str, body: impl Into<Body>) -> Answer {
    let path = format!("/v1/runs?template={query}");
    server.post_as(&path, form, body).await
}

/// Returns rows with the columns `normal_force_n`, `creepage_x` and, if a title is given, a column of texts.
fn rows(texts: Option<&str>) -> RowTable {
    let numbers = [
        ("normal_force_n", vec![5e4, 6e4, 7e4]),
        ("/motion/creepage_x", vec![1e-3, 0.0, -2e-3]),
    ];
    let numbers = numbers.map(|(title, values)| (title.to_owned(), TableColumn::Numbers(values)));
    let words = ["a", "b", "a"].map(|text| Some(text.to_owned())).to_vec();
    let texts = texts.map(|title| (title.to_owned(), TableColumn::Texts(words)));
    RowTable {
        columns: numbers.into_iter().chain(texts).collect(),
    }
}

/// Returns the table in every request format, with its media type. NPZ holds numbers only.
pub fn forms(table: &RowTable) -> Vec<(&'static str, Vec<u8>)> {
    let arrow = RowWriter::whole(TableForm::Arrow, table.clone()).expect("a stream");
    let value = |column: &TableColumn, row: usize| match column {
        TableColumn::Numbers(numbers) => json!(numbers[row]),
        TableColumn::Texts(texts) => json!(texts[row]),
        TableColumn::Integers(numbers) => json!(numbers[row]),
    };
    let titles: Vec<&str> = table
        .columns
        .iter()
        .map(|(title, _)| title.as_str())
        .collect();
    let (mut csv, mut ndjson) = (titles.join(",") + "\n", String::new());
    for row in 0..table.row_count() {
        let cells = table.columns.iter();
        let cells = cells.map(|(title, column)| (title.clone(), value(column, row)));
        let cells: Vec<(String, Value)> = cells.collect();
        let plain = cells.iter().map(|(_, cell)| match cell {
            Value::String(text) => text.clone(),
            number => number.to_string(),
        });
        csv += &(plain.collect::<Vec<_>>().join(",") + "\n");
        ndjson += &(Value::Object(cells.into_iter().collect()).to_string() + "\n");
    }
    let mut forms = vec![
        ("text/csv", csv.into_bytes()),
        ("application/x-ndjson", ndjson.into_bytes()),
        (ARROW, arrow),
        (PARQUET, encode(table).expect("a file")),
    ];
    let numbers: Option<Vec<(&str, Vec<f64>)>> = table
        .columns
        .iter()
        .map(|(title, column)| match column {
            TableColumn::Numbers(numbers) => Some((title.as_str(), numbers.clone())),
            _ => None,
        })
        .collect();
    if let Some(arrays) = numbers {
        forms.push((NPZ, npz(&arrays)));
    }
    forms
}

#[tokio::test]
async fn a_run_answers_the_same_rows_alike_whatever_form_they_come_in() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let mut answers = Vec::new();
    for (form, body) in forms(&rows(Some("section"))) {
        let run = send_rows(&server, &template, form, body).await;
        let run = run.is(202).location();
        ended(&server, &run).await;
        answers.push(server.get(&format!("{run}/results?format=csv")).await.text);
    }
    let first = answers[0].lines().nth(1).expect("a row");
    assert!(first.starts_with("0,a,ok,table,"), "{first}");
    let same = answers.iter().all(|answer| *answer == answers[0]);
    assert!(same, "{answers:#?}");
}

#[tokio::test]
async fn copied_columns_of_csv_come_back_as_they_were_written() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let csv =
        "sep=;\ncreepage_x;axle_no;order;km\n0,001;007;12345678901234567890;1,5\n0,002;8;2;2,0\n";
    let query = format!("{template}&carry=order");
    let run = send_rows(&server, &query, "text/csv", csv).await.is(202);
    let run = run.location();
    ended(&server, &run).await;
    let path = format!("{run}/results?format=csv&columns=axle_no,order,km");
    let copied = server.get(&path).await.text;
    assert_eq!(
        copied,
        "axle_no,order,km\n007,12345678901234567890,1.5\n8,2,2.0\n"
    );
    // Numbers of NDJSON with more than 53 bits would be rounded.
    let long = "{\"creepage_x\":0.001,\"order\":9007199254740993}";
    let refused = send_rows(&server, &query, "application/x-ndjson", long).await;
    assert!(
        refused.text.contains("long ids as texts"),
        "{}",
        refused.text
    );
    let labelled = r#"{"creepage_x":0.001,"label:order":9007199254740993}"#;
    let path = format!("/v1/batches?template={template}");
    let refused = server
        .post_as(&path, "application/x-ndjson", labelled)
        .await;
    assert!(
        refused.text.contains("long ids as texts"),
        "{}",
        refused.text
    );
    let twice = "{\"creepage_x\":0.001,\"creepage_x\":0.002}";
    let refused = send_rows(&server, &template, "application/x-ndjson", twice).await;
    assert_problem(&refused, 422, "faulty-table", "written twice");
}

#[tokio::test]
async fn an_evaluation_answers_the_same_rows_alike_in_every_form_in_and_out() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let mut answers = Vec::new();
    let path = format!("/v1/evaluate?template={template}");
    for (form, body) in forms(&rows(None)) {
        let answer = server.post_as(&path, form, body).await;
        answers.push(answer.is(200).json);
    }
    assert_eq!(answers.len(), 5);
    let expected = &answers[0]["columns"];
    assert_eq!(expected["status"], json!(["ok", "ok", "ok"]));
    let same = answers.iter().all(|answer| answer["columns"] == *expected);
    assert!(same, "{answers:#?}");
    for format in ["csv", "ndjson", "arrow", "parquet"] {
        let path = format!("{path}&format={format}");
        let (csv, body) = forms(&rows(None)).remove(0);
        let answer = server.post_as(&path, csv, body).await;
        let lines = lines_of(format, &answer);
        assert_eq!(lines.len(), 3, "{format}");
        for (row, line) in lines.iter().enumerate() {
            for (name, values) in expected.as_object().expect("columns") {
                assert_eq!(line[name], values[row], "{format}, row {row}, {name}");
            }
        }
    }
    // Only runs copy columns.
    let (csv, carried) = forms(&rows(Some("section"))).remove(0);
    let refused = server.post_as(&path, csv, carried).await;
    let words = "only runs copy further columns";
    assert_problem(&refused, 422, "faulty-table", words);
}

/// Returns the rows of an answer in a table format.
pub fn lines_of(format: &str, answer: &Answer) -> Vec<Value> {
    assert_eq!(answer.status, 200, "{format}: {}", answer.text);
    match format {
        "ndjson" => answer.lines(),
        "csv" => {
            let table = Csv::read(&answer.text);
            let lines = table.rows.iter().map(|row| {
                let cells = row.iter().map(|cell| match cell.as_str() {
                    "" => Value::Null,
                    cell => cell
                        .parse::<f64>()
                        .map_or_else(|_| json!(cell), |number| json!(number)),
                });
                table.head.iter().cloned().zip(cells).collect()
            });
            lines.collect()
        }
        "arrow" => {
            let batches = read(Cursor::new(answer.bytes.clone())).expect("a stream");
            let rows = batches.flat_map(|table| rows_of(&table.expect("a batch")));
            rows.collect()
        }
        _ => {
            let file = TableReader::new(Bytes::from(answer.bytes.clone())).expect("a file");
            let groups = 0..file.groups();
            let rows = groups.flat_map(|k| rows_of(&file.read(k, |_| true).expect("a group")));
            rows.collect()
        }
    }
}

fn rows_of(table: &RowTable) -> Vec<Value> {
    let cell = |column: &TableColumn, row: usize| match column {
        TableColumn::Integers(values) => json!(values[row] as f64),
        TableColumn::Numbers(values) => json!(values[row]),
        TableColumn::Texts(values) => json!(values[row]),
    };
    let row = |row| {
        let columns = table.columns.iter();
        columns
            .map(|(name, column)| (name.clone(), cell(column, row)))
            .collect()
    };
    (0..table.row_count()).map(row).collect()
}

#[tokio::test]
async fn a_batch_makes_the_same_cases_of_every_form_and_answers_them_alike_in_every_table() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let mut answers = Vec::new();
    let path = format!("/v1/batches?wait=60&template={template}");
    for (name, body) in forms(&rows(Some("label:section"))) {
        let batch = server.post_as(&path, name, body).await.is(200);
        let lines = results(&server, &batch.json, "").await;
        let said = lines.iter().map(|line| {
            let patches = &line["result"]["patches"];
            json!([
                line["labels"],
                patches[0]["normal_force_n"],
                patches[0]["points"]
            ])
        });
        answers.push((name, said.collect::<Vec<_>>(), batch));
    }
    let (_, expected, batch) = &answers[0];
    assert_eq!(expected[1][0]["section"], "b");
    for (name, said, _) in &answers {
        assert_eq!(said, expected, "{name}");
    }
    let path = link(&batch.json, "results");
    let columns = "index,id,point,label:section,force_x_n,error_force_x_n,target_met,remarks,error";
    let mut tables = Vec::new();
    for format in ["csv", "arrow", "parquet"] {
        let answer = server
            .get(&format!("{path}?format={format}&columns={columns}"))
            .await;
        let mut lines = lines_of(format, &answer);
        // CSV does not distinguish an empty text from a missing one.
        for line in &mut lines {
            let cells = line.as_object_mut().expect("a row");
            cells.retain(|_, cell| *cell != json!("") && !cell.is_null());
        }
        tables.push(lines);
    }
    assert_eq!(tables[0][2]["label:section"], "a");
    assert!(tables[0][2]["force_x_n"].is_number());
    assert!(
        tables.iter().all(|lines| *lines == tables[0]),
        "{tables:#?}"
    );
}

#[tokio::test]
async fn faults_of_rows_in_any_form_are_named() {
    let server = Server::idle().await;
    let template = kept_template(&server).await;
    let mut wrong = rows(None);
    wrong.columns[0].1 = TableColumn::Numbers(vec![5e4, -5e4, 7e4]);
    let paths = [
        ("/v1/runs", "faulty-case"),
        ("/v1/evaluate", "faulty-case"),
        ("/v1/batches", "faulty-batch"),
    ];
    let wrong = forms(&wrong);
    for (path, kind) in paths {
        let bare = server.post_as(path, "text/csv", "creepage_x\n1e-3\n").await;
        assert_problem(&bare, 400, "bad-query", "template");
        let path = format!("{path}?template={template}");
        for (form, body) in wrong.clone() {
            let refused = server.post_as(&path, form, body).await;
            assert_problem(&refused, 422, kind, "1");
            assert!(refused.text.contains("-50000"), "{form}: {}", refused.text);
        }
        for form in [ARROW, PARQUET, NPZ] {
            let broken = server.post_as(&path, form, "neither").await;
            assert_problem(&broken, 422, "faulty-table", "cannot be read");
        }
        if kind == "faulty-case" {
            let letters = server.post_as(&path, "text/csv", "creepage_x\n0.1\nten\n");
            let word = "line 3, column `creepage_x`";
            assert_problem(&letters.await, 422, "faulty-table", word);
        }
    }
}

#[tokio::test]
async fn more_rows_or_bytes_than_allowed_are_refused() {
    let mut setup = Setup::idle();
    (setup.http.run_max_rows, setup.http.run_max_bytes) = (100, 4096);
    let server = setup.start().await;
    let body = json!({ "template": template("table"), "columns": columns(101) });
    let answer = server.post("/v1/runs", &body).await;
    assert_problem(&answer, 413, "body-too-large", "run-max-rows");
    let template = kept_template(&server).await;
    let many = "creepage_x\n".repeat(1000);
    let answer = send_rows(&server, &template, "text/csv", many).await;
    assert_problem(&answer, 413, "body-too-large", "4096");
}
