//! What clients do: submit, wait, list, look, fetch, cancel, delete.

use std::sync::Mutex;
use std::sync::mpsc::channel;

use railhead::contact::error::SolveError;
use reqwest::Method;
use serde_json::{Value, json};

use crate::server::{Server, Setup, example, example_text};

/// The numbers of an array.
fn numbers(value: &Value) -> Vec<f64> {
    let items = value
        .as_array()
        .unwrap_or_else(|| panic!("{value} is no array"));
    items
        .iter()
        .map(|item| {
            item.as_f64()
                .unwrap_or_else(|| panic!("{item} is no number"))
        })
        .collect()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

fn path_of(job: &Value) -> String {
    job["links"]["self"].as_str().expect("a link").to_owned()
}

fn assert_close(left: f64, right: f64, scale: f64, what: &str) {
    assert!(
        (left - right).abs() <= 1e-9 * scale,
        "{what}: {left} and {right} differ"
    );
}

#[tokio::test]
async fn every_example_is_solved_while_the_client_waits() {
    let server = Server::start().await;
    for file in ["hertz-steel", "spin", "pressure-grid", "sweep"] {
        let job = server.solve(&example(&format!("{file}.case.json"))).await;
        assert_eq!(job["state"], "succeeded", "{file}: {job:#}");
        assert_eq!(job["progress"], 1.0, "{file}");
        let path = path_of(&job);
        assert_eq!(
            server.get(&format!("{path}/result")).await.json,
            job["result"],
            "{file}: waiting and fetching agree"
        );
        let last = job["result"]["patches"][0]["points"]
            .as_array()
            .and_then(|points| points.last())
            .expect("a point");
        let sideways = file == "spin";
        let force = number(&last[if sideways { "force_y_n" } else { "force_x_n" }]);
        assert!(force.abs() > 100.0, "{file}: the force is {force}");
        assert!(number(&last["friction_power_n"]) > 0.0, "{file}");
        for name in ["created_at", "started_at", "ended_at"] {
            let time = job[name].as_str().expect("a time");
            assert!(
                time.ends_with('Z') && time.len() == "2026-01-31T09:30:00.000Z".len(),
                "{name} is {time}"
            );
        }
    }
}

#[tokio::test]
async fn wait_that_is_too_short_answers_the_job_as_it_is() {
    let server = Server::idle().await;
    for (prefer, applied) in [
        (Some("wait=0"), Some("wait=0")),
        (Some("respond-async"), None),
        (None, None),
    ] {
        let case = example("spin.case.json");
        let answer = server
            .send(Method::POST, "/v1/jobs", |request| {
                let request = request.json(&case);
                match prefer {
                    Some(prefer) => request.header("prefer", prefer),
                    None => request,
                }
            })
            .await;
        assert_eq!(
            (answer.status, &answer.json["state"]),
            (202, &json!("queued")),
            "{prefer:?}"
        );
        assert_eq!(answer.header("preference-applied"), applied);
        assert_eq!(
            answer.header("location"),
            answer.json["links"]["self"].as_str()
        );
        assert_eq!(answer.header("retry-after"), Some("1"));
        assert_eq!(server.get(&path_of(&answer.json)).await.json, answer.json);
    }
}

#[tokio::test]
async fn case_comes_back_as_submitted() {
    let server = Server::idle().await;
    let case = example("hertz-steel.case.json");
    let path = server.submit(&case).await;
    assert_eq!(server.get(&format!("{path}/case")).await.json, case);
    let job = server.get(&path).await.json;
    assert_eq!(
        (&job["name"], &job["labels"]),
        (&case["name"], &case["labels"])
    );
    assert_eq!(job["batch_id"], Value::Null);
}

#[tokio::test]
async fn same_key_and_case_give_the_same_job() {
    let server = Server::idle().await;
    let send = |key: &'static str| {
        let case = example("spin.case.json");
        server.send(Method::POST, "/v1/jobs", move |request| {
            request.header("idempotency-key", key).json(&case)
        })
    };
    let first = send("one").await.json;
    assert_eq!(send("one").await.json, first);
    assert_ne!(send("two").await.json["id"], first["id"]);
}

#[tokio::test]
async fn list_pages_through_all_jobs_newest_first() {
    let server = Server::idle().await;
    let mut case = example("spin.case.json");
    let mut submitted = Vec::new();
    for number in 0..5 {
        case["labels"] =
            json!({ "line": if number % 2 == 0 { "even" } else { "odd" }, "time": "12:30" });
        submitted.push(server.submit(&case).await);
    }
    submitted.reverse();
    let mut listed = Vec::new();
    let mut next = "/v1/jobs?limit=2".to_owned();
    loop {
        let page = server.get(&next).await.json;
        listed.extend(page["jobs"].as_array().expect("jobs").iter().map(path_of));
        let Some(cursor) = page["next_cursor"].as_str() else {
            break;
        };
        assert!(
            cursor
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_'),
            "{cursor}"
        );
        next = format!("/v1/jobs?limit=2&cursor={cursor}");
    }
    assert_eq!(listed, submitted);
    let count = async |query: &str| {
        let page = server.get(&format!("/v1/jobs?{query}")).await.json;
        page["jobs"].as_array().expect("jobs").len()
    };
    server
        .send(
            Method::POST,
            &format!("{}/cancel", submitted[0]),
            |request| request,
        )
        .await;
    assert_eq!(count("state=cancelled").await, 1);
    assert_eq!(count("state=queued").await, 4);
    assert_eq!(count("label=line:odd").await, 2);
    assert_eq!(count("label=line:even&state=queued").await, 2);
    assert_eq!(
        count("label=time:12:30").await,
        5,
        "only the first colon divides"
    );
    let created = server.get(&submitted[4]).await.json["created_at"]
        .as_str()
        .expect("a time")
        .to_owned();
    assert_eq!(count(&format!("created_after={created}")).await, 5);
    assert_eq!(count(&format!("created_before={created}")).await, 0);
    assert_eq!(
        count("created_after=2000-01-01T00:00:00%2B02:00&created_before=2001-01-01T00:00:00Z")
            .await,
        0
    );
}

#[tokio::test]
async fn fields_add_up_to_the_resultants() {
    let server = Server::start().await;
    let job = server.solve(&example("spin.case.json")).await;
    let path = path_of(&job);
    let patch = &job["result"]["patches"][0];
    let point = &patch["points"][0];
    let load = number(&patch["normal_force_n"]);
    let resultants = server.get(&format!("{path}/resultants")).await.json;
    for name in [
        "force_x_n",
        "force_y_n",
        "moment_z_n_mm",
        "friction_power_n",
    ] {
        assert_eq!(
            resultants["patches"][0]["points"][0][name], point[name],
            "{name}"
        );
    }
    let sum = |cells: &Value, name: &str| -> f64 {
        let (dx, dy) = (numbers(&cells["dx_mm"]), numbers(&cells["dy_mm"]));
        numbers(&cells[name])
            .iter()
            .zip(dx.iter().zip(&dy))
            .map(|(value, (dx, dy))| value * dx * dy)
            .sum()
    };
    let tractions = server
        .get(&format!("{path}/tractions?point=0&patch=0"))
        .await
        .json;
    assert_close(
        sum(&tractions["cells"], "traction_x_mpa"),
        number(&point["force_x_n"]),
        load,
        "force x",
    );
    assert_close(
        sum(&tractions["cells"], "traction_y_mpa"),
        number(&point["force_y_n"]),
        load,
        "force y",
    );
    let pressure = server.get(&format!("{path}/pressure")).await.json;
    assert_close(
        sum(&pressure["cells"], "pressure_mpa"),
        load,
        load,
        "normal force",
    );
    assert!(
        tractions["cells"].get("pressure_mpa").is_none(),
        "a field answers its own values only"
    );
    let slip = server.get(&format!("{path}/slip")).await.json;
    assert_eq!(
        numbers(&slip["cells"]["slip_x"]).len(),
        numbers(&pressure["cells"]["pressure_mpa"]).len()
    );
}

/// Area inside closed polygons; holes count negative.
fn area(polygons: &Value) -> f64 {
    let polygons = polygons
        .as_array()
        .expect("polygons")
        .iter()
        .map(|polygon| {
            let corners: Vec<Vec<f64>> = polygon
                .as_array()
                .expect("corners")
                .iter()
                .map(numbers)
                .collect();
            let next = corners.iter().cycle().skip(1);
            corners
                .iter()
                .zip(next)
                .map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1]))
                .sum::<f64>()
        });
    polygons.sum()
}

#[tokio::test]
async fn outlines_enclose_the_areas_of_the_zones() {
    let server = Server::start().await;
    let job = server.solve(&example("hertz-steel.case.json")).await;
    let zones = server.get(&format!("{}/zones", path_of(&job))).await.json;
    let (stick, slip) = (
        number(&zones["stick_area_mm2"]),
        number(&zones["slip_area_mm2"]),
    );
    assert!(
        stick > 1.0 && slip > 1.0,
        "the patch sticks on {stick} and slips on {slip} mm²"
    );
    let patch = &job["result"]["patches"][0];
    assert_eq!(
        (
            &patch["points"][0]["stick_area_mm2"],
            &patch["points"][0]["slip_area_mm2"]
        ),
        (&zones["stick_area_mm2"], &zones["slip_area_mm2"])
    );
    assert_close(stick + slip, number(&patch["area_mm2"]), 1.0, "both areas");
    let cells = area(&zones["outlines"]["stick"]) + area(&zones["outlines"]["slip"]);
    let words = zones["cells"]["zone"].as_array().expect("zones");
    for (word, count, expected) in [
        ("stick", &zones["stick_cells"], stick),
        ("slip", &zones["slip_cells"], slip),
    ] {
        assert_eq!(
            words.iter().filter(|zone| **zone == word).count() as u64,
            count.as_u64().expect("a count"),
            "{word}"
        );
        // The areas are shares of the patch's area, which the cells approximate.
        let share = area(&zones["outlines"][word]) / cells;
        let expected = expected / (stick + slip);
        assert!(
            (share - expected).abs() < 1e-9,
            "{word}: the outline encloses {share} of the cells, not {expected}"
        );
    }
    let whole = area(&zones["outlines"]["patch"]);
    let contact = number(&patch["area_mm2"]);
    assert!(
        (whole - contact).abs() < 0.02 * contact,
        "the outline of the patch encloses {whole}, not {contact}"
    );
}

#[tokio::test]
async fn grid_is_ordered_by_y_then_x_and_empty_outside() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    let pressure = server
        .get(&format!("{path}/pressure?grid=21x11"))
        .await
        .json;
    let (x, y) = (numbers(&pressure["x_mm"]), numbers(&pressure["y_mm"]));
    assert_eq!((x.len(), y.len()), (21, 11));
    assert!(x.is_sorted() && y.is_sorted());
    // The ellipse of the example has semi-axes of 8 mm and 4 mm.
    for (row, y) in pressure["pressure_mpa"]
        .as_array()
        .expect("rows")
        .iter()
        .zip(&y)
    {
        assert_eq!(row.as_array().expect("a row").len(), 21);
        for (value, x) in row.as_array().expect("a row").iter().zip(&x) {
            let inside = (x / 8.0).powi(2) + (y / 4.0).powi(2);
            match value.as_f64() {
                Some(value) => assert!(inside < 1.1 && value > 0.0, "{value} MPa at ({x}, {y})"),
                None => assert!(inside > 0.9 && value.is_null(), "nothing at ({x}, {y})"),
            }
        }
    }
    let peak = number(&pressure["pressure_mpa"][5][10]);
    assert!(
        (peak - 1.5 * 82_000.0 / (std::f64::consts::PI * 32.0)).abs() < 0.03 * peak,
        "Hertz's peak is {peak} MPa"
    );
    for (part, name) in [
        ("tractions", "traction_y_mpa"),
        ("slip", "slip_y"),
        ("zones", "zone"),
    ] {
        let field = server.get(&format!("{path}/{part}?grid=4x3")).await.json;
        let rows = field[name]
            .as_array()
            .unwrap_or_else(|| panic!("{part} has no {name}: {field}"));
        assert!(
            rows.len() == 3
                && rows
                    .iter()
                    .all(|row| row.as_array().is_some_and(|row| row.len() == 4)),
            "{part}"
        );
        assert!(
            rows[1][1].is_number() || rows[1][1] == "stick" || rows[1][1] == "slip",
            "{part}: {}",
            rows[1][1]
        );
    }
}

#[tokio::test]
async fn each_motion_of_a_sweep_is_fetched_by_its_number() {
    let server = Server::start().await;
    let job = server.solve(&example("sweep.case.json")).await;
    let path = path_of(&job);
    let all = server.get(&format!("{path}/resultants")).await.json;
    let forces: Vec<f64> = all["total"]
        .as_array()
        .expect("totals")
        .iter()
        .map(|total| number(&total["force_x_n"]).abs())
        .collect();
    assert_eq!(forces.len(), 11);
    assert!(
        forces[0].abs() < 1e-6 && forces.is_sorted(),
        "a creep curve rises from 0: {forces:?}"
    );
    let one = server
        .get(&format!("{path}/resultants?point=10&patch=0"))
        .await
        .json;
    assert_eq!(one["total"], json!([all["total"][10]]));
    assert_eq!(
        one["patches"][0]["points"],
        json!([all["patches"][0]["points"][10]])
    );
    let slipping = async |point: u32| {
        number(
            &server
                .get(&format!("{path}/zones?point={point}"))
                .await
                .json["slip_area_mm2"],
        )
    };
    assert!(slipping(10).await > slipping(1).await);
    for query in [
        "zones?point=11",
        "zones?patch=1",
        "resultants?point=11",
        "resultants?patch=1",
    ] {
        let answer = server.get(&format!("{path}/{query}")).await;
        assert_eq!(
            (answer.status, &answer.json["type"]),
            (400, &json!("/problems/bad-query")),
            "{query}"
        );
    }
    for query in ["point=11", "patch=1"] {
        let fields = path_of(&server.solve(&example("spin.case.json")).await);
        let answer = server.get(&format!("{fields}/tractions?{query}")).await;
        assert_eq!(
            (answer.status, &answer.json["type"]),
            (400, &json!("/problems/bad-query")),
            "{query}"
        );
    }
}

#[tokio::test]
async fn running_job_is_cancelled_on_request() {
    let (started, waiting) = channel();
    let started = Mutex::new(started);
    let setup = Setup::new().solving(move |_, monitor| {
        let _ = started.lock().expect("a lock").send(());
        loop {
            if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.5) {
                return Err(SolveError::from(stop));
            }
            std::thread::yield_now();
        }
    });
    let server = setup.start().await;
    let path = server.submit(&example("spin.case.json")).await;
    let waiting = tokio::task::spawn_blocking(move || waiting.recv());
    waiting
        .await
        .expect("a thread")
        .expect("the solve has begun");
    let early = server.get(&format!("{path}/result")).await;
    assert_eq!(
        (early.status, early.header("retry-after")),
        (409, Some("1"))
    );
    let answer = server
        .send(Method::POST, &format!("{path}/cancel"), |request| request)
        .await;
    assert!([200, 202].contains(&answer.status), "{}", answer.text);
    let id = path.trim_start_matches("/v1/jobs/").parse().expect("an id");
    server
        .jobs
        .wait(id, std::time::Duration::from_secs(60))
        .await
        .expect("the job");
    assert_eq!(server.get(&path).await.json["state"], "cancelled");
    let again = server
        .send(Method::POST, &format!("{path}/cancel"), |request| request)
        .await;
    assert_eq!(
        (again.status, &again.json["state"]),
        (200, &json!("cancelled")),
        "cancelling is idempotent"
    );
}

#[tokio::test]
async fn deleted_job_is_gone_with_its_result() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("spin.case.json")).await);
    assert_eq!(server.delete(&path).await.status, 204);
    for part in ["", "/result", "/tractions", "/case"] {
        assert_eq!(
            server.get(&format!("{path}{part}")).await.status,
            404,
            "{part}"
        );
    }
    assert_eq!(server.delete(&path).await.status, 404);
}

#[tokio::test]
async fn checking_a_case_tells_its_cost_and_makes_no_job() {
    let server = Server::idle().await;
    let check = async |file: &str| server.post("/v1/cases/check", &example(file)).await.json;
    let spin = check("spin.case.json").await;
    assert_eq!(
        spin["outputs"],
        json!(["resultants", "zones", "tractions", "pressure", "slip"])
    );
    assert!(
        number(&spin["estimate"]["bytes"]) > 0.0 && number(&spin["estimate"]["seconds"]) > 0.0,
        "{spin}"
    );
    let sweep = check("sweep.case.json").await;
    assert_eq!(sweep["motions"], 11);
    assert_ne!(sweep["digest"], spin["digest"]);
    assert_eq!(check("spin.case.json").await["digest"], spin["digest"]);
    assert_eq!(server.get("/v1/jobs").await.json["jobs"], json!([]));
}

#[tokio::test]
async fn methods_name_every_word_of_the_contract() {
    let server = Server::idle().await;
    let abilities = server.get("/v1/methods").await.json;
    let contract: Value = server.get("/openapi.json").await.json;
    let schemas = &contract["components"]["schemas"];
    let words = |list: &Value| -> Vec<String> {
        let mut words: Vec<String> = list
            .as_array()
            .expect("a list")
            .iter()
            .map(|item| item["name"].as_str().expect("a name").to_owned())
            .collect();
        words.sort();
        words
    };
    let enumerated = |schema: &Value| -> Vec<String> {
        let variants = schema["oneOf"]
            .as_array()
            .cloned()
            .unwrap_or_else(|| vec![schema.clone()]);
        let words = variants.iter().flat_map(|variant| {
            let tag = if variant["properties"]["type"].is_object() {
                &variant["properties"]["type"]
            } else {
                variant
            };
            let word = tag["const"].as_str().map(|word| vec![json!(word)]);
            word.or_else(|| tag["enum"].as_array().cloned())
                .unwrap_or_else(|| panic!("no words in {variant}"))
        });
        let mut words: Vec<String> = words
            .map(|word| word.as_str().expect("a word").to_owned())
            .collect();
        words.sort();
        words
    };
    assert_eq!(words(&abilities["methods"]), enumerated(&schemas["Method"]));
    assert_eq!(
        words(&abilities["contacts"]),
        enumerated(&schemas["Contact"])
    );
    assert_eq!(words(&abilities["outputs"]), enumerated(&schemas["Output"]));
    let defaults = |list: &Value| {
        words(&Value::Array(
            list.as_array()
                .expect("a list")
                .iter()
                .filter(|item| item["default"] == true)
                .cloned()
                .collect(),
        ))
    };
    let mut case = example("sweep.case.json");
    case.as_object_mut().expect("an object").remove("outputs");
    case.as_object_mut().expect("an object").remove("solver");
    let checked = server.post("/v1/cases/check", &case).await.json;
    assert_eq!(json!(defaults(&abilities["outputs"])), checked["outputs"]);
    assert_eq!(
        json!(defaults(&abilities["methods"])),
        json!([checked["method"]])
    );
    for contact in abilities["contacts"].as_array().expect("contacts") {
        let file = match contact["name"].as_str() {
            Some("radii") => "hertz-steel.case.json",
            Some("ellipse") => "spin.case.json",
            Some("pressure_grid") => "pressure-grid.case.json",
            other => panic!("{other:?} has no example"),
        };
        let mut case = example(file);
        case.as_object_mut().expect("an object").remove("load");
        let status = server.post("/v1/cases/check", &case).await.status;
        assert_eq!(
            status,
            if contact["needs_load"] == true {
                422
            } else {
                200
            },
            "{contact}"
        );
    }
}

#[tokio::test]
async fn readable_contract_needs_no_other_server() {
    let server = Server::idle().await;
    let root = server.get("/").await;
    assert_eq!(
        (root.status, root.header("location")),
        (307, Some("/docs/"))
    );
    let page = server.get("/docs/").await;
    assert_eq!(page.status, 200);
    let mut assets = 0;
    for part in page
        .text
        .split(['"', '\''])
        .filter(|part| part.ends_with(".js") || part.ends_with(".css"))
    {
        assert!(!part.contains("//"), "{part} is on another server");
        let asset = server
            .get(&format!("/docs/{}", part.trim_start_matches("./")))
            .await;
        assert_eq!(asset.status, 200, "{part}");
        assets += 1;
    }
    assert!(assets >= 3, "{}", page.text);
    let start = server.get("/docs/swagger-initializer.js").await.text;
    assert!(
        start.contains("/openapi.json") && start.contains("\"validatorUrl\": \"none\""),
        "{start}"
    );
    assert_eq!(
        server.get("/openapi.json").await.text,
        railhead::http::openapi_json()
    );
}

#[tokio::test]
async fn request_id_is_taken_over_or_made() {
    let server = Server::idle().await;
    let answer = server
        .send(Method::GET, "/healthz", |request| {
            request.header("x-request-id", "abc-1")
        })
        .await;
    assert_eq!(answer.header("x-request-id"), Some("abc-1"));
    let (one, two) = (server.get("/v1/jobs").await, server.get("/nowhere").await);
    assert!(one.header("x-request-id").is_some_and(|id| id.len() == 36));
    assert_ne!(
        one.header("x-request-id"),
        two.header("x-request-id"),
        "every request has its own"
    );
}

#[tokio::test]
async fn tour_uses_existing_examples_and_routes() {
    let server = Server::idle().await;
    let tour = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/api/README.md"))
        .expect("the tour");
    for file in tour
        .split(['@', '`', ' ', '"', '\'', '\n', '(', ')'])
        .filter(|word| word.starts_with("api/examples/") && word.ends_with(".json"))
    {
        assert!(
            !example_text(file.trim_start_matches("api/examples/")).is_empty(),
            "{file}"
        );
    }
    let contract = server.get("/openapi.json").await.json;
    let known = contract["paths"].as_object().expect("paths");
    let mut called = 0;
    for line in tour.lines().filter(|line| line.contains("curl ")) {
        let Some((_, rest)) = line.split_once("localhost:8080") else {
            continue;
        };
        let path = rest
            .split(['"', '\'', ' ', '?'])
            .next()
            .expect("a path")
            .replace("$JOB", "/v1/jobs/{id}");
        assert!(
            known.contains_key(&path),
            "{line}: the contract has no {path}"
        );
        called += 1;
    }
    assert!(called >= 5, "the tour calls {called} routes only");
}
