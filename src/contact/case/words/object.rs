//! Reads typed members of a JSON object and collects their faults.

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

use serde_json::{Map, Number, Value};

use crate::error::{Fault, FaultCode, FaultFigures};

/// Maximum number of faulty values of an array or a grid that get a fault of their own.
pub(crate) const LISTED_MAX: usize = 5;

/// A JSON object or array, its JSON pointer and the list that collects its faults. The members of an array are its elements, by their index.
///
/// A reading method returns `None` both for an absent and for a faulty member. A faulty member also adds a fault, so that the case is refused.
pub(crate) struct Object<'v, 'f> {
    value: &'v Value,
    pointer: String,
    faults: &'f mut Faults,
}

impl<'v, 'f> Object<'v, 'f> {
    /// Opens a value that must be an object.
    pub(crate) fn open(value: &'v Value, pointer: String, faults: &'f mut Faults) -> Option<Self> {
        if !value.is_object() {
            let detail = format!("{} given; an object is needed", shown(value));
            faults.add_with(pointer, detail, figures(FaultCode::WrongType, Some(value)));
            return None;
        }
        Some(Object {
            value,
            pointer,
            faults,
        })
    }

    /// Whether the object has this member.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.value(name).is_some()
    }

    /// Returns those of `names` that the object has.
    pub(crate) fn given<'n>(&self, names: &[&'n str]) -> Vec<&'n str> {
        let names = names.iter().copied();
        names.filter(|name| self.has(name)).collect()
    }

    /// Refuses the second of two members that exclude each other.
    pub(crate) fn exclude<T>(&mut self, first: &str, second: &str) -> Option<T> {
        let detail = format!("given together with {first}; exactly one of the two is allowed");
        self.refuse(second, detail)
    }

    /// Returns the only one of `names` that the object has. Otherwise adds a fault: that of `missing` if the object has none of them.
    pub(crate) fn exactly_one<'n>(
        &mut self,
        names: &[&'n str],
        missing: impl FnOnce(&mut Self),
    ) -> Option<&'n str> {
        match self.given(names)[..] {
            [name] => Some(name),
            [] => {
                missing(self);
                None
            }
            [first, second, ..] => self.exclude(first, second),
        }
    }

    /// Returns the value of a member, if the object has it.
    pub(crate) fn value(&self, name: &str) -> Option<&'v Value> {
        match self.value {
            Value::Array(elements) => elements.get(name.parse::<usize>().ok()?),
            object => object.get(name),
        }
    }

    /// Returns the JSON pointer of a member.
    pub(crate) fn pointer_to(&self, name: &str) -> String {
        join(&self.pointer, name)
    }

    /// Returns the list of faults.
    pub(crate) fn faults(&mut self) -> &mut Faults {
        self.faults
    }

    /// Adds a fault of a member.
    pub(crate) fn fault(&mut self, name: &str, detail: impl Into<String>) {
        let figures = figures(FaultCode::Invalid, self.value(name));
        self.fault_with(name, detail, figures);
    }

    /// Adds a fault of a member and returns `None`.
    pub(crate) fn refuse<T>(&mut self, name: &str, detail: impl Into<String>) -> Option<T> {
        self.fault(name, detail);
        None
    }

    /// Adds a fault of the element `index` of an array and returns `None`.
    pub(crate) fn refuse_element<T>(
        &mut self,
        name: &str,
        index: usize,
        detail: impl Into<String>,
    ) -> Option<T> {
        let pointer = join(&self.pointer_to(name), index);
        self.faults.refuse(pointer, detail)
    }

    /// Adds a fault of a member with its code and values for programs.
    pub(crate) fn fault_with(
        &mut self,
        name: &str,
        detail: impl Into<String>,
        figures: FaultFigures,
    ) {
        let pointer = self.pointer_to(name);
        self.faults.add_with(pointer, detail, figures);
    }

    /// Adds a fault of the object as a whole and returns `None`.
    pub(crate) fn refuse_object<T>(&mut self, detail: impl Into<String>) -> Option<T> {
        self.faults.refuse(self.pointer.clone(), detail)
    }

    /// Refuses every member that is not in `allowed`.
    pub(crate) fn only(&mut self, allowed: &[&str]) {
        self.only_or(allowed, &[]);
    }

    /// Refuses every member that is neither in `allowed` nor in `reserved`. The fault lists `allowed` only.
    pub(crate) fn only_or(&mut self, allowed: &[&str], reserved: &[&str]) {
        let own = self.value;
        for (name, value) in own.as_object().into_iter().flatten() {
            if !allowed.contains(&name.as_str()) && !reserved.contains(&name.as_str()) {
                let detail = format!(
                    "unknown member (its value is {}); allowed here: {}",
                    shown(value),
                    allowed.join(", ")
                );
                let figures = FaultFigures {
                    allowed: allowed.iter().map(ToString::to_string).collect(),
                    ..figures(FaultCode::UnknownMember, Some(value))
                };
                self.fault_with(name, detail, figures);
            }
        }
    }

    /// Returns the value of a required member. If it is absent, adds a fault that states `what` is needed.
    pub(crate) fn required(&mut self, name: &str, what: &str) -> Option<&'v Value> {
        let value = self.value(name);
        value.or_else(|| self.missing(name, what, figures(FaultCode::Missing, None)))
    }

    /// Adds the fault that a member is absent, and returns `None`.
    fn missing<T>(
        &mut self,
        name: &str,
        needed: impl fmt::Display,
        figures: FaultFigures,
    ) -> Option<T> {
        self.fault_with(name, format!("missing; {needed} is needed"), figures);
        None
    }

    /// Adds the fault that a member has the wrong value or type, and returns `None`.
    fn unsuitable<T>(
        &mut self,
        name: &str,
        needed: impl fmt::Display,
        figures: FaultFigures,
    ) -> Option<T> {
        let given = self.value(name).map(shown).unwrap_or_default();
        self.fault_with(name, format!("{given} given; {needed} is needed"), figures);
        None
    }

    /// Reads a number; `None` if it is absent or faulty.
    pub(crate) fn number(&mut self, name: &str, allowed: AllowedRange) -> Option<f64> {
        let value = self.value(name)?;
        let figures = || allowed.figures(number_code(value), Some(value));
        let read = allowed.read(value);
        read.or_else(|| self.unsuitable(name, allowed, figures()))
    }

    /// Reads an optional member with `read`. The outer `None` means a fault, the inner one an absent member.
    pub(crate) fn optional<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut Self, &str) -> Option<T>,
    ) -> Option<Option<T>> {
        match self.has(name) {
            true => read(self, name).map(Some),
            false => Some(None),
        }
    }

    /// Reads `true` or `false`.
    pub(crate) fn flag(&mut self, name: &str) -> Option<bool> {
        let flag = self.value(name)?.as_bool();
        flag.or_else(|| self.mistaken(name, "true or false"))
    }

    /// Reads an array whose number of elements lies in `lengths`; `None` if it is absent or faulty.
    pub(crate) fn array(
        &mut self,
        name: &str,
        lengths: RangeInclusive<usize>,
        what: &str,
    ) -> Option<&'v [Value]> {
        let elements = self.value(name)?.as_array();
        let elements = elements.filter(|all| lengths.contains(&all.len()));
        elements
            .map(Vec::as_slice)
            .or_else(|| self.mistaken(name, what))
    }

    /// Reads the elements of an array as numbers. The first [`LISTED_MAX`] faulty ones get a fault each; one more fault counts the rest.
    pub(crate) fn numbers(&mut self, name: &str, allowed: AllowedRange) -> Option<Vec<f64>> {
        let (mut array, mut refused) = (self.elements(name)?, 0);
        let read = array.own_numbers(allowed, &mut refused);
        array.count_rest(refused, "values", format!("{allowed} is needed"));
        read
    }

    /// Reads the elements of this array as numbers, see [`own_elements`](Object::own_elements).
    pub(crate) fn own_numbers(
        &mut self,
        allowed: AllowedRange,
        refused: &mut usize,
    ) -> Option<Vec<f64>> {
        let refuse = |array: &mut Self, index: &str| {
            array.number(index, allowed);
        };
        self.own_elements(refused, |value| allowed.read(value), refuse)
    }

    /// Reads the elements of this array with `read`. Counts those that it refuses in `refused`, and calls `refuse` for each of the first
    /// [`LISTED_MAX`].
    pub(crate) fn own_elements<T>(
        &mut self,
        refused: &mut usize,
        read: impl Fn(&Value) -> Option<T>,
        refuse: impl Fn(&mut Self, &str),
    ) -> Option<Vec<T>> {
        let elements = self.value.as_array()?;
        let mut all = Vec::with_capacity(elements.len());
        for (i, value) in elements.iter().enumerate() {
            if let Some(one) = read(value) {
                all.push(one);
                continue;
            }
            *refused += 1;
            if *refused <= LISTED_MAX {
                refuse(self, &i.to_string());
            }
        }
        (all.len() == elements.len()).then_some(all)
    }

    /// Adds a fault with the number of refused elements of this array beyond the first [`LISTED_MAX`], if there are any.
    pub(crate) fn count_rest(&mut self, refused: usize, what: &str, needed: impl fmt::Display) {
        let rest = refused.saturating_sub(LISTED_MAX);
        if rest > 0 {
            let detail = format!("{rest} more {what} are refused for the same reason; {needed}");
            self.faults.add(self.pointer.clone(), detail);
        }
    }

    /// Reads a required array of numbers whose length lies in `lengths`.
    pub(crate) fn number_array(
        &mut self,
        name: &str,
        lengths: RangeInclusive<usize>,
        what: &str,
        allowed: AllowedRange,
    ) -> Option<Vec<f64>> {
        self.required(name, what)?;
        self.array(name, lengths, what)?;
        self.numbers(name, allowed)
    }

    /// Adds the fault that a member has the wrong value or type, and returns `None`.
    pub(crate) fn mistaken<T>(&mut self, name: &str, what: &str) -> Option<T> {
        let figures = figures(FaultCode::Invalid, self.value(name));
        self.unsuitable(name, what, figures)
    }

    /// Reads a required number.
    pub(crate) fn required_number(&mut self, name: &str, allowed: AllowedRange) -> Option<f64> {
        match self.has(name) {
            true => self.number(name, allowed),
            false => self.missing(name, allowed, allowed.figures(FaultCode::Missing, None)),
        }
    }

    /// Reads a required whole number; `3.0` counts as whole.
    pub(crate) fn required_count(&mut self, name: &str, low: u32, high: u32) -> Option<u32> {
        let what = format!("a whole number from {low} to {high}");
        let value = self.required(name, &what)?;
        let allowed = AllowedRange::closed(low.into(), high.into(), "");
        let number = allowed.read(value).filter(|number| number.fract() == 0.0);
        number.map(|number| number as u32).or_else(|| {
            let figures = allowed.figures(number_code(value), Some(value));
            self.unsuitable(name, what, figures)
        })
    }

    /// Reads the elements of an array whose number lies in `lengths`; `read` gets the array and the index of each. Returns `None` if one of
    /// them is faulty.
    pub(crate) fn each<T>(
        &mut self,
        name: &str,
        lengths: RangeInclusive<usize>,
        what: &str,
        read: impl Fn(&mut Object, &str) -> Option<T>,
    ) -> Option<Vec<T>> {
        let count = self.array(name, lengths, what)?.len();
        let mut array = self.elements(name)?;
        let all = (0..count).map(|k| read(&mut array, &k.to_string()));
        let all: Vec<Option<T>> = all.collect();
        all.into_iter().collect()
    }

    /// Reads keywords from an array with at least one, sorted and without repetition.
    pub(crate) fn words<T: Copy + Ord>(
        &mut self,
        name: &str,
        table: &[(&str, T)],
        read: impl Fn(&mut Object, &str) -> Option<T>,
    ) -> Option<Vec<T>> {
        let what = format!("an array with at least one of {}", names(table));
        let mut words = self.each(name, 1..=usize::MAX, &what, read)?;
        words.sort_unstable();
        words.dedup();
        Some(words)
    }

    /// Reads the members of `{"from": …, "to": …, "points": …}`, with `low` to `high` points.
    pub(crate) fn range(
        &mut self,
        allowed: AllowedRange,
        low: u32,
        high: u32,
    ) -> Option<(f64, f64, u32)> {
        self.only(&["from", "to", "points"]);
        let from = self.required_number("from", allowed);
        let to = self.required_number("to", allowed);
        let points = self.required_count("points", low, high);
        Some((from?, to?, points?))
    }

    /// Reads a text of at most `length_max` characters; `None` if it is absent or faulty.
    pub(crate) fn text(&mut self, name: &str, length_max: usize) -> Option<String> {
        let value = self.value(name)?;
        let text = value.as_str();
        let short = text.filter(|text| text.chars().count() <= length_max);
        short.map(str::to_owned).or_else(|| {
            let code = match text {
                Some(_) => FaultCode::TooLong,
                None => FaultCode::WrongType,
            };
            let figures = FaultFigures {
                maximum: Some(length_max.into()),
                ..figures(code, Some(value))
            };
            let needed = format!("a text of at most {length_max} characters");
            self.unsuitable(name, needed, figures)
        })
    }

    /// Reads a text like [`text`](Object::text), without line breaks and other control characters.
    pub(crate) fn line(&mut self, name: &str, length_max: usize) -> Option<String> {
        let text = self.text(name, length_max)?;
        if has_controls(&text) {
            let detail = format!("{text:?} given; control characters are not allowed");
            return self.refuse(name, detail);
        }
        Some(text)
    }

    /// Reads a keyword of a table and returns its value; `None` if it is absent or faulty.
    pub(crate) fn word<T: Copy>(&mut self, name: &str, table: &[(&str, T)]) -> Option<T> {
        let value = self.value(name)?;
        let text = value.as_str();
        if let Some((_, meaning)) = table.iter().find(|(word, _)| Some(*word) == text) {
            return Some(*meaning);
        }
        let detail = format!("{} given; allowed: {}", shown(value), names(table));
        let code = match text {
            Some(_) => FaultCode::UnknownWord,
            None => FaultCode::WrongType,
        };
        let figures = FaultFigures {
            allowed: table.iter().map(|(word, _)| (*word).to_owned()).collect(),
            ..figures(code, Some(value))
        };
        self.fault_with(name, detail, figures);
        None
    }

    /// Opens a member that must be an object. An absent member is opened as an empty object.
    pub(crate) fn child_or_empty(&mut self, name: &str) -> Option<Object<'v, '_>> {
        static EMPTY: LazyLock<Value> = LazyLock::new(|| Value::Object(Map::new()));
        self.opened(name, self.value(name).unwrap_or(&EMPTY))
    }

    /// Opens a required member that must be an object.
    pub(crate) fn child(&mut self, name: &str) -> Option<Object<'v, '_>> {
        let value = self.required(name, "an object")?;
        self.opened(name, value)
    }

    fn opened(&mut self, name: &str, value: &'v Value) -> Option<Object<'v, '_>> {
        Object::open(value, self.pointer_to(name), self.faults)
    }

    /// Opens a member that is an array.
    pub(crate) fn elements(&mut self, name: &str) -> Option<Object<'v, '_>> {
        Some(Object {
            value: self.value(name)?,
            pointer: self.pointer_to(name),
            faults: self.faults,
        })
    }
}

/// A type that can be read from a member of an object.
pub(crate) trait Member: Sized {
    /// Reads the member `name`; `None` if it is absent or faulty.
    fn read(block: &mut Object, name: &str) -> Option<Self>;
}

impl<T: Member> Member for Box<T> {
    fn read(block: &mut Object, name: &str) -> Option<Box<T>> {
        T::read(block, name).map(Box::new)
    }
}

/// Returns the keywords of a table, joined for a sentence.
pub(crate) fn names<T>(table: &[(&str, T)]) -> String {
    let words: Vec<&str> = table.iter().map(|(word, _)| *word).collect();
    words.join(", ")
}

/// Appends a reference token to a JSON pointer, escaped by RFC 6901, section 3.
pub(crate) fn join(pointer: &str, token: impl fmt::Display) -> String {
    let token = token.to_string().replace('~', "~0").replace('/', "~1");
    format!("{pointer}/{token}")
}

/// Formats a received value, shortened for a sentence.
pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Array(elements) if elements.is_empty() => "an empty array".to_owned(),
        Value::Array(elements) => format!("an array of length {}", elements.len()),
        Value::Object(members) if members.is_empty() => "an empty object".to_owned(),
        Value::Object(members) => {
            let names: Vec<&str> = members.keys().map(String::as_str).collect();
            format!("an object with the members {}", cut(&names.join(", ")))
        }
        Value::String(text) => Value::String(cut(text)).to_string(),
        scalar => scalar.to_string(),
    }
}

fn cut(text: &str) -> String {
    let mut short: String = text.chars().take(SHOWN_MAX).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// Whether a text has control characters, such as line breaks and tabs, which would break tables and log lines.
pub(crate) fn has_controls(text: &str) -> bool {
    text.chars().any(char::is_control)
}

/// Maximum number of faults in a list; further ones are counted only.
pub(crate) const FAULTS_MAX: usize = 100;
/// Maximum number of characters of a received value that a fault repeats.
pub(crate) const SHOWN_MAX: usize = 60;

/// The faults found so far, in the order of reading.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    listed: Vec<Fault>,
    unlisted: usize,
}

impl Faults {
    /// Adds a fault. Beyond [`FAULTS_MAX`], faults are counted only.
    pub(crate) fn add(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.add_with(pointer, detail, FaultFigures::default());
    }

    /// Adds a fault and returns `None`.
    pub(crate) fn refuse<T>(
        &mut self,
        pointer: impl Into<String>,
        detail: impl Into<String>,
    ) -> Option<T> {
        self.add(pointer, detail);
        None
    }

    /// Adds a fault with its code and values for programs.
    pub(crate) fn add_with(
        &mut self,
        pointer: impl Into<String>,
        detail: impl Into<String>,
        figures: FaultFigures,
    ) {
        if self.listed.len() < FAULTS_MAX {
            self.listed.push(Fault {
                pointer: pointer.into(),
                detail: detail.into(),
                figures: Box::new(figures),
            });
        } else {
            self.unlisted += 1;
        }
    }

    /// Returns the list. A last entry states the number of faults that are not listed, if there are any.
    pub(crate) fn into_list(self) -> Vec<Fault> {
        let mut listed = self.listed;
        if self.unlisted > 0 {
            let detail = format!("{} more faults are not listed", self.unlisted);
            listed.push(Fault::new("", detail));
        }
        listed
    }
}

/// The interval of allowed values of a number, and their unit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AllowedRange {
    low: f64,
    low_excluded: bool,
    high: f64,
    unit: &'static str,
}

impl AllowedRange {
    /// The interval `low <= value <= high`.
    pub(crate) const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        AllowedRange {
            low,
            low_excluded: false,
            high,
            unit,
        }
    }

    /// The interval `0 < value <= high`.
    pub(crate) const fn positive(high: f64, unit: &'static str) -> Self {
        AllowedRange {
            low: 0.0,
            low_excluded: true,
            high,
            unit,
        }
    }

    /// Describes the interval in a fault of `value`, for programs.
    pub(crate) fn figures(&self, code: FaultCode, value: Option<&Value>) -> FaultFigures {
        FaultFigures {
            minimum: Number::from_f64(self.low),
            minimum_excluded: self.low_excluded,
            maximum: Number::from_f64(self.high),
            unit: Some(self.unit).filter(|unit| !unit.is_empty()),
            ..figures(code, value)
        }
    }

    /// Returns the number if the interval contains it. Negative zero becomes zero, so that equal cases have equal digests.
    pub(crate) fn read(&self, value: &Value) -> Option<f64> {
        let number = value.as_f64().filter(|number| self.contains(*number))?;
        Some(number + 0.0)
    }

    /// Whether the interval contains the number.
    pub(crate) fn contains(&self, number: f64) -> bool {
        let is_low = number == self.low && self.low_excluded;
        (self.low..=self.high).contains(&number) && !is_low
    }
}

impl fmt::Display for AllowedRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (plain(self.low), plain(self.high));
        match self.low_excluded {
            true => write!(f, "a number more than {low} and at most {high}")?,
            false => write!(f, "a number from {low} to {high}")?,
        }
        match self.unit {
            "" => Ok(()),
            unit => write!(f, " {unit}"),
        }
    }
}

/// Describes a fault of `value` for programs. Arrays, objects and long texts are left out.
pub(crate) fn figures(code: FaultCode, value: Option<&Value>) -> FaultFigures {
    let short = |value: &&Value| match value {
        Value::Array(_) | Value::Object(_) => false,
        Value::String(text) => text.len() <= SHOWN_MAX,
        _ => true,
    };
    FaultFigures {
        code,
        value: value.filter(short).cloned(),
        ..FaultFigures::default()
    }
}

/// Returns the code of a value that is not an allowed number.
fn number_code(value: &Value) -> FaultCode {
    match value.is_number() {
        true => FaultCode::OutOfRange,
        false => FaultCode::WrongType,
    }
}

/// Formats a limit, large ones with an exponent: `1e9` rather than `1000000000`.
fn plain(number: f64) -> String {
    match number.abs() >= 1e5 {
        true => format!("{number:e}"),
        false => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn pointers_escape_slashes_and_tildes() {
        assert_eq!(join("/labels", "a/b~c"), "/labels/a~1b~0c");
        assert_eq!(
            json!({"labels": {"a/b~c": 1}}).pointer("/labels/a~1b~0c"),
            Some(&json!(1))
        );
    }

    #[test]
    fn both_sides_of_an_interval_are_kept() {
        let open = AllowedRange::positive(2.0, "mm");
        let closed = AllowedRange::closed(0.0, 0.5, "");
        assert!(!open.contains(0.0) && open.contains(f64::MIN_POSITIVE) && open.contains(2.0));
        assert!(
            !open.contains(2.0_f64.next_up()) && !open.contains(-1.0) && !open.contains(f64::NAN)
        );
        assert!(
            closed.contains(0.0) && closed.contains(0.5) && !closed.contains(0.5_f64.next_up())
        );
        assert_eq!(open.to_string(), "a number more than 0 and at most 2 mm");
        assert_eq!(
            AllowedRange::closed(-1e6, 1e6, "").to_string(),
            "a number from -1e6 to 1e6"
        );
    }

    #[test]
    fn a_flood_of_faults_is_listed_up_to_a_limit_and_counted() {
        let mut faults = Faults::default();
        for k in 0..250 {
            faults.add(format!("/{k}"), "no");
        }
        let list = faults.into_list();
        assert_eq!(list.len(), FAULTS_MAX + 1);
        assert_eq!(
            list.last().unwrap().detail,
            "150 more faults are not listed"
        );
    }

    #[test]
    fn long_values_are_shortened() {
        let text = shown(&Value::String("é".repeat(500)));
        assert_eq!(text.chars().count(), SHOWN_MAX + 3);
        assert_eq!(shown(&json!([[1], [2]])), "an array of length 2");
    }

    #[test]
    fn whole_floats_count_as_whole() {
        let value = json!({"a": 3.0, "b": 3.5, "c": 0, "d": 5, "e": "3"});
        let mut faults = Faults::default();
        let mut object = Object::open(&value, String::new(), &mut faults).unwrap();
        assert_eq!(object.required_count("a", 1, 4), Some(3));
        for name in ["b", "c", "d", "e", "f"] {
            assert_eq!(object.required_count(name, 1, 4), None, "{name}");
        }
        assert_eq!(faults.into_list().len(), 5);
    }
}
