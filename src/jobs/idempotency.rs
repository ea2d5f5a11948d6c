//! Digests of JSON values, which do not depend on the order of members.

use serde_json::Value;

/// BLAKE3 digest of a JSON value. Members of objects are taken in sorted order.
#[must_use]
pub fn digest(case: &Value) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    feed(&mut hasher, case);
    *hasher.finalize().as_bytes()
}

/// Hashes one value. A letter for the type and the length precede each part, so that different values differ in their bytes.
fn feed(hasher: &mut blake3::Hasher, value: &Value) {
    match value {
        Value::Null => feed_part(hasher, b'n', b""),
        Value::Bool(truth) => feed_part(hasher, b'b', &[u8::from(*truth)]),
        Value::Number(number) => feed_part(hasher, b'd', number.to_string().as_bytes()),
        Value::String(text) => feed_part(hasher, b's', text.as_bytes()),
        Value::Array(items) => {
            feed_part(hasher, b'a', &(items.len() as u64).to_le_bytes());
            for item in items {
                feed(hasher, item);
            }
        }
        Value::Object(members) => {
            feed_part(hasher, b'o', &(members.len() as u64).to_le_bytes());
            let mut sorted = members.iter().collect::<Vec<_>>();
            sorted.sort_unstable_by_key(|(name, _)| name.as_str());
            for (name, member) in sorted {
                feed_part(hasher, b'k', name.as_bytes());
                feed(hasher, member);
            }
        }
    }
}

fn feed_part(hasher: &mut blake3::Hasher, kind: u8, bytes: &[u8]) {
    hasher.update(&[kind]);
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn order_of_members_does_not_matter_and_everything_else_does() {
        let text = |s: &str| serde_json::from_str::<Value>(s).unwrap();
        assert_eq!(
            digest(&text(r#"{"a":1,"b":[2]}"#)),
            digest(&text(r#"{"b":[2],"a":1}"#))
        );
        let different = [
            json!({"a": 1, "b": [2]}),
            json!({"a": "1", "b": [2]}),
            json!({"a": 1, "b": [2, null]}),
            json!({"a": 1, "b": [[2]]}),
            json!({"a": 1}),
            json!([{"a": 1}]),
            json!("a"),
            json!(null),
        ];
        for (i, left) in different.iter().enumerate() {
            for right in &different[i + 1..] {
                assert_ne!(digest(left), digest(right), "{left} {right}");
            }
        }
    }
}
