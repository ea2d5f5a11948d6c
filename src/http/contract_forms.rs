//! What the types of the contract cannot say of themselves: that requests have no unknown members, names for the forms of a choice and
//! the member that tells them apart, lists of fixed length, and keys for nothing that is open to all.

use std::collections::{BTreeMap, BTreeSet};

use utoipa::openapi::schema::{AdditionalProperties, ArrayItems, Components};
use utoipa::openapi::{Discriminator, OpenApi, Ref, RefOr, Schema};

/// Schemas that requests are made of; what they lead to belongs to them.
const REQUESTS: [&str; 4] = ["Case", "CaseWithOptions", "EvaluateRequest", "TableUpload"];

/// Names for the forms of a choice that have none, in their order.
const FORMS: [(&str, &[&str]); 6] = [
    (
        "Contact",
        &[
            "RadiiContact",
            "EllipseContact",
            "GapProfileContact",
            "GapGridContact",
            "PressureGridContact",
            "ProfilesContact",
            "WheelsetContact",
        ],
    ),
    (
        "Motions",
        &[
            "SweepMotions",
            "HistoryMotion",
            "WheelsetMotion",
            "WheelsetMotions",
        ],
    ),
    ("Material", &["TwoMaterials"]),
    ("Field", &["CellField"]),
    ("GridAxis", &["AxisRange"]),
    ("Thermal", &["ThermalOfTwo"]),
];

/// Choices whose forms are told apart by a word in this member.
const TOLD_BY: [(&str, &str); 1] = [("Contact", "type")];

/// Least and largest number of members.
const MEMBERS: [(&str, usize, Option<usize>); 3] = [
    ("AskedMotion", 1, None),
    ("Load", 1, Some(2)),
    ("Sweep", 1, None),
];

/// Members that are lists of so many numbers, or lists of those.
const TUPLES: [(&str, &str, usize); 37] = [
    ("ArchardFigures", "speeds_mm_per_s", 2),
    ("CrossSection", "points_mm", 2),
    ("EquivalentConicity", "turns_mm", 2),
    ("FirstTouch", "rail_mm", 2),
    ("FirstTouch", "track_mm", 3),
    ("FirstTouch", "wheel_mm", 2),
    ("GradientErrors", "by_normal_force", 3),
    ("GradientErrors", "force_x_n", 3),
    ("GradientErrors", "force_y_n", 3),
    ("GradientErrors", "moment_z_n_mm", 3),
    ("Gradients", "by_normal_force", 3),
    ("Gradients", "force_x_n", 3),
    ("Gradients", "force_y_n", 3),
    ("Gradients", "moment_z_n_mm", 3),
    ("KnownPatch", "extent_mm", 4),
    ("KnownPatch", "semi_axes_mm", 2),
    ("Outlines", "patch", 2),
    ("Outlines", "slip", 2),
    ("Outlines", "stick", 2),
    ("MotionRegion", "extent_mm", 4),
    ("PatchSolution", "extent_mm", 4),
    ("PatchSolution", "semi_axes_mm", 2),
    ("PlacedProfiles", "rail_mm", 2),
    ("PlacedProfiles", "wheel_mm", 2),
    ("Position", "origin_track_mm", 3),
    ("Position", "rail_mm", 2),
    ("Position", "track_mm", 3),
    ("Position", "wheel_mm", 2),
    ("ProfileQuality", "y_mm", 2),
    ("RemarkEntry", "also_at_points", 2),
    ("SectionQuality", "y_mm", 2),
    ("StressPoint", "at_mm", 3),
    ("StressPoint", "principal_mpa", 3),
    ("StressPoint", "shear_direction", 3),
    ("StressPoint", "shear_plane_normal", 3),
    ("Subsurface", "points_mm", 3),
    ("TemperatureSummary", "at_mm", 2),
];

/// Says all of it.
pub(super) fn complete(document: &mut OpenApi) {
    let components = document.components.get_or_insert_default();
    name_forms(components);
    for (name, member) in TOLD_BY {
        tell_by(components, name, member);
    }
    for name in reached(components) {
        if let Some(schema) = components.schemas.get_mut(&name) {
            close(schema);
        }
    }
    for (name, least, most) in MEMBERS {
        if let Some(RefOr::T(Schema::Object(object))) = components.schemas.get_mut(name) {
            object.min_properties = Some(least);
            object.max_properties = most;
        }
    }
    for (name, member, length) in TUPLES {
        if let Some(RefOr::T(Schema::Object(object))) = components.schemas.get_mut(name)
            && let Some(RefOr::T(schema)) = object.properties.get_mut(member)
        {
            fix_length(schema, length);
        }
    }
}

fn forms<'a>(components: &'a mut Components, name: &str) -> Option<&'a mut Vec<RefOr<Schema>>> {
    match components.schemas.get_mut(name) {
        Some(RefOr::T(Schema::OneOf(choice))) => Some(&mut choice.items),
        _ => None,
    }
}

/// Says that a schema has no members but its own, nor has what is written inside it.
fn close(schema: &mut RefOr<Schema>) {
    match schema {
        RefOr::T(Schema::Object(object)) => {
            if !object.properties.is_empty() && object.additional_properties.is_none() {
                let none = AdditionalProperties::FreeForm(false);
                object.additional_properties = Some(Box::new(none));
            }
            object.properties.values_mut().for_each(close);
        }
        RefOr::T(Schema::OneOf(choice)) => choice.items.iter_mut().for_each(close),
        RefOr::T(Schema::Array(array)) => {
            if let ArrayItems::RefOrSchema(items) = &mut array.items {
                close(items);
            }
        }
        RefOr::T(_) | RefOr::Ref(_) => {}
    }
}

/// Makes schemas of the forms of choices, which lead to them.
fn name_forms(components: &mut Components) {
    for (choice, names) in FORMS {
        let mut names = names.iter();
        let mut named = BTreeMap::new();
        let Some(forms) = forms(components, choice) else {
            continue;
        };
        // Some clients take the first form that lacks nothing, whatever else is there.
        forms.sort_by_key(|form| !requires(form));
        for form in forms {
            if matches!(form, RefOr::T(Schema::Object(object)) if !object.properties.is_empty())
                && let Some(name) = names.next()
            {
                let leading = RefOr::Ref(Ref::from_schema_name(*name));
                named.insert((*name).to_owned(), std::mem::replace(form, leading));
            }
        }
        components.schemas.extend(named);
    }
}

/// Does this form have members that must be there?
fn requires(form: &RefOr<Schema>) -> bool {
    matches!(form, RefOr::T(Schema::Object(object)) if !object.required.is_empty())
}

/// Says which word of a member stands for which form of a choice.
fn tell_by(components: &mut Components, choice: &str, member: &str) {
    let leading = forms(components, choice).map(|forms| references(forms.iter()));
    let mut told = Discriminator::new(member);
    for form in leading.unwrap_or_default() {
        if let Some(RefOr::T(Schema::Object(object))) = components.schemas.get(&form)
            && let Some(RefOr::T(Schema::Object(words))) = object.properties.get(member)
            && let Some([word]) = words.enum_values.as_deref()
            && let Some(word) = word.as_str()
        {
            let place = format!("#/components/schemas/{form}");
            told.mapping.insert(word.to_owned(), place);
        }
    }
    if let Some(RefOr::T(Schema::OneOf(choice))) = components.schemas.get_mut(choice) {
        choice.discriminator = Some(told);
    }
}

/// The schemas of requests and all that they lead to.
fn reached(components: &Components) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    let mut next: Vec<String> = REQUESTS.map(str::to_owned).into();
    while let Some(name) = next.pop() {
        if let Some(schema) = components.schemas.get(&name)
            && seen.insert(name)
        {
            next.extend(references([schema]));
        }
    }
    seen
}

/// Names of the schemas that these lead to at once.
fn references<'a>(schemas: impl IntoIterator<Item = &'a RefOr<Schema>>) -> Vec<String> {
    let mut found = Vec::new();
    for schema in schemas {
        match schema {
            RefOr::Ref(leading) => {
                found.extend(leading.ref_location.rsplit('/').next().map(str::to_owned));
            }
            RefOr::T(Schema::Object(object)) => {
                found.extend(references(object.properties.values()));
            }
            RefOr::T(Schema::OneOf(choice)) => found.extend(references(&choice.items)),
            RefOr::T(Schema::Array(array)) => {
                if let ArrayItems::RefOrSchema(items) = &array.items {
                    found.extend(references([&**items]));
                }
            }
            RefOr::T(_) => {}
        }
    }
    found
}

/// Says how many numbers the innermost list has.
fn fix_length(schema: &mut Schema, length: usize) {
    let Schema::Array(array) = schema else {
        return;
    };
    let ArrayItems::RefOrSchema(items) = &mut array.items else {
        return;
    };
    match &mut **items {
        RefOr::T(inner @ Schema::Array(_)) => fix_length(inner, length),
        RefOr::T(number @ Schema::Object(_)) => {
            array.prefix_items = vec![number.clone(); length];
            array.min_items = Some(length);
            // `items: false` would say the same; some makers of clients cannot read it.
            array.max_items = Some(length);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn document() -> Value {
        serde_json::from_str(crate::http::DOCUMENT.0()).unwrap()
    }

    #[test]
    fn every_entry_of_the_tables_is_there() {
        let document = document();
        let schemas = &document["components"]["schemas"];
        for name in FORMS.iter().flat_map(|(_, names)| *names) {
            assert!(schemas[name].is_object(), "{name}");
        }
        for (name, member, length) in TUPLES {
            let text = schemas[name]["properties"][member].to_string();
            assert!(
                text.contains(&format!("\"minItems\":{length}")),
                "{name}.{member}: {text}"
            );
        }
        for (choice, member) in TOLD_BY {
            let schema = &schemas[choice];
            let told = &schema["discriminator"];
            assert_eq!(told["propertyName"], member);
            let forms = schema["oneOf"].as_array().unwrap().len();
            assert_eq!(told["mapping"].as_object().unwrap().len(), forms);
        }
    }

    /// Every object below a schema that has members but lets others in.
    fn open(schema: &Value, found: &mut Vec<Value>) {
        match schema {
            Value::Object(members) => {
                if members.contains_key("properties")
                    && members.get("additionalProperties") != Some(&Value::Bool(false))
                {
                    found.push(schema.clone());
                }
                members.values().for_each(|member| open(member, found));
            }
            Value::Array(items) => items.iter().for_each(|item| open(item, found)),
            _ => {}
        }
    }

    /// The schemas that a part of the document leads to at once.
    fn leads(part: &Value, found: &mut Vec<String>) {
        match part {
            Value::Object(members) => {
                let target = members.get("$ref").and_then(Value::as_str);
                found.extend(target.and_then(|target| Some(target.rsplit_once('/')?.1.to_owned())));
                members.values().for_each(|member| leads(member, found));
            }
            Value::Array(items) => items.iter().for_each(|item| leads(item, found)),
            _ => {}
        }
    }

    #[test]
    fn requests_say_that_they_have_no_unknown_members() {
        let document = document();
        let schemas = &document["components"]["schemas"];
        let (mut seen, mut next) = (BTreeSet::new(), Vec::new());
        for operation in [
            &document["paths"]["/v1/jobs"],
            &document["paths"]["/v1/batches"],
        ] {
            leads(&operation["post"]["requestBody"], &mut next);
        }
        while let Some(name) = next.pop() {
            if seen.insert(name.clone()) {
                leads(&schemas[&name], &mut next);
            }
        }
        assert!(seen.len() > 20, "{seen:?}");
        for name in seen {
            let mut found = Vec::new();
            open(&schemas[&name], &mut found);
            assert!(found.is_empty(), "{name}: {found:?}");
        }
    }
}
