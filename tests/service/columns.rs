//! Tests columns of tables in requests and responses: titles, units, limits, texts, damaged files.

use railhead::tables::parquet::encode;
use railhead::tables::table::{COLUMNS_MAX, RowTable, TableColumn};
use serde_json::{Value, json};

use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::runs::answers;
use crate::server::{Answer, Server};
use crate::table_forms::{PARQUET, forms, kept_template, send_rows};

async fn rows_of(server: &Server, sent: &Answer) -> Vec<Value> {
    assert_eq!(sent.status, 202, "{}", sent.text);
    answers(server, &sent.location()).await
}

/// Returns a table of one row of numbers with these titles.
fn one_row(titles: &[String]) -> RowTable {
    let titles = titles.iter().enumerate();
    let columns = titles.map(|(k, title)| {
        let numbers = vec![1e-3 + 1e-6 * k as f64];
        (title.clone(), TableColumn::Numbers(numbers))
    });
    RowTable {
        columns: columns.collect(),
    }
}

#[tokio::test]
async fn a_column_that_is_not_known_is_refused_with_what_it_may_be() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let table = "Time;s_track;Q_left;nu_x;nu_y;spin\n[s];[m];[kN];[%];[%];[rad/m]\n\
                 0,1;1,5;61,5;0,1;-0,02;0,4\n0,2;3,1;74;-0,05;0,01;0,38\n";
    let send = async |query: &str| {
        let query = format!("{template}{query}");
        send_rows(&server, &query, "text/csv", table).await
    };
    let refused = send("").await;
    assert_problem(&refused, 422, "faulty-table", "`Q_left`");
    for word in [
        "normal_force [kN]",
        "?carry=Q_left",
        "`nu_x` as `/motion/creepage_x`",
    ] {
        assert!(refused.text.contains(word), "{word}: {}", refused.text);
    }
    let errors = refused.json["errors"].as_array().expect("errors");
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0]["pointer"], "/columns/Q_left");
    // If the column is mapped and its unit comes from the line of units, the run is the same as with the names of the service.
    let named = send("&column=Q_left:normal_force").await;
    assert_eq!(named.json["columns"][2]["factor"], 1e3, "{}", named.text);
    assert_eq!(named.json["columns"][0]["unit"], "s");
    let own = "Time,s_track,normal_force_n,creepage_x,creepage_y,spin_per_mm\n\
               0.1,1.5,61500,0.001,-0.0002,4e-4\n0.2,3.1,74000,-0.0005,0.0001,3.8e-4\n";
    let own = send_rows(&server, &template, "text/csv", own).await;
    let (named, own) = (rows_of(&server, &named).await, rows_of(&server, &own).await);
    assert_eq!(named, own);
    // A column that is only copied does not change the results.
    let carried = rows_of(&server, &send("&carry=Q_left").await).await;
    assert_eq!(carried[0]["Q_left"], 61.5);
    assert_ne!(carried[0]["force_x_n"], own[0]["force_x_n"]);
    for (query, word) in [
        ("carry=Q_left,nope", "`nope`"),
        ("carry=Q_left&column=Q_left:normal_force", "twice"),
        ("column=Q_left:speed", "`kN`"),
        ("column=Q_left:normal_force%20%5BN%5D", "agree"),
    ] {
        let refused = send(&format!("&{query}")).await;
        assert_problem(&refused, 422, "faulty-table", word);
    }
}

#[tokio::test]
async fn a_quantity_that_the_contact_does_not_have_is_named_in_the_sentence() {
    let server = Server::idle().await;
    let template = kept_template(&server).await;
    let table = "time,Q_left\n[s],[kN]\n0.1,61\n";
    let query = format!("{template}&column=Q_left:wheel_load%20%5BkN%5D");
    let refused = send_rows(&server, &query, "text/csv", table).await;
    assert_problem(&refused, 422, "faulty-case", "/columns/Q_left/0");
    let detail = refused.json["detail"].as_str().expect("a sentence");
    assert!(detail.contains("normal_force_n"), "{detail}");
}

#[tokio::test]
async fn columns_are_known_bounded_and_there_once_in_every_form() {
    let server = Server::idle().await;
    let template = kept_template(&server).await;
    let owned = |titles: &[&str]| titles.iter().map(|title| (*title).to_owned()).collect();
    let many: Vec<String> = (0..=COLUMNS_MAX).map(|k| format!("/labels/k{k}")).collect();
    let cases: [(Vec<String>, &str); 4] = [
        (owned(&["creepage_x", "Q_left"]), "Q_left"),
        (
            owned(&["creepage_x", "wheel_temperature"]),
            "wheel_temperature",
        ),
        (
            owned(&["creepage_x", "/motion/creepage_x"]),
            "/motion/creepage_x",
        ),
        (many, "1000"),
    ];
    for (titles, word) in cases {
        for (form, body) in forms(&one_row(&titles)) {
            let refused = send_rows(&server, &template, form, body).await;
            assert_eq!(refused.status, 422, "{form} {word}: {}", refused.text);
            assert!(refused.text.contains(word), "{form}: {}", refused.text);
        }
        let columns = titles.iter().map(|title| (title.clone(), json!([1e-3])));
        let columns: serde_json::Map<String, Value> = columns.collect();
        let mut case = crate::runs::template("table");
        case["load"]["normal_force_n"] = json!(1e5);
        let body = json!({ "template": case, "columns": columns });
        server.post("/v1/runs", &body).await.is(422);
        server.post("/v1/evaluate", &body).await.is(422);
    }
}

#[tokio::test]
async fn texts_of_rows_come_back_as_they_were_and_are_no_formulas_in_csv() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let texts = ["=HYPERLINK(\"a\")", " =1", "-5", "@SUM(1)", "", "plain"];
    let rows: Vec<String> = texts
        .iter()
        .map(|text| json!({ "creepage_x": 1e-3, "section": text, "=1+1": 2 }).to_string())
        .chain([json!({ "creepage_x": 1e-3, "section": null, "=1+1": 2 }).to_string()])
        .collect();
    let query = format!("{template}&carry=%3D1%2B1");
    let sent = send_rows(&server, &query, "application/x-ndjson", rows.join("\n")).await;
    let found = rows_of(&server, &sent).await;
    let expected: Vec<Value> = texts
        .iter()
        .map(|text| json!(text))
        .chain([Value::Null])
        .collect();
    let sections: Vec<&Value> = found.iter().map(|row| &row["section"]).collect();
    assert_eq!(sections, expected.iter().collect::<Vec<_>>());
    let run = sent.header("location").expect("a location");
    let table = server.get(&format!("{run}/results?format=csv")).await.text;
    let table = Csv::read(&table);
    assert!(table.head.iter().any(|name| name == "'=1+1"));
    let found = table.column("section");
    let expected = [
        "'=HYPERLINK(\"a\")",
        "' =1",
        "-5",
        "'@SUM(1)",
        "",
        "plain",
        "",
    ];
    assert_eq!(found, expected);
    for (row, query) in [
        (json!({ "creepage_x": 1e-3, "section": "a\tb" }), ""),
        (json!({ "creepage_x": 1e-3, "section": "\r=1" }), ""),
        (json!({ "creepage_x": 1e-3, "section": "a\u{0}" }), ""),
        (json!({ "creepage_x": 1e-3, "a\tb": 1 }), "&carry=a%09b"),
    ] {
        let query = format!("{template}{query}");
        let refused = send_rows(&server, &query, "application/x-ndjson", row.to_string()).await;
        assert_problem(&refused, 422, "faulty-case", "control characters");
    }
    let quoted = "creepage_x,section\n0.001,\"a\nb\"\n";
    let refused = send_rows(&server, &template, "text/csv", quoted).await;
    assert_problem(&refused, 422, "faulty-case", "control characters");
}

#[tokio::test]
async fn a_codec_that_is_not_read_is_named_with_those_that_are() {
    let server = Server::idle().await;
    let template = kept_template(&server).await;
    let mut file = encode(&one_row(&["creepage_x".to_owned()])).expect("a file");
    // The codec of a column is the field after its name, encoded as twice its number: 1 is SNAPPY, 4 is BROTLI.
    let codec = b"creepage_x\x15\x02";
    let place = file.windows(codec.len()).rposition(|bytes| bytes == codec);
    file[place.expect("the codec") + codec.len() - 1] = 8;
    let refused = send_rows(&server, &template, PARQUET, file).await;
    let said = "the column `creepage_x` is compressed with BROTLI; allowed: UNCOMPRESSED, SNAPPY, ZSTD, LZ4_RAW";
    assert_problem(&refused, 422, "faulty-table", said);
}
