//! The link from one page of a list to the next (RFC 8288).

use axum::http::{HeaderValue, Uri, header};
use axum::response::Response;

/// Links a page to the next one: the same address with another cursor.
pub fn link_next(uri: &Uri, cursor: Option<&str>, mut response: Response) -> Response {
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
