//! Names, labels and times in queries.

use crate::http::extract::query::{Reader, reader};

/// Characters of a name, a key and a value of a label at most, as in a case.
const NAME_MAX: usize = 200;
const KEY_MAX: usize = 64;
const VALUE_MAX: usize = 256;
/// Labels at most, as in a case.
pub const LABELS_MAX: usize = 32;

/// A label to be looked for.
pub fn label() -> Reader<(String, String)> {
    reader("`key:value`", |text| {
        let (key, value) = text.split_once(':')?;
        Some((key.to_owned(), value.to_owned()))
    })
}

/// A label that something is to carry.
pub fn new_label() -> Reader<(String, String)> {
    let allowed = format!(
        "`key:value`, the key of 1 to {KEY_MAX} characters, the value of at most {VALUE_MAX}, without control characters"
    );
    reader(allowed, |text| {
        let (key, value) = text.split_once(':')?;
        let fits =
            (1..=KEY_MAX).contains(&key.chars().count()) && value.chars().count() <= VALUE_MAX;
        (fits && is_line(text)).then(|| (key.to_owned(), value.to_owned()))
    })
}

/// A name to be given, or a part of one to be looked for.
pub fn name() -> Reader<String> {
    let allowed = format!("1 to {NAME_MAX} characters without control characters");
    reader(allowed, |text| {
        let fits = (1..=NAME_MAX).contains(&text.chars().count());
        (fits && is_line(text)).then(|| text.to_owned())
    })
}

/// A time, as milliseconds since 1970.
pub fn time() -> Reader<i64> {
    let allowed = "a time in RFC 3339 such as `2026-01-31T09:30:00Z` (write `+` as `%2B`)";
    reader(allowed, |text| {
        let time = text.parse::<jiff::Timestamp>();
        time.ok().map(jiff::Timestamp::as_millisecond)
    })
}

fn is_line(text: &str) -> bool {
    !text.chars().any(char::is_control)
}
