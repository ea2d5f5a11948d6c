//! Puts a value into a case at the place that a JSON pointer leads to.

use serde_json::{Map, Value};

/// The members of a JSON pointer (RFC 6901).
#[must_use]
pub fn members(pointer: &str) -> Vec<String> {
    let parts = pointer.split('/').skip(1);
    parts
        .map(|part| part.replace("~1", "/").replace("~0", "~"))
        .collect()
}

/// Puts a value where the members lead; objects on the way are made.
///
/// # Errors
/// Why they lead nowhere.
pub fn put(case: &mut Value, path: &[String], value: Value) -> Result<(), String> {
    let Some((last, way)) = path.split_last() else {
        return Ok(());
    };
    let mut place = case;
    for member in way {
        place = step(place, member)?;
    }
    *step(place, last)? = value;
    Ok(())
}

fn step<'a>(place: &'a mut Value, member: &str) -> Result<&'a mut Value, String> {
    if place.is_null() {
        *place = Value::Object(Map::new());
    }
    match place {
        Value::Object(members) => Ok(members.entry(member).or_insert(Value::Null)),
        Value::Array(items) => {
            let count = items.len();
            let index = member.parse::<usize>().ok();
            let item = index.and_then(|index| items.get_mut(index));
            item.ok_or_else(|| format!("leads to `{member}` of an array with {count} entries"))
        }
        _ => Err(format!(
            "leads to `{member}` of what is neither an object nor an array in the template"
        )),
    }
}
