//! What lists have in common: filters by label, name and time, and the link from one page to the next (RFC 8288).

use axum::Json;
use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

/// Declares the parameters of a list: its own, then those of every list. As [`query!`](crate::http::extract::query::query).
macro_rules! list_query {
    ($(#[doc = $about:literal])* $name:ident { $($own:tt)* }) => {
        $crate::http::extract::query::query! {
            $(#[doc = $about])*
            $name(() => ()) {
                $($own)*
                /// Only those with this label, written `key:value`; may be repeated for those that have all of them
                #[param(example = json!(["line:A12"]))]
                label: Vec<(String, String)> as Vec<String> = $crate::http::extract::query::Repeated($crate::http::extract::labels::label());
                /// Only those whose name contains this text; the letters A to Z match in either case
                #[param(min_length = 1, max_length = 200, example = "crown")]
                name: String as String = $crate::http::extract::labels::name();
                /// Only those submitted at or after this time (RFC 3339)
                #[param(format = "date-time", example = "2026-01-31T09:30:00Z")]
                created_after: i64 as String = $crate::http::extract::labels::time();
                /// Only those submitted before this time (RFC 3339)
                #[param(format = "date-time")]
                created_before: i64 as String = $crate::http::extract::labels::time();
                /// `next_cursor` of the page before, with the same filters
                #[param(pattern = "^[0-9a-f]{40}$")]
                cursor: String as String = $crate::http::extract::query::reader("a cursor of this service", |text| Some(text.to_owned()));
            }
        }
    };
}
pub(crate) use list_query;

/// A page as an answer, linked to the next one.
pub(crate) fn answer(uri: &Uri, cursor: Option<&str>, page: impl Serialize) -> Response {
    link_next(uri, cursor, Json(page).into_response())
}

/// Links a page to the next one: the same address with another cursor.
fn link_next(uri: &Uri, cursor: Option<&str>, mut response: Response) -> Response {
    let Some(cursor) = cursor else {
        return response;
    };
    let query = uri.query().unwrap_or_default().split('&');
    let others = query.filter(|pair| !pair.is_empty() && !pair.starts_with("cursor="));
    let mut target = format!("<{}?", uri.path());
    for pair in others {
        target.push_str(pair);
        target.push('&');
    }
    target.push_str(&format!("cursor={cursor}>; rel=\"next\""));
    if let Ok(link) = HeaderValue::from_str(&target) {
        response.headers_mut().insert(header::LINK, link);
    }
    response
}

#[cfg(test)]
mod tests {
    use axum::response::IntoResponse;

    use super::*;

    #[test]
    fn the_next_page_has_the_same_filters_and_another_cursor() {
        let link = |uri: &'static str, cursor| {
            let response = link_next(&Uri::from_static(uri), cursor, ().into_response());
            let link = response.headers().get(header::LINK);
            link.map(|link| link.to_str().unwrap().to_owned())
        };
        assert_eq!(link("/v1/jobs", None), None);
        assert_eq!(
            link("/v1/jobs", Some("a")).as_deref(),
            Some("</v1/jobs?cursor=a>; rel=\"next\"")
        );
        assert_eq!(
            link("/v1/jobs?state=queued&cursor=a&label=x:%C3%A4", Some("b")).as_deref(),
            Some("</v1/jobs?state=queued&label=x:%C3%A4&cursor=b>; rel=\"next\"")
        );
    }
}
