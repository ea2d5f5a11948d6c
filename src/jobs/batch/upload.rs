//! Upload of a batch: cases are checked while they arrive, and staged in a file.
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::data_dir::nameless;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::idempotency;
use crate::model::{CaseOptions, Kind, SubmitOptions, WorkOptions, created_at};
use crate::profiles::KnownSections;
use crate::store::{NewBatch, NewJob, StoredCase};
use crate::submit::outputs_text;
use crate::sync::lock;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::error::{CaseError, Fault};
use railhead_contact::evaluate::varied::{make_room, named_sections, put};
use railhead_contact::problem::checked_case::CheckedCase;

/// A staged job: its index in the request, its own options, and the job without its body.
type Staged = (u32, CaseOptions, NewJob);

/// A file of staged cases, first in, first out.
#[derive(Debug)]
pub(crate) struct Staging(BufWriter<File>);

impl Staging {
    /// Creates an empty staging file in a folder.
    pub(crate) fn new(folder: &Path) -> io::Result<Staging> {
        Ok(Staging(BufWriter::with_capacity(
            1 << 18,
            nameless(folder)?,
        )))
    }

    /// Appends a case.
    pub(crate) fn push(&mut self, staged: &Staged, case: &[u8]) -> io::Result<()> {
        for part in [serde_json::to_vec(staged)?.as_slice(), case] {
            self.0.write_all(&(part.len() as u64).to_le_bytes())?;
            self.0.write_all(part)?;
        }
        Ok(())
    }

    /// Ends writing and reads from the beginning.
    pub(crate) fn into_reader(self) -> io::Result<StagingReader> {
        let mut file = self.0.into_inner()?;
        file.seek(SeekFrom::Start(0))?;
        Ok(StagingReader(BufReader::with_capacity(1 << 18, file)))
    }
}

/// A staging file that is read.
#[derive(Debug)]
pub(crate) struct StagingReader(BufReader<File>);

impl StagingReader {
    /// Reads the next cases: at most `jobs`, and none after `bytes` are reached.
    pub(crate) fn take(&mut self, jobs: usize, bytes: usize) -> io::Result<Vec<(Staged, Vec<u8>)>> {
        let mut taken = Vec::new();
        let mut size = 0;
        while taken.len() < jobs && size < bytes {
            let Some(staged) = self.part()? else { break };
            let case = self.part()?.unwrap_or_default();
            size += case.len();
            taken.push((serde_json::from_slice(&staged)?, case));
        }
        Ok(taken)
    }

    fn part(&mut self) -> io::Result<Option<Vec<u8>>> {
        let mut length = [0; 8];
        match self.0.read_exact(&mut length) {
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(None),
            read => read?,
        }
        let mut part = vec![0; usize::try_from(u64::from_le_bytes(length)).unwrap_or(0)];
        self.0.read_exact(&mut part)?;
        Ok(Some(part))
    }
}

/// A value and the member names that lead to its place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell(pub Vec<String>, pub Value);

impl Cell {
    /// The place as a JSON pointer.
    #[must_use]
    pub fn pointer(&self) -> String {
        let escaped = |part: &String| format!("/{}", part.replace('~', "~0").replace('/', "~1"));
        self.0.iter().map(escaped).collect()
    }
}

/// Digest of the cells of a row, independent of their order.
#[must_use]
pub fn digest(cells: &[Cell]) -> [u8; 32] {
    let places = cells.iter().map(|cell| (cell.pointer(), cell.1.clone()));
    idempotency::digest(&Value::Object(places.collect()))
}

/// The template with the values of a row.
///
/// # Errors
/// The index of the first cell whose place does not exist, and the reason.
pub fn fill(template: &Value, row: &[Cell]) -> Result<Value, (usize, String)> {
    let mut case = template.clone();
    for (number, Cell(path, value)) in row.iter().enumerate() {
        put(&mut case, path, value.clone()).map_err(|reason| (number, reason))?;
    }
    Ok(case)
}

impl StoredCase {
    /// Parses the case; of a row of a table, its template with the values of the row.
    ///
    /// # Errors
    /// The stored case cannot be read.
    pub fn value(&self) -> Result<Value> {
        let damaged = |reason: String| JobsError::Damaged(format!("a stored case: {reason}"));
        let Some(template) = &self.template else {
            return serde_json::from_slice(&self.body).map_err(|error| damaged(error.to_string()));
        };
        let template = serde_json::from_slice(template);
        let template: Value = template.map_err(|error| damaged(error.to_string()))?;
        let row: Vec<Cell> =
            serde_json::from_slice(&self.body).map_err(|error| damaged(error.to_string()))?;
        fill(&template, &row).map_err(|(_, reason)| damaged(reason))
    }
}

/// Number of invalid cases whose faults are kept; further ones are only counted.
const FAULTY_KEPT: usize = 1000;

/// An invalid case of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultyCase {
    /// Index of the case in the request, from 0.
    pub index: u32,
    /// Line of the case in the text, from 1, if each case is a line.
    pub line: Option<u64>,
    /// Every fault of the case.
    pub faults: Vec<Fault>,
}

/// A case of a batch with its own options.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchCase {
    /// The case.
    pub case: Value,
    /// Whether the case is wrapped in an object with its options: `{"case": …, "priority": …}`.
    pub wrapped: bool,
    /// Options of the case.
    pub own: CaseOptions,
}

/// A row of a table with its own options.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BatchRow {
    /// Values for the template.
    pub cells: Vec<Cell>,
    /// Options of the row.
    pub own: CaseOptions,
}

/// A batch that is being received. Checked cases are staged in a file of the data folder. Dropping it removes everything.
#[derive(Debug)]
pub struct BatchUpload {
    jobs: Jobs,
    /// The batch as it will be stored, except for data that are known at the end of the upload.
    pub new: NewBatch,
    pub(crate) staging: Option<Staging>,
    /// The template that rows fill.
    rows: Option<Arc<RowTemplate>>,
    digest: blake3::Hasher,
    /// Number of cases so far.
    pub cases: u32,
    /// The first invalid cases.
    pub faulty: Vec<FaultyCase>,
    /// Number of bytes counted as staged.
    staged: u64,
    /// Stored profiles that its cases refer to.
    profiles: KnownSections,
}

/// The template of a table.
#[derive(Debug)]
struct RowTemplate {
    /// The case with the points of its cross-sections.
    case: Value,
    /// The case as given, for rows that name other cross-sections.
    given: Value,
    /// Cache of the last profile pairs.
    known: KnownPair,
}

/// A checked case: its options, its job, and the body that is stored.
type Checked = (CaseOptions, NewJob, Vec<u8>);

impl BatchUpload {
    /// Sets the template that the rows of [`BatchUpload::add_row`] fill: with the points of its cross-sections, and as given. It is stored
    /// once for all of them.
    pub fn set_row_template(&mut self, case: Value, given: Value) {
        let template = Bytes::from(case.to_string());
        self.digest.update(&template);
        self.new.template = Some(template);
        let known = KnownPair::default();
        self.rows = Some(Arc::new(RowTemplate { case, given, known }));
    }

    /// Sets the common part and the head of a run. `whole` is the text that identifies a submission.
    pub(crate) fn set_head(&mut self, template: Bytes, head: Bytes, whole: &[u8]) {
        self.digest.update(whole);
        self.new.template = Some(template);
        self.new.head = Some(head);
    }

    /// Checks a case and stages it if it is valid. `case` is the parsed `text`, or the faults of parsing. Blocks; not for
    /// threads that answer requests.
    ///
    /// # Errors
    /// The file could not be written, or a bound is exceeded: [`JobsError::QueueFull`],
    /// [`JobsError::QuotaExceeded`], [`JobsError::StagingFull`], [`JobsError::StagingQuotaExceeded`].
    pub fn add(
        &mut self,
        line: Option<u64>,
        text: &[u8],
        case: Result<BatchCase, Vec<Fault>>,
    ) -> Result<()> {
        self.count(text.len())?;
        let wrapped = case.as_ref().is_ok_and(|case| case.wrapped);
        let checked = self.check_case(text, case);
        self.keep(line, if wrapped { "/case" } else { "" }, checked)
    }

    fn check_case(&mut self, text: &[u8], case: Result<BatchCase, Vec<Fault>>) -> Result<Checked> {
        let BatchCase { case, wrapped, own } = self.parsed(text, case)?;
        let named = !named_sections(&case).is_empty();
        let case = self.jobs.with_profiles_here(case, &mut self.profiles)?;
        let body = match wrapped || named {
            true => case.to_string().into_bytes(),
            false => text.to_owned(),
        };
        self.digest.update(&idempotency::digest(&case));
        self.digest_options(own);
        let job = self.bound_job(self.jobs.check(&case)?)?;
        Ok((own, job, body))
    }

    /// As [`BatchUpload::add`], for a row of a table.
    ///
    /// # Errors
    /// As [`BatchUpload::add`].
    pub fn add_row(
        &mut self,
        line: Option<u64>,
        text: &[u8],
        row: Result<BatchRow, Vec<Fault>>,
    ) -> Result<()> {
        // The case is checked and solved with the template, although only the row is stored.
        self.count(text.len() + self.new.template.as_ref().map_or(0, Bytes::len))?;
        let checked = self.check_row(text, row);
        self.keep(line, "", checked)
    }

    fn check_row(&mut self, text: &[u8], row: Result<BatchRow, Vec<Fault>>) -> Result<Checked> {
        let BatchRow { cells, own } = self.parsed(text, row)?;
        let Some(template) = self.rows.clone() else {
            let detail = "a row of a table without a template";
            return Err(JobsError::Damaged(detail.to_owned()));
        };
        self.digest.update(&digest(&cells));
        let names = |Cell(path, _): &&Cell| path.last().is_some_and(|last| last == "profile");
        let named: Vec<String> = cells.iter().filter(names).map(Cell::pointer).collect();
        let mut base = Cow::Borrowed(&template.case);
        if !named.is_empty() {
            base = Cow::Owned(template.given.clone());
            make_room(base.to_mut(), named.iter().map(String::as_str));
        }
        let case = fill(&base, &cells).map_err(|(number, reason)| {
            let detail = format!("the column `{}` {reason}", cells[number].pointer());
            CaseError(vec![Fault::new("", detail)])
        })?;
        let whole = !named_sections(&case).is_empty();
        let case = self.jobs.with_profiles_here(case, &mut self.profiles)?;
        self.digest_options(own);
        let checked = self.jobs.check_next(&template.known, &case)?;
        let job = NewJob {
            row: !whole,
            ..self.bound_job(checked)?
        };
        // A row that refers to a profile is stored as a whole case, because it contains the profile.
        let body = match whole {
            true => Ok(case.to_string().into_bytes()),
            false => serde_json::to_vec(&cells),
        };
        let body = body.map_err(|error| JobsError::Damaged(error.to_string()))?;
        Ok((own, job, body))
    }

    /// Adds a chunk of rows of a run. Blocks.
    ///
    /// # Errors
    /// As [`BatchUpload::add`].
    pub(crate) fn add_chunk(&mut self, method: &str, cost_us: u32, body: &[u8]) -> Result<()> {
        self.count(body.len())?;
        self.digest.update(body);
        let job = NewJob {
            row: true,
            method: method.to_owned(),
            outputs: outputs_text(&[]),
            cost_us,
            slice_us: cost_us,
            ..NewJob::default()
        };
        self.stage(CaseOptions::default(), job, body)
    }

    /// Counts a valid case and stages it.
    fn stage(&mut self, own: CaseOptions, job: NewJob, kept: &[u8]) -> Result<()> {
        let staged = (self.cases, own, job);
        self.cases += 1;
        let Some(staging) = &mut self.staging else {
            return Ok(());
        };
        self.new.bytes += kept.len() as u64;
        let written = staging.push(&staged, kept);
        written.map_err(|source| self.jobs.spool_failed(source))
    }

    /// Returns a parsed case, or the faults of its text.
    fn parsed<T>(&mut self, text: &[u8], read: Result<T, Vec<Fault>>) -> Result<T> {
        read.map_err(|faults| {
            self.digest.update(text);
            CaseError(faults).into()
        })
    }

    /// Adds the options of a case to the digest, unless they are the defaults.
    fn digest_options(&mut self, own: CaseOptions) {
        if own != CaseOptions::default() {
            let own = SubmitOptions::default().of_case(own);
            self.digest.update(&own.digest(&[0; 32]));
        }
    }

    /// The job of a checked case with the labels of the key.
    fn bound_job(&self, mut checked: CheckedCase) -> Result<NewJob> {
        let labels = &mut checked.label.labels;
        self.jobs.bind(labels).map_err(CaseError)?;
        Ok(self.jobs.new_job(checked))
    }

    /// Counts an invalid case and keeps its faults.
    fn reject(&mut self, line: Option<u64>, faults: Vec<Fault>) {
        let index = self.cases;
        self.cases += 1;
        self.new.rejected += 1;
        if self.faulty.len() < FAULTY_KEPT {
            self.faulty.push(FaultyCase {
                index,
                line,
                faults,
            });
        }
    }

    /// Stages a checked case, or rejects an invalid one with pointers that begin with `prefix`.
    fn keep(&mut self, line: Option<u64>, prefix: &str, checked: Result<Checked>) -> Result<()> {
        match checked {
            Ok((own, job, body)) => self.stage(own, job, &body),
            Err(JobsError::Case(CaseError(mut faults))) => {
                for fault in &mut faults {
                    fault.pointer.insert_str(0, prefix);
                }
                self.reject(line, faults);
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    fn count(&mut self, bytes: usize) -> Result<()> {
        let (shared, bytes) = (&self.jobs.shared, bytes as u64);
        let bounds = shared.options.staging;
        shared.staged.add(&self.jobs.tenant, bytes, bounds)?;
        self.staged += bytes;
        Ok(())
    }

    /// The batch as it will be stored. Its digest covers all cases, name, labels and options.
    pub(crate) fn as_new(&mut self, options: WorkOptions) -> NewBatch {
        let (name, labels) = (options.name, options.labels);
        if name.is_some() || !labels.is_empty() {
            // Quotes separate the texts.
            self.digest
                .update(format!("{name:?} {labels:?}").as_bytes());
        }
        let digest = options.submit.digest(self.digest.finalize().as_bytes());
        NewBatch {
            count: self.cases - self.new.rejected,
            name,
            labels,
            idempotency: options.idempotency_key.map(|key| (key, digest)),
            ..self.new.clone()
        }
    }
}

impl Drop for BatchUpload {
    fn drop(&mut self) {
        let shared = &self.jobs.shared;
        shared.staged.give_back(&self.jobs.tenant, self.staged);
        lock(&shared.batches).living.remove(&self.new.id);
    }
}

impl Jobs {
    /// Begins a batch, or a run for [`Kind::Rows`].
    ///
    /// # Errors
    /// [`JobsError::Draining`], or the data folder cannot be written.
    pub fn draft(&self, kind: Kind) -> Result<BatchUpload> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        let staging = Staging::new(&self.shared.options.data_dir);
        let staging = staging.map_err(|source| self.spool_failed(source))?;
        let id = self.shared.new_id();
        lock(&self.shared.batches).living.insert(id);
        Ok(BatchUpload {
            jobs: self.clone(),
            new: NewBatch {
                id,
                tenant: self.tenant.clone(),
                kind,
                created_at: created_at(id),
                ..NewBatch::default()
            },
            staging: Some(staging),
            rows: None,
            digest: blake3::Hasher::new(),
            cases: 0,
            faulty: Vec::new(),
            staged: 0,
            profiles: KnownSections::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::model::Kind;

    #[test]
    fn what_goes_in_comes_out_in_order_and_no_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let mut staging = Staging::new(folder.path()).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let staged = |index| {
            let job = NewJob {
                name: Some("a\nb".to_owned()),
                cost_us: 7,
                cache_key: Some([3; 16]),
                ..NewJob::default()
            };
            (index, CaseOptions::default(), job)
        };
        for index in 0..5 {
            staging
                .push(&staged(index), &vec![b'x'; index as usize])
                .unwrap();
        }
        let mut reader = staging.into_reader().unwrap();
        let first = reader.take(2, usize::MAX).unwrap();
        let second = reader.take(9, 3).unwrap();
        let rest = reader.take(9, usize::MAX).unwrap();
        assert_eq!([first.len(), second.len(), rest.len()], [2, 2, 1]);
        let all = [first, second, rest].concat();
        for (index, (read, case)) in (0..).zip(all) {
            assert_eq!((read, case.len()), (staged(index), index as usize));
        }
        assert!(reader.take(1, 1).unwrap().is_empty());
    }

    #[test]
    fn a_stored_row_is_the_case_that_was_checked() {
        let template = json!({ "load": { "normal_force_n": 1 }, "y_mm": [0, 1] });
        let row = vec![
            Cell(vec!["load".into(), "normal_force_n".into()], json!(8e4)),
            Cell(vec!["labels".into(), "km".into()], json!("37.2")),
            Cell(vec!["y_mm".into(), "1".into()], json!(-2)),
        ];
        let checked = fill(&template, &row).unwrap();
        let stored = StoredCase {
            kind: Kind::Case,
            template: Some(template.to_string().into()),
            head: None,
            body: serde_json::to_vec(&row).unwrap().into(),
        };
        assert_eq!(stored.value().unwrap(), checked);
        assert_eq!(
            checked,
            json!({ "load": { "normal_force_n": 8e4 }, "labels": { "km": "37.2" }, "y_mm": [0, -2] })
        );
    }
}
