//! Columns of tables that come in and go out: titles, units, bounds, texts, damage.

use railhead::jobs::codec::table::{COLUMNS_MAX, RowTable, TableColumn};
use serde_json::{Value, json};

use crate::batches::{results, send, small};
use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::runs::answers;
use crate::server::{Answer, Server};
use crate::table_forms::{ARROW, NPZ, forms, kept_template, send_rows};

async fn rows_of(server: &Server, sent: &Answer) -> Vec<Value> {
    assert_eq!(sent.status, 202, "{}", sent.text);
    answers(server, &sent.location()).await
}

/// One row of numbers with these titles.
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
    let refused = send_rows(&server, &template, "text/csv", table).await;
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
    // Named with the unit of the line of units, it is the same run as in the words of the service.
    let named = send_rows(
        &server,
        &format!("{template}&column=Q_left:normal_force"),
        "text/csv",
        table,
    )
    .await;
    assert_eq!(named.json["columns"][2]["factor"], 1e3, "{}", named.text);
    assert_eq!(named.json["columns"][0]["unit"], "s");
    let own = "Time,s_track,normal_force_n,creepage_x,creepage_y,spin_per_mm\n\
               0.1,1.5,61500,0.001,-0.0002,4e-4\n0.2,3.1,74000,-0.0005,0.0001,3.8e-4\n";
    let own = send_rows(&server, &template, "text/csv", own).await;
    let (named, own) = (rows_of(&server, &named).await, rows_of(&server, &own).await);
    assert_eq!(named, own);
    // Carried along, it changes nothing.
    let carried = send_rows(
        &server,
        &format!("{template}&carry=Q_left"),
        "text/csv",
        table,
    )
    .await;
    let carried = rows_of(&server, &carried).await;
    assert_eq!(carried[0]["Q_left"], 61.5);
    assert_ne!(carried[0]["force_x_n"], own[0]["force_x_n"]);
    for (query, word) in [
        ("carry=Q_left,nope", "`nope`"),
        ("carry=Q_left&column=Q_left:normal_force", "twice"),
        ("column=Q_left:speed", "`kN`"),
        ("column=Q_left:normal_force%20%5BN%5D", "agree"),
    ] {
        let refused = send_rows(&server, &format!("{template}&{query}"), "text/csv", table).await;
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
        let _refused = server.post("/v1/runs", &body).await.is(422);
        server.post("/v1/evaluate", &body).await.is(422);
    }
    let evaluate = async |form: &str, body: Vec<u8>| {
        let path = format!("/v1/evaluate?template={template}");
        server.post_as(&path, form, body).await
    };
    let twice = owned(&["creepage_x", "/motion/creepage_x"]);
    for (form, body) in forms(&one_row(&twice)) {
        if ["text/csv", ARROW, NPZ].contains(&form) {
            let refused = evaluate(form, body).await;
            assert_problem(&refused, 422, "faulty-case", "for one member");
        }
    }
    let plain = evaluate(
        "text/csv",
        b"normal_force_n,creepage_x\n61500,0.001\n".to_vec(),
    )
    .await;
    let units = "Normal force;nu_x\n[kN];[%]\n61,5;0,1\n";
    let units = evaluate("text/csv", units.as_bytes().to_vec()).await;
    assert_eq!(plain.status, 200, "{}", plain.text);
    assert_eq!(units.json, plain.json, "{}", units.text);
}

#[tokio::test]
async fn a_table_of_a_batch_is_read_with_units_semicolons_and_decimal_commas() {
    let server = Server::start().await;
    let query = format!("?template={}", server.keep(&small("template")).await);
    let mut cases = Vec::new();
    for table in [
        "label:km,normal_force_n,creepage_x\n37.2,64100,0.002\n37.4,,\n37.6,64100,\n",
        "label:km;Normal force [kN];nu_x [%]\n37.2;64,1;0,2\n37.4;;\n37.6;64,1;\n",
        "label:km\tNormal force\tcreepage_x\n[km]\t[kN]\t[%]\n37.2\t64,1\t0,2\n37.4\t\t\n37.6\t64,1\t\n",
    ] {
        let batch = send(&server, &query, "text/csv", table.to_owned()).await;
        assert_eq!(batch.status, 202, "{}", batch.text);
        let mut own = Vec::new();
        for line in results(&server, &batch.json, "?wait=60").await {
            let id = line["id"].as_str().expect("an id");
            own.push(server.read(&format!("/v1/jobs/{id}/case")).await);
        }
        cases.push(own);
    }
    let of = |km: &str, load: f64, creepage: &Value| {
        let mut case = small("template");
        case["labels"]["km"] = json!(km);
        case["load"]["normal_force_n"] = json!(load);
        case["motion"]["creepage_x"] = creepage.clone();
        case
    };
    // Nothing of a row stays for the next.
    let plain = small("template");
    let creepage = &plain["motion"]["creepage_x"];
    let load = plain["load"]["normal_force_n"].as_f64().expect("a load");
    let expected = [
        of("37.2", 64_100.0, &json!(0.002)),
        of("37.4", load, creepage),
        of("37.6", 64_100.0, creepage),
    ];
    for own in &cases {
        for (found, expected) in own.iter().zip(&expected) {
            for place in ["/labels/km", "/load/normal_force_n", "/motion/creepage_x"] {
                let number = |case: &Value| {
                    let value = case.pointer(place).expect("a value");
                    value
                        .as_f64()
                        .map_or_else(|| value.clone(), |number| json!(number))
                };
                assert_eq!(number(found), number(expected), "{place}");
            }
        }
    }
    for (table, word) in [
        ("km,normal_force_n\n1,2\n", "label:"),
        ("Q_left [kN]\n61\n", "normal_force [kN]"),
        ("normal_force_n\nkN\n61\n", "agree"),
        ("spin\n0.4\n", "has no unit"),
    ] {
        let refused = send(&server, &query, "text/csv", table.to_owned()).await;
        assert_problem(&refused, 422, "faulty-table", word);
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
async fn damaged_files_of_columns_are_refused_and_are_no_failures_of_the_service() {
    let server = Server::idle().await;
    let template = kept_template(&server).await;
    let table = RowTable {
        columns: vec![
            ("creepage_x".to_owned(), TableColumn::Numbers(vec![1e-3; 9])),
            (
                "section".to_owned(),
                TableColumn::Texts(vec![Some("curve".to_owned()); 9]),
            ),
        ],
    };
    for (form, file) in forms(&table).split_off(2) {
        // Every fifth byte, so that lengths and offsets of each kind are hit.
        for place in (0..file.len()).step_by(5) {
            let mut damaged = file.clone();
            let end = (place + 4).min(damaged.len());
            damaged[place..end].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f][..end - place]);
            let answer = send_rows(&server, &template, form, damaged).await;
            assert!(
                [202, 413, 422].contains(&answer.status),
                "{form}, byte {place}: {}",
                answer.text
            );
        }
    }
}
