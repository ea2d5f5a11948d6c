//! Tests all fields of a motion in one response: the values of the parts and the border of the patch.

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::formats::{PARTS, bits, flat, read_npz};
use crate::results::{area, number, path_of};
use crate::server::{Server, example, link};

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
    let contact = number(&job["result"]["patches"][0]["area_mm2"]);
    let outlines = &fields["outlines"];
    assert!((area(&outlines["patch"]) - contact).abs() < 0.02 * contact);
    let zones = area(&outlines["stick"]) + area(&outlines["slip"]);
    assert!((zones - contact).abs() < 0.1 * contact);
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
