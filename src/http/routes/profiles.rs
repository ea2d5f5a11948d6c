//! `/v1/profiles`: stored cross-sections, which cases name by their digest.

use axum::Json;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::dto::rfc3339;
use crate::extract::caller::{Caller, path_text};
use crate::extract::json::JsonBody;
use crate::extract::query::Parameters;
use crate::problem::{ApiError, ProblemKind, Result, problems};
use crate::routes::lists::{LIMIT_DEFAULT, PageQuery, answer};
use crate::state::AppState;
use railhead_contact::case::words::cross_section::CrossSection;
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::damage::SectionQuality;

/// The digest in the path.
#[derive(Debug, Clone)]
pub(crate) struct Digest(String);

impl FromRequestParts<AppState> for Digest {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let text = path_text(parts, state, "digest", ProblemKind::ProfileNotFound).await?;
        Ok(Digest(text))
    }
}

/// A stored cross-section.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct KeptProfile {
    /// Digest by which cases refer to it: `{ "profile": "<digest>" }` in place of points or text.
    digest: String,
    /// `rail` or `wheel`, from the file or from the shape of the points.
    body: &'static str,
    /// Quality of its points.
    quality: SectionQuality,
    /// Remarks on how its points or its file were read, with pointers into the cross-section.
    remarks: Vec<RemarkEntry>,
    /// Time at which it was first stored.
    #[schema(format = "date-time")]
    created_at: String,
}

problems! {
    /// Problems of `POST /v1/profiles`.
    KeepProfileProblems: BadQuery, MalformedJson, UnreadableBody, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding, FaultyCase,
    ProfilesFull, Draining, StorageFull, StorageUnwritable
}

/// Stores a cross-section, so that cases can refer to it.
///
/// The body is a cross-section as in `rail` and `wheel` of a case. It is stored for the tenant until it is deleted; storing it again
/// changes nothing. A case that refers to it is stored with its points, so jobs do not depend on a later deletion.
#[utoipa::path(
    post,
    path = "/v1/profiles",
    tag = "profiles",
    operation_id = "keep_profile",
    request_body(content = CrossSection, description = "One cross-section", content_type = "application/json"),
    responses(
        (status = 201, description = "The profile is stored", body = KeptProfile, headers(("Location" = String, description = "Path of the profile"))),
        (status = 200, description = "The profile was stored before", body = KeptProfile, headers(("Location" = String, description = "Path of the profile"))),
        KeepProfileProblems
    )
)]
pub(crate) async fn keep(
    Caller(jobs): Caller,
    JsonBody { value, room }: JsonBody,
) -> Result<Response> {
    let (kept, report, before) = jobs.keep_profile(value).await?;
    drop(room);
    let location = [(header::LOCATION, format!("/v1/profiles/{}", kept.digest))];
    let status = match before {
        true => StatusCode::OK,
        false => StatusCode::CREATED,
    };
    let body = Json(KeptProfile {
        digest: kept.digest,
        body: report.body,
        quality: report.quality,
        remarks: report.remarks,
        created_at: rfc3339(kept.created_at),
    });
    Ok((status, location, body).into_response())
}

/// A stored cross-section in a list.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ProfileEntry {
    /// Digest by which cases refer to it.
    digest: String,
    /// Bytes that count toward `--tenant-profiles-mb`.
    bytes: u64,
    /// Time at which it was first stored.
    #[schema(format = "date-time")]
    created_at: String,
}

/// The stored cross-sections of a tenant.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ProfileList {
    /// The cross-sections of this page, newest first.
    profiles: Vec<ProfileEntry>,
    /// Value of `cursor` for the next page; null on the last page.
    next_cursor: Option<String>,
    /// Largest number of bytes that may be stored in all.
    bytes_max: u64,
}

problems! {
    /// Problems of the list of profiles.
    ListProfilesProblems: BadQuery, Forbidden
}

/// Lists stored profiles, newest first.
///
/// A key that is bound to labels may not list profiles.
#[utoipa::path(
    get,
    path = "/v1/profiles",
    tag = "profiles",
    operation_id = "list_profiles",
    params(PageQuery),
    responses((status = 200, description = "A page of stored profiles", body = ProfileList, headers(
        ("Link" = String, description = "The next page (`rel=next`); absent on the last page")
    )), ListProfilesProblems)
)]
pub(crate) async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Response> {
    let PageQuery { limit, cursor } = PageQuery::read(&uri)?;
    let limit = limit.unwrap_or(LIMIT_DEFAULT);
    let page = jobs.profiles(cursor.as_deref(), limit).await?;
    let entries = page.entries.into_iter().map(|entry| ProfileEntry {
        digest: entry.digest,
        bytes: entry.bytes,
        created_at: rfc3339(entry.created_at),
    });
    let list = ProfileList {
        profiles: entries.collect(),
        next_cursor: page.next_cursor.clone(),
        bytes_max: jobs.options().tenant_profiles_max_bytes,
    };
    Ok(answer(&uri, page.next_cursor.as_deref(), list))
}

problems! {
    /// Problems of one profile.
    ProfileProblems: BadQuery, ProfileNotFound
}

/// Returns the cross-section as it was sent.
#[utoipa::path(
    get,
    path = "/v1/profiles/{digest}",
    tag = "profiles",
    operation_id = "get_profile",
    params(("digest" = String, Path, description = "Digest of the profile")),
    responses((status = 200, description = "The cross-section", body = CrossSection), ProfileProblems)
)]
pub(crate) async fn get(Caller(jobs): Caller, Digest(digest): Digest) -> Result<Json<Value>> {
    let kept = jobs.profile(&digest).await?;
    let value = serde_json::from_slice(&kept.body);
    Ok(Json(value.map_err(ApiError::internal)?))
}

/// Removes a stored cross-section. Jobs and runs that refer to it are not affected.
///
/// A key that is bound to labels may not remove profiles.
#[utoipa::path(
    delete,
    path = "/v1/profiles/{digest}",
    tag = "profiles",
    operation_id = "delete_profile",
    params(("digest" = String, Path, description = "Digest of the profile")),
    responses((status = 204, description = "The profile is deleted"), ProfileProblems)
)]
pub(crate) async fn delete(Caller(jobs): Caller, Digest(digest): Digest) -> Result<StatusCode> {
    jobs.delete_profile(&digest).await?;
    Ok(StatusCode::NO_CONTENT)
}
