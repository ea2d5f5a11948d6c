//! What each kind of problem means, as a type of the contract, and which problems a route can answer.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;
use utoipa::openapi::schema::Type;
use utoipa::openapi::{
    ContentBuilder, HeaderBuilder, ObjectBuilder, Ref, RefOr, Response, ResponseBuilder,
};

use crate::http::problem::error::PROBLEM_JSON;
use crate::http::problem::kinds::ProblemKind;

/// A kind of problem, explained.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[schema(as = ProblemKind)]
pub(crate) struct ProblemMeaning {
    /// The `type` that problems of this kind carry.
    #[serde(rename = "type")]
    #[schema(value_type = String, example = "/problems/faulty-case")]
    path: ProblemPath,
    /// The kind in a few words.
    title: &'static str,
    /// HTTP status code.
    status: u16,
    /// What it means and what to do about it.
    meaning: &'static str,
}

/// Written as `/problems/{slug}`.
#[derive(Debug, Clone, Copy)]
struct ProblemPath(&'static str);

impl Serialize for ProblemPath {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("/problems/{}", self.0))
    }
}

impl From<ProblemKind> for ProblemMeaning {
    fn from(kind: ProblemKind) -> Self {
        ProblemMeaning {
            path: ProblemPath(kind.slug()),
            title: kind.title(),
            status: kind.status(),
            meaning: kind.meaning(),
        }
    }
}

/// Declares the problems that a route can answer beside those that every route can, for its documentation.
macro_rules! problems {
    ($(#[$meta:meta])* $name:ident: $($kind:ident),* $(,)?) => {
        $(#[$meta])*
        pub(crate) struct $name;

        impl utoipa::IntoResponses for $name {
            fn responses() -> std::collections::BTreeMap<
                String,
                utoipa::openapi::RefOr<utoipa::openapi::Response>,
            > {
                $crate::http::problem::catalogue::describe(&[$($crate::http::problem::kinds::ProblemKind::$kind),*])
            }
        }
    };
}
pub(crate) use problems;

problems! {
    /// What a route that takes nothing can fail with.
    PlainProblems: BadQuery
}

/// The responses of these kinds of problems, one per status code.
#[must_use]
pub(crate) fn describe(kinds: &[ProblemKind]) -> BTreeMap<String, RefOr<Response>> {
    let mut by_status = BTreeMap::<u16, Vec<ProblemKind>>::new();
    for kind in kinds {
        by_status.entry(kind.status()).or_default().push(*kind);
    }
    by_status
        .into_iter()
        .map(|(status, kinds)| (status.to_string(), describe_together(&kinds)))
        .collect()
}

/// One response for all of these kinds.
pub(crate) fn describe_together(kinds: &[ProblemKind]) -> RefOr<Response> {
    let lines: Vec<String> = kinds
        .iter()
        .map(|kind| format!("`{}`: {}", kind.slug(), kind.meaning()))
        .collect();
    let content = ContentBuilder::new()
        .schema(Some(Ref::from_schema_name("Problem")))
        .build();
    let mut response = ResponseBuilder::new()
        .description(lines.join("\n\n"))
        .content(PROBLEM_JSON, content);
    if kinds.iter().any(|kind| kind.passes()) {
        let schema = ObjectBuilder::new().schema_type(Type::Integer);
        let header = HeaderBuilder::new()
            .schema(Some(schema))
            .description(Some("Seconds after which to try again."))
            .build();
        response = response.header("Retry-After", header);
    }
    response.build().into()
}
