//! How much memory a JSON text takes once it is parsed, found by counting before anything is parsed.

use serde_json::Value;

/// Most members of all objects together. The longest list of motions has less than half as many.
pub const MEMBERS_MAX: usize = 200_000;

/// A node of the tree that holds an object's members takes this much, also if there is only one of them.
const OBJECT_BYTES: usize = 640;
/// What a member takes besides its value: the text of its name, and its part of further nodes.
const MEMBER_BYTES: usize = 112;
/// The smallest array that is not empty.
const ARRAY_BYTES: usize = 4 * size_of::<Value>();

/// What a text holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weight {
    /// Memory of the parsed value in bytes, rather too much than too little.
    pub bytes: usize,
    /// Members of all objects.
    pub members: usize,
}

/// Weighs a text, be it JSON or not.
#[must_use]
pub fn weigh(text: &[u8]) -> Weight {
    let (mut values, mut arrays, mut objects, mut members) = (1_usize, 0_usize, 0_usize, 0_usize);
    let (mut in_string, mut escaped) = (false, false);
    for byte in text {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b',' => values += 1,
            b'[' => arrays += 1,
            b'{' => objects += 1,
            b':' => members += 1,
            _ => {}
        }
    }
    // Arrays grow by doubling.
    let values = 2 * (values + arrays + objects) * size_of::<Value>();
    Weight {
        bytes: text.len()
            + values
            + arrays * ARRAY_BYTES
            + objects * OBJECT_BYTES
            + members * MEMBER_BYTES,
        members,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_weighed_by_what_they_become() {
        let of = |text: &str| weigh(text.as_bytes());
        assert_eq!(of(r#"{"a":1,"b":[{"c":",:{[\""}]}"#).members, 3);
        assert!(of(r#"{"a":"[,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,"}"#).bytes < 2000);
        let bomb = format!("[{}]", vec![r#"{"":1}"#; 1000].join(","));
        assert!(of(&bomb).bytes > 1000 * (OBJECT_BYTES + size_of::<Value>()));
        let samples = format!("[{}]", vec!["0"; 1000].join(","));
        assert!((32_000..80_000).contains(&of(&samples).bytes));
    }
}
