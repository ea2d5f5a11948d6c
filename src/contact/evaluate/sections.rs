//! Cross-sections that a case names by their digest instead of giving their points.

use serde_json::Value;

/// Where a case has cross-sections.
const PLACES: [&str; 4] = [
    "/contact/rail",
    "/contact/wheel",
    "/contact/right/rail",
    "/contact/right/wheel",
];
/// The member that names a stored cross-section.
const PROFILE: &str = "profile";
/// What it stands for.
const POINTS: [&str; 3] = ["points_mm", "format", "text"];

/// The cross-sections that a case names: where, and by which name.
#[must_use]
pub fn named_sections(case: &Value) -> Vec<(&'static str, String)> {
    let named = |place: &&'static str| {
        let name = case.pointer(place)?.get(PROFILE)?.as_str()?;
        Some((*place, name.to_owned()))
    };
    PLACES.iter().filter_map(named).collect()
}

/// The first cross-section that is both named and given.
#[must_use]
pub fn named_and_given(case: &Value) -> Option<&'static str> {
    let both = |place: &&&'static str| {
        let section = case.pointer(place);
        section.is_some_and(|section| {
            section.get(PROFILE).is_some() && POINTS.iter().any(|name| section.get(name).is_some())
        })
    };
    PLACES.iter().find(both).copied()
}

/// Puts the stored cross-section in the place of its name. What else the case says of it, such as its smoothing, stays.
pub fn put_section(case: &mut Value, place: &str, section: &Value) {
    let Some(Value::Object(own)) = case.pointer_mut(place) else {
        return;
    };
    own.remove(PROFILE);
    for name in POINTS {
        own.remove(name);
    }
    for (name, value) in section.as_object().into_iter().flatten() {
        if POINTS.contains(&name.as_str()) || !own.contains_key(name) {
            own.insert(name.clone(), value.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_named_section_takes_the_place_of_its_name_and_of_other_points() {
        let mut case = json!({ "contact": {
            "rail": { "profile": "a", "smoothing_mm": 3 }, "wheel": { "points_mm": [[0, 0]], "profile": "b", "mirror_y": true }
        } });
        let named = named_sections(&case);
        assert_eq!(
            named,
            [
                ("/contact/rail", "a".to_owned()),
                ("/contact/wheel", "b".to_owned())
            ]
        );
        assert_eq!(named_and_given(&case), Some("/contact/wheel"));
        let stored =
            json!({ "format": "columns", "text": "…", "mirror_y": false, "smoothing_mm": 1 });
        for (place, _) in named {
            put_section(&mut case, place, &stored);
        }
        assert_eq!(
            case,
            json!({ "contact": {
            "rail": { "format": "columns", "text": "…", "mirror_y": false, "smoothing_mm": 3 },
            "wheel": { "format": "columns", "text": "…", "mirror_y": true, "smoothing_mm": 1 }
        } })
        );
    }
}
