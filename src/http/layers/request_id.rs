//! The id of a request: that of the client, or a new one; in the answer, in the log and in problems.

use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;
use uuid::Uuid;

/// Header that carries the request id in both directions.
pub(crate) const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest request id taken over from a client.
const REQUEST_ID_MAX_CHARS: usize = 128;

/// Takes over the client's request id, or makes one, and repeats it in the answer. An id that is empty, too long or
/// not made of visible ASCII characters is replaced, because it goes into the log.
pub(crate) async fn carry_request_id(mut request: Request, next: Next) -> Response {
    let given = request
        .headers()
        .get(&REQUEST_ID)
        .filter(|id| fit_for_log(id))
        .cloned();
    let id = given.or_else(|| HeaderValue::from_str(&Uuid::now_v7().to_string()).ok());
    let Some(id) = id else {
        return next.run(request).await;
    };
    request.headers_mut().insert(REQUEST_ID, id.clone());
    let mut response = next.run(request).await;
    response.headers_mut().insert(REQUEST_ID, id);
    response
}

fn fit_for_log(id: &HeaderValue) -> bool {
    let bytes = id.as_bytes();
    !bytes.is_empty()
        && bytes.len() <= REQUEST_ID_MAX_CHARS
        && bytes.iter().all(u8::is_ascii_graphic)
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use axum::body::Body;
    use axum::routing::get;
    use tower::ServiceExt;

    use super::*;

    fn router() -> Router {
        Router::new()
            .route("/", get(async || "answer"))
            .layer(axum::middleware::from_fn(carry_request_id))
    }

    #[tokio::test]
    async fn a_request_id_unfit_for_the_log_is_replaced() {
        for id in ["", "two words", &"x".repeat(129)] {
            let request = Request::get("/")
                .header("x-request-id", id)
                .body(Body::empty())
                .unwrap();
            let response = router().oneshot(request).await.unwrap();
            let answered = response.headers()["x-request-id"].to_str().unwrap();
            assert!(
                Uuid::parse_str(answered).is_ok(),
                "{id:?} was answered by {answered:?}"
            );
        }
    }
}
