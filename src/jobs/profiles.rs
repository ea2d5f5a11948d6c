//! Stored profiles of a tenant, and cases that refer to them by digest.
//!
//! References are resolved at submission, so that jobs do not depend on profiles that are deleted later.
use std::collections::{BTreeMap, HashMap};

use bytes::Bytes;
use serde_json::Value;
use tokio::runtime::Handle;

use crate::error::{JobsError, Result};
use crate::handle::{Jobs, PAGE_MAX};
use crate::idempotency;
use crate::store::{Page, ProfileCursor, ProfileEntry, ProfileKept, StoredProfile};
use crate::sync::blocking;
use railhead_contact::case::check::{SectionReport, check_section};
use railhead_contact::error::{CaseError, Fault};
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_contact::evaluate::many::{NotAtOnce, evaluate_at_once, several_answers};
use railhead_contact::evaluate::varied::{
    Values, VariedColumn, column_pointer, named_and_given, named_sections, of_first_row,
    put_section, put_sections, row_of,
};
use railhead_contact::monitor::Monitor;
use railhead_contact::problem::checked_case::CheckedCase;

/// Recently read profiles by digest.
pub(crate) type KnownSections = HashMap<String, Value>;

impl Jobs {
    /// Checks and stores a profile; also returns whether it was stored already.
    ///
    /// # Errors
    /// [`JobsError::Case`] with every fault, [`JobsError::ProfilesFull`], [`JobsError::Draining`], or a failed database.
    pub async fn keep_profile(
        &self,
        section: Value,
    ) -> Result<(StoredProfile, SectionReport, bool)> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        let read = blocking(move || {
            let report = check_section(&section);
            let digest = blake3::Hash::from(idempotency::digest(&section)).to_hex();
            (report, digest.to_string(), section.to_string())
        });
        let (report, digest, text) = read.await?;
        let (report, tenant) = (report?, &*self.tenant);
        let new = StoredProfile {
            digest,
            body: Bytes::from(text),
            created_at: self.shared.now_ms(),
        };
        let max_bytes = self.shared.options.tenant_profiles_max_bytes;
        let kept = self.shared.store.add_profile(tenant, &new, max_bytes).await;
        match self.observe_write(kept)? {
            ProfileKept::Added => Ok((new, report, false)),
            ProfileKept::Existing(known) => Ok((known, report, true)),
            ProfileKept::Full => Err(JobsError::ProfilesFull(max_bytes)),
        }
    }

    /// Reads a stored profile.
    ///
    /// # Errors
    /// [`JobsError::ProfileNotFound`], or a failed database.
    pub async fn profile(&self, digest: &str) -> Result<StoredProfile> {
        let found = self.shared.store.profile(&self.tenant, digest).await?;
        found.ok_or(JobsError::ProfileNotFound)
    }

    /// Reads one page of the stored profiles, newest first; `limit` is clamped to 1 to [`PAGE_MAX`].
    ///
    /// # Errors
    /// [`JobsError::BoundKey`], [`JobsError::BadCursor`], or a failed database.
    pub async fn profiles(&self, cursor: Option<&str>, limit: u32) -> Result<Page<ProfileEntry>> {
        self.require_unbound("list the profiles of the tenant")?;
        let after = match cursor {
            Some(cursor) => Some(ProfileCursor::read(cursor).ok_or(JobsError::BadCursor)?),
            None => None,
        };
        let limit = limit.clamp(1, PAGE_MAX);
        let store = &self.shared.store;
        Ok(store.profiles(&self.tenant, after.as_ref(), limit).await?)
    }

    /// Deletes a stored profile. Jobs and runs that referred to it have copies.
    ///
    /// # Errors
    /// [`JobsError::BoundKey`], [`JobsError::ProfileNotFound`], or a failed database.
    pub async fn delete_profile(&self, digest: &str) -> Result<()> {
        self.require_unbound("delete profiles of the tenant")?;
        let store = &self.shared.store;
        match store.delete_profile(&self.tenant, digest).await? {
            true => Ok(()),
            false => Err(JobsError::ProfileNotFound),
        }
    }

    /// Resolves the references to stored profiles in a case.
    ///
    /// # Errors
    /// [`JobsError::Case`] if a profile does not exist, or if a reference and points are given; or a failed database.
    pub async fn with_profiles(&self, case: Value) -> Result<Value> {
        self.with_known_profiles(case, &mut KnownSections::new())
            .await
    }

    /// As [`Jobs::with_profiles`], blocking and with a cache.
    pub(crate) fn with_profiles_here(
        &self,
        case: Value,
        known: &mut KnownSections,
    ) -> Result<Value> {
        if named_sections(&case).is_empty() {
            return Ok(case);
        }
        Handle::current().block_on(self.with_known_profiles(case, known))
    }

    async fn with_known_profiles(
        &self,
        mut case: Value,
        known: &mut KnownSections,
    ) -> Result<Value> {
        if let Some(place) = named_and_given(&case) {
            let detail = "given together with points; a stored profile replaces points_mm, or text and format";
            return Err(CaseError(vec![Fault::new(format!("{place}/profile"), detail)]).into());
        }
        for (place, digest) in named_sections(&case) {
            let section = self.known_section(&digest, known).await?;
            let Some(section) = section else {
                return Err(CaseError(vec![unknown(format!("{place}/profile"), &digest)]).into());
            };
            put_section(&mut case, place, &section);
        }
        Ok(case)
    }

    /// Reads a stored profile; `None` if it does not exist.
    pub(crate) async fn known_section(
        &self,
        digest: &str,
        known: &mut KnownSections,
    ) -> Result<Option<Value>> {
        if let Some(section) = known.get(digest) {
            return Ok(Some(section.clone()));
        }
        let found = self.shared.store.profile(&self.tenant, digest).await?;
        let Some(found) = found else { return Ok(None) };
        let section: Value = serde_json::from_slice(&found.body)
            .map_err(|error| JobsError::Damaged(format!("profile {digest}: {error}")))?;
        known.insert(digest.to_owned(), section.clone());
        Ok(Some(section))
    }
}

/// The fault for a reference to a profile that does not exist.
pub(crate) fn unknown(pointer: String, digest: &str) -> Fault {
    let detail = format!(
        "`{digest}` given, which is not a profile of this tenant; `POST /v1/profiles` stores one and returns its digest"
    );
    Fault::new(pointer, detail)
}

impl Jobs {
    /// Reads the stored profiles that columns refer to. Blocks.
    ///
    /// # Errors
    /// A profile does not exist, or a failed database.
    pub fn profiles_of(&self, columns: &[VariedColumn]) -> Result<BTreeMap<String, Value>> {
        let mut known = KnownSections::new();
        let named = columns.iter();
        let named = named.map(|column| (&*column.pointer, &*column.pointer, &column.values));
        let faults = self.find_sections(named, 0, (&mut known, &mut 0), usize::MAX)?;
        match faults.is_empty() {
            true => Ok(known.into_iter().collect()),
            false => Err(CaseError(faults).into()),
        }
    }

    /// Reads the profiles that rows refer to. Each column has a name, a place in the case and values, the first of which
    /// belongs to row `first`. The sizes of the profiles are added to the second member of `found`. Returns at most one
    /// fault: a profile that does not exist, or more than `bytes_max` bytes in all. Blocks.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) fn find_sections<'a>(
        &self,
        columns: impl Iterator<Item = (&'a str, &'a str, &'a Values)>,
        first: u64,
        (known, bytes): (&mut KnownSections, &mut usize),
        bytes_max: usize,
    ) -> Result<Vec<Fault>> {
        for (name, _, values) in columns.filter(|(_, place, _)| place.ends_with("/profile")) {
            let Values::Texts(digests) = values else {
                continue;
            };
            for (row, digest) in (first..).zip(digests) {
                let pointer = || format!("{}/{row}", column_pointer(name));
                let Some(digest) = digest else {
                    let detail = "no text given; the digest of a stored profile is needed, as `POST /v1/profiles` returns it";
                    return Ok(vec![Fault::new(pointer(), detail)]);
                };
                if known.contains_key(digest) {
                    continue;
                }
                let pointer = pointer();
                match Handle::current().block_on(self.known_section(digest, known))? {
                    Some(section) => *bytes += section.to_string().len(),
                    None => return Ok(vec![unknown(pointer, digest)]),
                }
                if *bytes > bytes_max {
                    let detail = format!(
                        "the profiles that rows name take more than {bytes_max} bytes; send the rows as several runs"
                    );
                    return Ok(vec![Fault::new(pointer, detail)]);
                }
            }
        }
        Ok(Vec::new())
    }

    /// Inserts the values of the first row into the template and checks the case. `names` maps places in the case to names
    /// of columns.
    ///
    /// # Errors
    /// A column has no place in the case, the case is invalid, it has several answers, or `refused` returns a fault.
    pub fn first_row(
        &self,
        template: &Value,
        columns: &[VariedColumn],
        profiles: &BTreeMap<String, Value>,
        names: &[(&str, &str)],
        refused: impl FnOnce(&CheckedCase) -> Option<Fault>,
    ) -> Result<(Value, CheckedCase), CaseError> {
        let case = row_of(template, columns, 0).map_err(|(pointer, reason)| {
            let detail = format!("the column `{pointer}` {reason}");
            CaseError(vec![Fault::new(column_pointer(&pointer), detail)])
        })?;
        let mut whole = case.clone();
        put_sections(&mut whole, profiles);
        let checked = self.check(&whole);
        let checked = checked.map_err(|error| of_first_row(error, names))?;
        let faults = several_answers(&checked).into_iter();
        let faults = faults.chain(refused(&checked)).map(|fault| Fault {
            pointer: format!("/template{}", fault.pointer),
            ..fault
        });
        let faults: Vec<Fault> = faults.collect();
        if faults.is_empty() {
            Ok((case, checked))
        } else {
            Err(CaseError(faults))
        }
    }

    /// Evaluates rows on this thread, without a job. `checked` is the checked `case` of the first row. Blocks.
    ///
    /// # Errors
    /// The rows exceed the limits of one evaluation, or the monitor or `step` ended it.
    pub fn evaluate<E>(
        &self,
        (case, checked): (&Value, &CheckedCase),
        columns: &[VariedColumn],
        profiles: &BTreeMap<String, Value>,
        monitor: &dyn Monitor,
        step: impl FnMut() -> Result<(), E>,
    ) -> Result<RowsAnswer, NotAtOnce<E>> {
        let task = self.shared.rows_task(case, columns, profiles);
        let solve = |checked: &CheckedCase, monitor: &dyn Monitor| {
            self.shared.engine.solve_whole(checked, monitor)
        };
        evaluate_at_once(&task, checked, &solve, monitor, step)
    }
}
