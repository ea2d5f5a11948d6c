//! Tests pictures: they are well-formed, to scale, safe for any name of a case, and readable without colour.

use resvg::tiny_skia::Pixmap;
use resvg::usvg::{Options, Tree};
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::results::path_of;
use crate::server::{Server, example};

fn asked(file: &str, outputs: &Value) -> Value {
    let mut case = example(file);
    case["outputs"] = outputs.clone();
    case
}

fn everything() -> Value {
    json!(["resultants", "zones", "tractions", "pressure", "slip"])
}

#[tokio::test]
async fn every_field_is_drawn_as_svg_and_as_png() {
    let server = Server::start().await;
    let mut case = asked("two-patches.case.json", &everything());
    case["solver"] = json!({ "mesh": { "strips": 8, "cells": 8 } });
    let path = path_of(&server.solve(&case).await);
    for (field, label, part) in [
        ("traction", "traction in MPa", "tractions"),
        ("pressure", "pressure in MPa", "pressure"),
        ("slip", "slip / rolling speed in 10", "slip"),
        ("zones", "stick", "zones"),
    ] {
        let svg = server
            .get(&format!("{path}/plot.svg?field={field}&patch=1"))
            .await
            .is(200);
        assert_eq!(svg.header("content-type"), Some("image/svg+xml"));
        Tree::from_str(&svg.text, &Options::default()).expect("well-formed SVG");
        for word in [label, "x in mm", "y in mm", "rolling", "patch 1 of 0 to 1"] {
            assert!(
                svg.text.contains(word),
                "the picture of {field} lacks `{word}`"
            );
        }
        let arrows = svg.text.contains("stroke-width=\"2.8\"");
        assert_eq!(arrows, field != "pressure", "arrows of {field}");
        let png = server
            .get(&format!("{path}/plot.png?field={field}&patch=1&width=320"))
            .await
            .is(200);
        assert_eq!(png.header("content-type"), Some("image/png"));
        let pixels = Pixmap::decode_png(&png.bytes).expect("a PNG");
        assert_eq!(pixels.width(), 320);
        let same = server
            .get(&format!("{path}/{part}?format=svg&patch=1"))
            .await;
        assert_eq!(
            same.text, svg.text,
            "the part and the picture of {field} differ"
        );
    }
}

/// Returns the lightness of a pixel, from 0 to 255.
fn light(pixels: &Pixmap, x: u32, y: u32) -> f64 {
    let pixel = pixels.pixel(x, y).expect("a pixel");
    0.2126 * f64::from(pixel.red())
        + 0.7152 * f64::from(pixel.green())
        + 0.0722 * f64::from(pixel.blue())
}

#[tokio::test]
async fn name_of_a_case_cannot_become_markup() {
    let server = Server::start().await;
    let mut case = asked("spin.case.json", &everything());
    let name = "</text><script>alert(1)</script>&\"'<image href='http://x/'/> Ä ✓";
    case["name"] = json!(name);
    let path = path_of(&server.solve(&case).await);
    let svg = server.get(&format!("{path}/plot.svg")).await;
    assert!(!svg.text.contains("<script") && !svg.text.contains("<image"));
    assert!(svg.text.contains("&lt;script&gt;"), "the name is shown");
    Tree::from_str(&svg.text, &Options::default()).expect("well-formed SVG");
    let policy = svg.header("content-security-policy").expect("a policy");
    assert!(policy.contains("default-src 'none'"), "{policy}");
}

#[tokio::test]
async fn stick_zone_is_drawn_where_zones_are_known() {
    let server = Server::start().await;
    let with = path_of(&server.solve(&asked("spin.case.json", &everything())).await);
    let without = asked("spin.case.json", &json!(["tractions"]));
    let without = path_of(&server.solve(&without).await);
    let border = "border of the stick zone";
    let text = server.get(&format!("{with}/plot.svg")).await.text;
    assert!(text.contains(border));
    let text = server.get(&format!("{without}/plot.svg")).await.text;
    assert!(!text.contains(border) && text.contains("traction in MPa"));
    let mut sliding = asked("spin.case.json", &everything());
    sliding["motion"] = json!({ "creepage_x": 0.1, "creepage_y": 0, "spin_per_mm": 0 });
    let sliding = path_of(&server.solve(&sliding).await);
    let text = server.get(&format!("{sliding}/plot.svg")).await.text;
    assert!(text.contains("slip everywhere") && !text.contains(border));
}

#[tokio::test]
async fn pictures_that_cannot_be_drawn_say_why() {
    let server = Server::start().await;
    let case = asked("spin.case.json", &json!(["tractions"]));
    let path = path_of(&server.solve(&case).await);
    for (query, word) in [
        ("plot.svg?field=stress", "`traction`"),
        ("plot.png?width=47", "48 to 2400"),
        ("plot.svg?width=2401", "48 to 2400"),
        ("plot.svg?range=3", "`low,high`"),
        ("plot.svg?range=3,3", "`low,high`"),
        ("plot.svg?range=0,inf", "`low,high`"),
        ("plot.svg?field=zones&range=0,1", "no scale"),
        ("plot.svg?patch=1", "patch"),
        ("plot.svg?point=1", "point"),
        ("plot.svg?grid=4x4", "`grid`"),
        ("tractions?format=png&grid=4x4", "cells themselves"),
    ] {
        let answer = server.get(&format!("{path}/{query}")).await;
        assert_problem(&answer, 400, "bad-query", word);
    }
    for field in ["zones", "slip"] {
        let answer = server.get(&format!("{path}/plot.svg?field={field}")).await;
        let word = format!("`{field}`");
        assert_problem(&answer, 404, "output-not-asked", &word);
    }
    let idle = Server::idle().await;
    let path = idle.submit(&example("spin.case.json")).await;
    let answer = idle.get(&format!("{path}/plot.svg")).await;
    assert_problem(&answer, 409, "result-not-ready", "");
}

/// Returns, for every shape, whether it is filled and its box `[left, right, top, bottom]` in units of the picture.
fn shapes(svg: &str) -> Vec<(bool, [f64; 4])> {
    fn gather(group: &resvg::usvg::Group, into: &mut Vec<(bool, [f64; 4])>) {
        for node in group.children() {
            match node {
                resvg::usvg::Node::Group(inner) => gather(inner, into),
                resvg::usvg::Node::Path(path) => {
                    let shape = path.abs_bounding_box();
                    let sides = [shape.left(), shape.right(), shape.top(), shape.bottom()];
                    into.push((path.fill().is_some(), sides.map(f64::from)));
                }
                _ => {}
            }
        }
    }
    let tree = Tree::from_str(svg, &Options::default()).expect("well-formed SVG");
    let mut found = Vec::new();
    gather(tree.root(), &mut found);
    found
}

/// Returns a case of few cells at default accuracy.
fn at_default_accuracy() -> Value {
    let mut case = asked("spin.case.json", &everything());
    case.as_object_mut().expect("a case").remove("solver");
    case
}

#[tokio::test]
async fn values_are_smooth_and_end_at_the_border_of_the_patch() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&at_default_accuracy()).await);
    for field in ["traction", "pressure", "slip", "zones"] {
        let svg = server
            .get(&format!("{path}/plot.svg?field={field}&width=160"))
            .await;
        // A small picture shows only the patch. Its ellipse of 16 mm by 8 mm is 156 units wide.
        let shapes = shapes(&svg.text);
        let filled: Vec<[f64; 4]> = shapes
            .iter()
            .filter(|(filled, _)| *filled)
            .map(|s| s.1)
            .collect();
        let [left, right, top, bottom] = filled[0];
        assert!(
            (right - left - 156.0).abs() < 0.5,
            "{field}: {:?}",
            filled[0]
        );
        assert!(
            (bottom - top - 78.0).abs() < 1.0,
            "{field}: {:?}",
            filled[0]
        );
        // Coordinates are rounded to a tenth, and curves may deviate by less than half a pixel.
        for (_, inner) in &shapes {
            let inside = inner[0] >= left - 0.3 && inner[1] <= right + 0.3;
            let inside = inside && inner[2] >= top - 0.3 && inner[3] <= bottom + 0.3;
            assert!(inside, "{field}: {inner:?} outside {:?}", filled[0]);
        }
        assert!(!svg.text.contains("crispEdges"), "no cells are drawn");
    }
}

#[tokio::test]
async fn pictures_share_a_scale_when_asked() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&at_default_accuracy()).await);
    let get = async |query: &str| {
        let answer = server
            .get(&format!("{path}/plot.png?field=pressure&width=100{query}"))
            .await;
        assert_eq!(answer.status, 200, "{query}");
        Pixmap::decode_png(&answer.bytes).expect("a PNG")
    };
    let middle = |pixels: &Pixmap| light(pixels, pixels.width() / 2, pixels.height() / 2);
    let own = get("").await;
    let result = server.read(&format!("{path}/result")).await;
    let largest = result["patches"][0]["pressure_max_mpa"]
        .as_f64()
        .expect("a number");
    let same = get(&format!("&range=0,{largest}")).await;
    let wider = get(&format!("&range=0,{}", 3.0 * largest)).await;
    let above = get(&format!("&range={},{}", 2.0 * largest, 3.0 * largest)).await;
    assert!((middle(&own) - middle(&same)).abs() < 12.0);
    assert!(
        middle(&wider) < 0.6 * middle(&same),
        "a third of the scale is darker"
    );
    assert!(
        middle(&above) < middle(&wider),
        "below the scale is its first colour"
    );
    let svg = server
        .get(&format!("{path}/plot.svg?field=pressure&range=-1000,5000"))
        .await;
    assert!(
        svg.text.contains(">−1000<") && svg.text.contains(">5000<"),
        "the scale shows both ends"
    );
}

#[tokio::test]
async fn small_pictures_are_small_files() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&at_default_accuracy()).await);
    // The size of large PNG pictures is not limited.
    for (form, width, most) in [
        ("svg", 120, 10_000),
        ("png", 120, 10_000),
        ("svg", 800, 80_000),
    ] {
        for field in ["traction", "pressure", "slip", "zones"] {
            let query = format!("{path}/plot.{form}?field={field}&width={width}");
            let bytes = server.get(&query).await.bytes;
            if let Ok(folder) = std::env::var("RAILHEAD_PICTURES") {
                let file = format!("{folder}/{field}-{width}.{form}");
                std::fs::write(file, &bytes).expect("written");
            }
            let size = bytes.len();
            assert!(size <= most, "{field} as {form}, {width} wide: {size}");
        }
    }
}

#[tokio::test]
async fn a_creep_curve_has_a_bar_for_every_estimated_error() {
    let server = Server::start().await;
    let path = path_of(&server.solve(&example("sweep.case.json")).await);
    let svg = server
        .get(&format!("{path}/plot.svg?view=curve"))
        .await
        .is(200);
    Tree::from_str(&svg.text, &Options::default()).expect("well-formed SVG");
    for word in ["creepage x", "force in N", "force y (across)", "μN"] {
        assert!(svg.text.contains(word), "the curve lacks `{word}`");
    }
    let png = server
        .get(&format!("{path}/plot.png?view=curve&width=640"))
        .await;
    assert_eq!(Pixmap::decode_png(&png.bytes).expect("a PNG").width(), 640);

    // The length of a bar is twice the error on the scale of the curve.
    let result = server.read(&format!("{path}/resultants")).await;
    let total = result["total"].as_array().expect("motions");
    let force = |k: usize| total[k]["force_x_n"].as_f64().expect("a force");
    let error = |k: usize| {
        total[k]["error_estimate"]["force_x_n"]
            .as_f64()
            .expect("an error")
    };
    let paths: Vec<&str> = svg
        .text
        .lines()
        .filter(|line| line.contains("#0b5a9e"))
        .collect();
    let numbers = |text: &str| -> Vec<f64> {
        let parts = text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
        parts.filter_map(|part| part.parse().ok()).collect()
    };
    let data = |line: &str| line.split('"').nth(1).expect("a path").to_owned();
    let line = numbers(&data(paths[0]));
    let last = total.len() - 1;
    let scale = (line[2 * last + 1] - line[1]).abs() / (force(last) - force(0)).abs();
    let bars = data(paths[1]);
    let bar = numbers(bars.split('M').nth(1).expect("a bar"));
    let length = (bar[1] - bar[2]).abs();
    let expected = 2.0 * error(0) * scale;
    assert!((length - expected).abs() < 0.03, "{length} for {expected}");

    let single = path_of(&server.solve(&example("spin.case.json")).await);
    let refused = server.get(&format!("{single}/plot.svg?view=curve")).await;
    assert_problem(&refused, 400, "bad-query", "several");
}

#[tokio::test]
async fn sections_and_patches_on_the_profiles_are_drawn_where_there_are_any() {
    let server = Server::start().await;
    let mut case = asked("wheel-rail-flange.case.json", &everything());
    case["solver"] = json!({ "mesh": { "strips": 8, "cells": 8 } });
    let job = server.solve(&case).await;
    let path = path_of(&job);
    let patches = job["result"]["patches"].as_array().expect("patches").len();
    let standing = server
        .get(&format!("{path}/plot.svg?view=profiles"))
        .await
        .is(200);
    Tree::from_str(&standing.text, &Options::default()).expect("well-formed SVG");
    let tags = standing.text.matches("<circle").count();
    let combs = standing.text.matches("fill-opacity=\"0.75\"").count();
    assert_eq!((tags, combs), (patches, patches));
    assert!(standing.text.contains("y to the left in mm"));

    let section = server
        .get(&format!("{path}/plot.svg?view=section&patch=1"))
        .await
        .is(200);
    Tree::from_str(&section.text, &Options::default()).expect("well-formed SVG");
    for word in [
        "along rolling at y =",
        "across at x =",
        "bound of friction",
        "patch 1 of 0 to 1",
    ] {
        assert!(section.text.contains(word), "the section lacks `{word}`");
    }
    let mut wheelset = example("wheelset.case.json");
    wheelset["solver"] = json!({ "mesh": { "strips": 4, "cells": 4 } });
    wheelset["contact"]["lateral_shift_mm"] = json!(0.0);
    let contact = wheelset["contact"].as_object_mut().expect("a contact");
    contact.remove("kinematics");
    let wheelset = path_of(&server.solve(&wheelset).await);
    let refused = server
        .get(&format!("{wheelset}/plot.svg?view=profiles"))
        .await;
    assert_problem(&refused, 400, "bad-query", "one wheel and one rail");
    let hertz = path_of(&server.solve(&asked("spin.case.json", &everything())).await);
    for (query, word) in [
        ("view=profiles", "of the type `profiles`"),
        ("view=section&field=slip", "leave it out"),
        ("view=section&width=60", "200 or more"),
    ] {
        let refused = server.get(&format!("{hertz}/plot.svg?{query}")).await;
        assert_problem(&refused, 400, "bad-query", word);
    }
}
