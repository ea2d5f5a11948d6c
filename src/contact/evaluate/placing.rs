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
    match path {
        [] => Ok(()),
        path => replace(case, path, value).map(drop),
    }
}

/// A part of a case as it was before a value was put into it.
#[derive(Debug)]
pub struct Replaced {
    /// How many of the members lead to the part.
    depth: usize,
    /// The part; nothing if there was none.
    before: Option<Value>,
}

/// As [`put`]; returns what [`restore`] needs.
///
/// # Errors
/// As [`put`]; the case is then unchanged.
pub fn replace(case: &mut Value, path: &[String], value: Value) -> Result<Replaced, String> {
    let mut place = case;
    for (depth, member) in path.iter().enumerate() {
        place = match place {
            Value::Null => {
                let made = objects(&path[depth..], value);
                let before = Some(std::mem::replace(place, made));
                return Ok(Replaced { depth, before });
            }
            Value::Object(members) => {
                if !members.contains_key(member) {
                    members.insert(member.clone(), objects(&path[depth + 1..], value));
                    let depth = depth + 1;
                    return Ok(Replaced {
                        depth,
                        before: None,
                    });
                }
                members.entry(member).or_insert(Value::Null)
            }
            Value::Array(items) => {
                let count = items.len();
                let index = member.parse::<usize>().ok();
                let item = index.and_then(|index| items.get_mut(index));
                item.ok_or_else(|| format!("leads to `{member}` of an array with {count} entries"))?
            }
            _ => {
                return Err(format!(
                    "leads to `{member}` of what is neither an object nor an array in the template"
                ));
            }
        };
    }
    Ok(Replaced {
        depth: path.len(),
        before: Some(std::mem::replace(place, value)),
    })
}

/// Undoes the last [`replace`] with this path.
pub fn restore(case: &mut Value, path: &[String], replaced: Replaced) {
    let Replaced { depth, before } = replaced;
    let (way, last) = match before {
        Some(_) => (&path[..depth], None),
        None => (&path[..depth - 1], path[..depth].last()),
    };
    let mut place = case;
    for member in way {
        let next = match place {
            Value::Object(members) => members.get_mut(member),
            Value::Array(items) => member
                .parse::<usize>()
                .ok()
                .and_then(|index| items.get_mut(index)),
            _ => None,
        };
        match next {
            Some(next) => place = next,
            None => return,
        }
    }
    match (before, last, place) {
        (Some(before), _, place) => *place = before,
        (None, Some(last), Value::Object(members)) => {
            members.remove(last);
        }
        _ => {}
    }
}

/// Objects within each other, the innermost with this value.
fn objects(path: &[String], value: Value) -> Value {
    let within = |value, member: &String| Value::Object(Map::from_iter([(member.clone(), value)]));
    path.iter().rev().fold(value, within)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_was_replaced_comes_back() {
        let case = json!({ "load": { "f": 1 }, "y": [0, { "a": 2 }], "none": null });
        for pointer in [
            "/load/f", "/load/g", "/new/a/b", "/y/0", "/y/1/a", "/y/1/b/c", "/none/x", "/none",
        ] {
            let path = members(pointer);
            let mut changed = case.clone();
            let replaced = replace(&mut changed, &path, json!("v")).expect(pointer);
            assert_eq!(changed.pointer(pointer), Some(&json!("v")), "{pointer}");
            restore(&mut changed, &path, replaced);
            assert_eq!(changed, case, "{pointer}");
        }
        for pointer in ["/y/2", "/y/b", "/load/f/g"] {
            let mut changed = case.clone();
            assert!(
                replace(&mut changed, &members(pointer), json!(1)).is_err(),
                "{pointer}"
            );
            assert_eq!(changed, case, "{pointer}");
        }
    }
}
