//! Query parameters: each is one entry of a `query!` table, which gives its reader, its description in the contract and its fault. Unknown,
//! repeated and unreadable parameters are refused together.
use std::borrow::Cow;
use std::time::Duration;

use axum::extract::{Query as Pairs, Request};
use axum::http::{HeaderMap, Method, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use crate::problem::{ApiError, Fault, Result};
use railhead_jobs::model::{Priority, SubmitOptions};

/// A group of parameters, declared by [`query`].
pub trait Parameters: Sized {
    /// The names of the parameters.
    fn names() -> Vec<&'static str>;

    /// Takes the parameters from a query, which collects their faults.
    fn take(query: &mut Query) -> Self;

    /// Reads the query of a route that has no other parameters.
    ///
    /// # Errors
    /// `bad-query` with every fault.
    fn read(uri: &Uri) -> Result<Self> {
        let mut query = Query::read(uri, &Self::names());
        let parameters = Self::take(&mut query);
        query.finish()?;
        Ok(parameters)
    }
}

/// No parameters.
impl Parameters for () {
    fn names() -> Vec<&'static str> {
        Vec::new()
    }

    fn take(_: &mut Query) {}
}

/// Both groups of parameters.
impl<A: Parameters, B: Parameters> Parameters for (A, B) {
    fn names() -> Vec<&'static str> {
        [A::names(), B::names()].concat()
    }

    fn take(query: &mut Query) -> Self {
        (A::take(query), B::take(query))
    }
}

/// Layer around resources without parameters except `format`, which [`require_json`](super::accept::require_json) checks.
pub async fn refuse_parameters(request: Request, next: Next) -> Response {
    refuse_unknown(&["format"], request, next).await
}

/// Like [`refuse_parameters`], around resources whose `GET` can wait.
pub async fn refuse_all_but_wait(request: Request, next: Next) -> Response {
    let known: &[&str] = match *request.method() {
        Method::GET => &["format", "wait"],
        _ => &["format"],
    };
    refuse_unknown(known, request, next).await
}

async fn refuse_unknown(known: &[&str], request: Request, next: Next) -> Response {
    match Query::read(request.uri(), known).finish() {
        Ok(()) => next.run(request).await,
        Err(fault) => fault.into_response(),
    }
}

/// Parses the text of a parameter, and describes the texts that it accepts.
pub struct Reader<T> {
    allowed: Cow<'static, str>,
    /// Whether the parameter may be given more than once.
    repeated: bool,
    read: Read<T>,
}

/// Parses the texts of a parameter, at least one. Fails with the index of the text that cannot be parsed.
type Read<T> = Box<dyn Fn(&[&str]) -> Result<T, usize>>;

impl<T> Reader<T> {
    /// Parses a text.
    ///
    /// # Errors
    /// A description of the allowed values.
    pub fn read(&self, text: &str) -> Result<T, &str> {
        (self.read)(&[text]).map_err(|_| &*self.allowed)
    }
}

/// Returns the reader of a parameter that may be given more than once.
pub fn repeated<T: 'static>(one: Reader<T>) -> Reader<Vec<T>> {
    let read = one.read;
    let all = move |texts: &[&str]| {
        let texts = texts.iter().enumerate();
        texts
            .map(|(place, text)| read(&[text]).map_err(|_| place))
            .collect()
    };
    Reader {
        allowed: one.allowed,
        repeated: true,
        read: Box::new(all),
    }
}

/// Returns a reader that parses by a function; `allowed` describes the texts that it accepts.
pub fn reader<T>(
    allowed: impl Into<Cow<'static, str>>,
    read: impl Fn(&str) -> Option<T> + 'static,
) -> Reader<T> {
    Reader {
        allowed: allowed.into(),
        repeated: false,
        read: Box::new(move |texts| read(texts[0]).ok_or(0)),
    }
}

/// Returns the reader of a comma-separated list; `item` parses an entry.
pub fn list<T>(
    allowed: impl Into<Cow<'static, str>>,
    item: impl Fn(&str) -> Option<T> + 'static,
) -> Reader<Vec<T>> {
    reader(allowed, move |text| text.split(',').map(&item).collect())
}

/// Returns the reader of the index of a motion or a patch.
pub fn index() -> Reader<usize> {
    reader("a whole number, counted from 0", |text| {
        whole(text, 0, u32::MAX).and_then(|number| usize::try_from(number).ok())
    })
}

/// Returns the reader of a whole number from `low` to `high`.
pub fn count(low: u32, high: u32) -> Reader<u32> {
    reader(
        format!("a whole number from {low} to {high}"),
        move |text| whole(text, low, high),
    )
}

/// Returns the reader of a whole number of seconds from `low` to `high`.
pub fn seconds(low: u32, high: u32) -> Reader<u32> {
    reader(
        format!("a whole number of seconds from {low} to {high}"),
        move |text| whole(text, low, high),
    )
}

/// Returns the reader of one of these words, each with its value.
pub fn word<T: Copy>(words: &'static [(&'static str, T)]) -> Reader<T> {
    let names = words.iter().map(|(name, _)| format!("`{name}`"));
    let names: Vec<String> = names.collect();
    reader(names.join(", "), |text| {
        let found = words.iter().find(|(name, _)| *name == text);
        found.map(|(_, meaning)| *meaning)
    })
}

/// Returns the reader of the id of a job or a batch.
pub fn id(of: &'static str) -> Reader<Uuid> {
    reader(format!("the id of a {of}"), |text| {
        Uuid::try_parse(text).ok()
    })
}

/// Declares a group of parameters: a type with a field for each, `None` if the parameter is absent. An entry has the description in the
/// contract (`///` and `#[param(…)]`), the type, `as` the type in the contract, and the [`Reader`].
macro_rules! query {
    (
        $(#[doc = $about:literal])*
        $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $(#[param($($attribute:tt)*)])?
                $parameter:ident: $value:ty as $wire:ty = $reader:expr;
            )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug)]
        pub(crate) struct $name {
            $($(#[doc = $doc])* pub $parameter: Option<$value>,)*
        }

        impl $crate::extract::query::Parameters for $name {
            fn names() -> Vec<&'static str> {
                vec![$(stringify!($parameter)),*]
            }

            fn take(query: &mut $crate::extract::query::Query) -> Self {
                $name {
                    $($parameter: query.take(stringify!($parameter), &$reader),)*
                }
            }
        }

        impl utoipa::IntoParams for $name {
            fn into_params(
                place: impl Fn() -> Option<utoipa::openapi::path::ParameterIn>,
            ) -> Vec<utoipa::openapi::path::Parameter> {
                #[derive(utoipa::IntoParams)]
                #[into_params(parameter_in = Query)]
                #[expect(dead_code, reason = "describes the parameters in the contract")]
                struct Contract {
                    $($(#[doc = $doc])* $(#[param($($attribute)*)])? $parameter: Option<$wire>,)*
                }
                Contract::into_params(place)
            }
        }
    };
}
pub(crate) use query;

/// The parameters of one request, and the faults found in them so far.
#[derive(Debug, Default)]
pub struct Query {
    pairs: Vec<(String, String)>,
    faults: Vec<Fault>,
    repeatable: Vec<String>,
}

impl Query {
    /// Splits the query of a URI; `known` lists the parameters of the route.
    #[must_use]
    pub fn read(uri: &Uri, known: &[&str]) -> Self {
        let mut query = Query::default();
        let pairs = match Pairs::<Vec<(String, String)>>::try_from_uri(uri) {
            Ok(Pairs(pairs)) => pairs,
            Err(rejection) => {
                let fault = Fault::parameter("", rejection.body_text());
                query.faults.push(fault);
                return query;
            }
        };
        for (name, value) in pairs {
            if known.contains(&name.as_str()) {
                query.pairs.push((name, value));
            } else if !query
                .faults
                .iter()
                .any(|fault| fault.parameter.as_deref() == Some(&name))
            {
                let quoted: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
                let allowed = match quoted.is_empty() {
                    true => "none".to_owned(),
                    false => quoted.join(", "),
                };
                let detail = format!("`{name}` is not a parameter here; allowed: {allowed}");
                query.faults.push(Fault {
                    code: "unknown-parameter".into(),
                    value: Some(value.into()),
                    allowed: known.iter().map(ToString::to_string).collect(),
                    ..Fault::parameter(&name, detail)
                });
            }
        }
        query
    }

    /// Like [`Query::read`], but ignores the parameters that `known` does not list.
    #[must_use]
    pub fn part_of(uri: &Uri, known: &[&str]) -> Self {
        let mut query = Query::read(uri, known);
        query.faults.clear();
        query
    }

    /// Returns the value of a parameter; `None` if it is absent, or if it cannot be parsed, which is noted as a fault.
    pub fn take<T>(&mut self, name: &str, reader: &Reader<T>) -> Option<T> {
        let pairs = self.pairs.iter();
        let texts: Vec<&str> = pairs
            .filter(|(other, _)| other == name)
            .map(|(_, text)| text.as_str())
            .collect();
        if texts.is_empty() {
            return None;
        }
        if reader.repeated {
            self.repeatable.push(name.to_owned());
        }
        match (reader.read)(&texts) {
            Ok(value) => Some(value),
            Err(place) => {
                let (text, allowed) = (texts[place], &reader.allowed);
                let detail = format!("`{name}` is `{text}`; allowed: {allowed}");
                self.faults.push(Fault {
                    value: Some(text.into()),
                    ..Fault::parameter(name, detail)
                });
                None
            }
        }
    }

    /// Checks that every parameter was valid.
    ///
    /// # Errors
    /// `bad-query` with every fault found.
    pub fn finish(mut self) -> Result<()> {
        for (place, (name, _)) in self.pairs.iter().enumerate() {
            let before = self.pairs[..place]
                .iter()
                .filter(|(other, _)| other == name);
            if before.count() == 1 && !self.repeatable.contains(name) {
                let detail = format!("`{name}` is given more than once; give it once");
                self.faults.push(Fault {
                    code: "repeated".into(),
                    ..Fault::parameter(name, detail)
                });
            }
        }
        if self.faults.is_empty() {
            Ok(())
        } else {
            Err(ApiError::bad_query(self.faults))
        }
    }
}

/// Parses a whole number from `low` to `high`; `22.0` counts as whole, as in JSON Schema.
#[must_use]
pub fn whole(text: &str, low: u32, high: u32) -> Option<u32> {
    let value: f64 = text.parse().ok()?;
    let within = value.fract() == 0.0 && value >= f64::from(low) && value <= f64::from(high);
    within.then_some(value as u32)
}

/// Refuses the index of a motion or a patch that is not below `count`.
///
/// # Errors
/// `bad-query` naming the parameter, its value and the largest number allowed.
pub fn require_index(name: &str, index: Option<usize>, count: usize) -> Result<()> {
    match index {
        Some(index) if index >= count => Err(no_such_index(name, index, count)),
        _ => Ok(()),
    }
}

/// Returns the refusal of an index that is not below `count`.
pub fn no_such_index(name: &str, index: usize, count: usize) -> ApiError {
    let last = count.saturating_sub(1);
    ApiError::bad_parameter(name, format!("`{name}` is `{index}`; allowed: 0 to {last}"))
}

/// Most characters of a name, and of the key and the value of a label, as in a case.
const NAME_MAX: usize = 200;
const KEY_MAX: usize = 64;
const VALUE_MAX: usize = 256;
/// Most labels, as in a case.
pub const LABELS_MAX: usize = 32;

/// Returns the reader of a label to search for.
pub fn label() -> Reader<(String, String)> {
    reader("`key:value`", |text| {
        let (key, value) = text.split_once(':')?;
        Some((key.to_owned(), value.to_owned()))
    })
}

/// Returns the reader of a label to assign.
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

/// Returns the reader of a name to assign, or of a part of a name to search for.
pub fn name() -> Reader<String> {
    let allowed = format!("1 to {NAME_MAX} characters without control characters");
    reader(allowed, |text| {
        let fits = (1..=NAME_MAX).contains(&text.chars().count());
        (fits && is_line(text)).then(|| text.to_owned())
    })
}

/// Returns the reader of a time, in milliseconds since 1970.
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

/// Longest deadline in s, 30 days.
pub const DEADLINE_MAX_SECONDS: u32 = 30 * 24 * 3600;

query! {
    /// Options of a submission.
    SubmitQuery {
        /// Order of the tenant's queued jobs: `high` before `normal` (default) before `low`. Priorities have no effect between tenants,
        /// which take turns
        #[param(example = "high")]
        priority: Priority as Priority = reader(Priority::ALL.map(Priority::name).join(", "), Priority::from_name);
        /// Seconds from now within which each job must end. A job that is still queued or running then fails as `deadline-passed`
        #[param(minimum = 1, maximum = 2_592_000, example = 600)]
        deadline_s: u32 as u32 = seconds(1, DEADLINE_MAX_SECONDS);
    }
}

impl SubmitQuery {
    /// Returns the options of a submission with these headers.
    #[must_use]
    pub(crate) fn options(self, headers: &HeaderMap) -> SubmitOptions {
        SubmitOptions {
            priority: self.priority.unwrap_or_default(),
            ends_within: self
                .deadline_s
                .map(|seconds| Duration::from_secs(seconds.into())),
            bypass_cache: wants_fresh(headers),
        }
    }
}

/// Whether the client refuses the result of an earlier identical case.
fn wants_fresh(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::CACHE_CONTROL);
    let mut directives = values
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','));
    directives.any(|directive| directive.trim().eq_ignore_ascii_case("no-cache"))
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
        assert_eq!(query.take("limit", &count(1, 1000)), None);
        assert_eq!(query.faults.len(), 2, "{:?}", query.faults);
        let faults = format!("{:?}", query.finish().unwrap_err());
        for detail in ["`colour` is not", "`limit` is `0`", "`limit` is given more"] {
            assert!(faults.contains(detail), "{detail}: {faults}");
        }
    }

    query! {
        /// Two parameters.
        Two {
            /// How many
            #[param(minimum = 1)]
            many: u32 as u32 = count(1, 7);
            /// Of what
            of: String as String = reader("a word", |text| Some(text.to_owned()));
        }
    }

    #[test]
    fn a_table_of_parameters_reads_names_faults_and_describes_itself() {
        let read = |text: &str| Two::read(&text.parse().unwrap());
        let two = read("/x?of=cases&many=7").unwrap();
        assert_eq!((two.many, two.of.as_deref()), (Some(7), Some("cases")));
        assert!(read("/x").unwrap().many.is_none());
        let fault = format!("{:?}", read("/x?many=8&off=1").unwrap_err());
        assert!(fault.contains("`many` is `8`; allowed: a whole number from 1 to 7"));
        assert!(fault.contains("`off` is not a parameter here; allowed: `many`, `of`"));
        let described = <Two as utoipa::IntoParams>::into_params(|| None);
        let described = serde_json::to_value(described).unwrap();
        assert_eq!(described[0]["name"], "many");
        assert_eq!(described[0]["in"], "query");
        assert_eq!(described[0]["description"], "How many");
        assert_eq!(described[0]["required"], false);
        assert_eq!(described[1]["schema"]["type"], "string");
    }
}
