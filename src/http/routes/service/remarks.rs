//! `/v1/remarks`: what each remark on an answer means, for clients that filter by code.

use axum::Json;

use crate::contact::remark::kind::RemarkKind;
use crate::contact::remark::list::Remark;
use crate::http::problem::catalogue::PlainProblems;

/// Every remark that an answer can carry: its code, what it means and what to do about it.
#[utoipa::path(
    get,
    path = "/v1/remarks",
    tag = "cases",
    operation_id = "list_remarks",
    responses((status = 200, description = "All kinds of remarks", body = Vec<RemarkKind>), PlainProblems)
)]
pub(crate) async fn remarks() -> Json<Vec<RemarkKind>> {
    Json(Remark::kinds())
}
