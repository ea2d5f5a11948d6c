//! Reads query parameters strictly: unknown, repeated and unreadable ones are refused together.

use axum::extract::Query as Pairs;
use axum::http::Uri;

use crate::http::dto::problem::Fault;
use crate::http::problem::error::ApiError;

/// The parameters of one request and the faults found in them so far.
#[derive(Debug)]
pub struct Query {
    pairs: Vec<(String, String)>,
    faults: Vec<Fault>,
}

impl Query {
    /// Splits the query of an address; `known` lists the parameters that the route has.
    #[must_use]
    pub fn read(uri: &Uri, known: &[&str]) -> Self {
        let mut query = Query {
            pairs: Vec::new(),
            faults: Vec::new(),
        };
        let pairs = match Pairs::<Vec<(String, String)>>::try_from_uri(uri) {
            Ok(Pairs(pairs)) => pairs,
            Err(rejection) => {
                query
                    .faults
                    .push(Fault::parameter("", rejection.body_text()));
                return query;
            }
        };
        for (name, value) in pairs {
            if !known.contains(&name.as_str()) {
                let allowed = if known.is_empty() {
                    "none".to_owned()
                } else {
                    quoted(known)
                };
                query.faults.push(Fault::parameter(
                    &name,
                    format!("`{name}` is not a parameter here; allowed: {allowed}"),
                ));
            } else if query.pairs.iter().any(|(other, _)| *other == name) {
                query.faults.push(Fault::parameter(
                    &name,
                    format!("`{name}` is given more than once; give it once"),
                ));
            } else {
                query.pairs.push((name, value));
            }
        }
        query
    }

    /// The value of a parameter, if it is given and `parse` can read it; otherwise notes what would be `allowed`.
    pub fn take<T>(
        &mut self,
        name: &str,
        allowed: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Option<T> {
        let (_, text) = self.pairs.iter().find(|(other, _)| other == name)?;
        let value = parse(text);
        if value.is_none() {
            self.faults.push(Fault::parameter(
                name,
                format!("`{name}` is `{text}`; allowed: {allowed}"),
            ));
        }
        value
    }

    /// Ends the reading.
    ///
    /// # Errors
    /// `bad-query` with every fault found.
    pub fn finish(self) -> Result<(), ApiError> {
        if self.faults.is_empty() {
            Ok(())
        } else {
            Err(ApiError::bad_query(self.faults))
        }
    }
}

/// A whole number from `low` to `high`; `22.0` counts as whole, as it does in JSON Schema.
#[must_use]
pub fn whole(text: &str, low: u32, high: u32) -> Option<u32> {
    let value: f64 = text.parse().ok()?;
    let within = value.fract() == 0.0 && value >= f64::from(low) && value <= f64::from(high);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to be whole and within the range of u32"
    )]
    within.then_some(value as u32)
}

/// What a number of a motion or a patch may be.
pub const INDEX: &str = "a whole number, counted from 0";

/// Reads the number of a motion or a patch.
#[must_use]
pub fn index(text: &str) -> Option<usize> {
    whole(text, 0, u32::MAX).and_then(|number| usize::try_from(number).ok())
}

/// Is the number of a motion or patch, if one is given, one of `count`?
///
/// # Errors
/// `bad-query` naming the parameter, its value and the largest number allowed.
pub fn require_index(name: &str, index: Option<usize>, count: usize) -> Result<(), ApiError> {
    match index {
        Some(index) if index >= count => Err(ApiError::bad_parameter(
            name,
            format!(
                "`{name}` is `{index}`; allowed: 0 to {}",
                count.saturating_sub(1)
            ),
        )),
        _ => Ok(()),
    }
}

fn quoted(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_are_read_up_to_both_limits() {
        assert_eq!(whole("1", 1, 1000), Some(1));
        assert_eq!(whole("1000", 1, 1000), Some(1000));
        assert_eq!(whole("22.0", 1, 1000), Some(22));
        for text in ["0", "1001", "1.5", "-1", "", "x", "NaN", "inf"] {
            assert_eq!(whole(text, 1, 1000), None, "{text:?} was accepted");
        }
    }

    #[test]
    fn all_faults_of_a_query_are_named_together() {
        let uri: Uri = "/v1/jobs?limit=0&limit=5&colour=red".parse().unwrap();
        let mut query = Query::read(&uri, &["limit"]);
        assert_eq!(
            query.take("limit", "1 to 1000", |text| whole(text, 1, 1000)),
            None
        );
        assert_eq!(query.faults.len(), 3, "{:?}", query.faults);
        assert!(query.finish().is_err());
    }
}
