//! A run that is being received: rows are checked and divided into chunks while they arrive.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::File;

use serde_json::Value;

use crate::batch::upload::BatchUpload;
use crate::data_dir::nameless;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::Kind;
use crate::profiles::KnownSections;
use crate::run::model::{REASON, REMARKS, RunChunk, RunHead};
use crate::submit::microseconds;
use railhead_contact::case::words::solver::Output;
use railhead_contact::error::{CaseError, Fault};
use railhead_contact::evaluate::answer::NumberColumns;
use railhead_contact::evaluate::many::expected_seconds;
use railhead_contact::evaluate::varied::{
    Values, VariedColumn, column_pointer, make_room, of_values,
};
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_tables::read::require_exact;
use railhead_tables::table::COLUMNS_MAX;
use railhead_tables::titles::TitledColumn;

/// Expected solve time of a chunk in s: much longer than a claim, shorter than a lease, and cheap to repeat.
const CHUNK_SECONDS: f64 = 3.0;
/// Minimum number of rows of a chunk.
const CHUNK_ROWS_MIN: usize = 50;
/// Maximum size in bytes of the profiles that the rows of a run refer to: every chunk is solved with all of them.
const PROFILE_BYTES_MAX: usize = 8 << 20;
/// Maximum number of faults per column that are reported for one call of `push`.
const FAULTS_MAX: usize = 20;
/// Maximum number of rows of a chunk; also the number of rows that determine the size of all chunks.
const CHUNK_ROWS_MAX: usize = 10_000;

/// A run that is being received. Dropping it removes everything.
#[derive(Debug)]
pub struct RunDraft {
    jobs: Jobs,
    upload: BatchUpload,
    template: Value,
    /// Rows that are not in a chunk yet.
    rows: ReceivedRows,
    /// Set once the first rows have arrived.
    begun: Option<Begun>,
    rows_max: u64,
    /// Stored profiles that rows refer to.
    profiles: KnownSections,
    /// Total size of these profiles in bytes.
    profile_bytes: usize,
}

#[derive(Debug)]
struct Begun {
    head: RunHead,
    /// Places and values of the first row.
    first_row: Vec<(String, Value)>,
    row_seconds: f64,
}

impl Jobs {
    /// Begins a run of this case with at most `rows_max` rows. Blocks; not for threads that answer requests.
    ///
    /// # Errors
    /// [`JobsError::Case`] if a column is given twice, or no column varies the case; [`JobsError::Draining`]; or the data
    /// folder cannot be written.
    pub fn draft_run(
        &self,
        mut template: Value,
        columns: Vec<TitledColumn>,
        rows_max: u64,
    ) -> Result<RunDraft> {
        let varied = columns
            .iter()
            .filter_map(|column| column.pointer.as_deref());
        make_room(&mut template, varied);
        let rows = ReceivedRows::new(columns)?;
        let mut profiles = KnownSections::new();
        let template = self.with_profiles_here(template, &mut profiles)?;
        Ok(RunDraft {
            profiles: KnownSections::new(),
            profile_bytes: 0,
            upload: self.draft(Kind::Rows)?,
            jobs: self.clone(),
            template,
            rows,
            begun: None,
            rows_max,
        })
    }

    /// Creates an unnamed file for rows that are being received.
    ///
    /// # Errors
    /// The data folder cannot be written.
    pub fn spool_file(&self) -> Result<File> {
        let file = nameless(&self.options().data_dir);
        file.map_err(|source| self.spool_failed(source))
    }
}

impl RunDraft {
    /// Adds rows, column by column. Blocks; not for threads that answer requests.
    ///
    /// # Errors
    /// [`JobsError::Case`] if the columns differ in length or type or contain invalid values; [`JobsError::TooManyRows`];
    /// or as [`BatchUpload::add`].
    pub fn push(&mut self, columns: Vec<Values>) -> Result<()> {
        let faults = self.find_profiles(&columns)?;
        if !faults.is_empty() {
            return Err(CaseError(faults).into());
        }
        self.rows.push(columns)?;
        if self.rows.received > self.rows_max {
            return Err(JobsError::TooManyRows(self.rows_max));
        }
        if self.rows.held() >= CHUNK_ROWS_MAX {
            self.cut(false)?;
        }
        Ok(())
    }

    /// Stages the remaining rows once all were added, and returns the upload for [`Jobs::submit_batch`]. Blocks.
    ///
    /// # Errors
    /// [`JobsError::Case`] if there are no rows or the case of the first row is invalid; or as [`BatchUpload::add`].
    pub fn finish(mut self) -> Result<BatchUpload> {
        if self.rows.received == 0 {
            let fault = Fault::new("/columns", "0 rows given; at least one is needed");
            return Err(CaseError(vec![fault]).into());
        }
        self.cut(true)?;
        if let Some(Begun {
            mut head,
            first_row,
            ..
        }) = self.begun
        {
            head.rows = self.rows.received;
            head.profiles = self.profiles.into_iter().collect();
            let whole = head.whole();
            let (common, own) = head.into_parts(&self.template, first_row);
            self.upload.set_head(common, own, &whole);
        }
        Ok(self.upload)
    }

    /// Stages complete chunks of the rows that are held; with `last` all rows.
    fn cut(&mut self, last: bool) -> Result<()> {
        if self.begun.is_none() {
            self.begun = Some(self.begin()?);
        }
        let Some(begun) = &self.begun else {
            return Ok(());
        };
        let each = begun.head.chunk_rows as usize;
        let (held, rows) = (self.rows.held(), &self.rows);
        let mut begin = 0;
        while held - begin >= each || (last && begin < held) {
            let end = (begin + each).min(held);
            let chunk = RunChunk {
                first_row: rows.received - (held - begin) as u64,
                columns: rows.part(begin..end),
            };
            let seconds = begun.row_seconds * (end - begin) as f64;
            let body = chunk
                .to_bytes()
                .map_err(|source| self.jobs.spool_failed(source))?;
            self.upload
                .add_chunk(&begun.head.method, microseconds(seconds), &body)?;
            begin = end;
        }
        self.rows.values = self.rows.part(begin..held);
        Ok(())
    }

    /// Checks the case of the first row, and determines the number of rows per chunk.
    fn begin(&self) -> Result<Begun> {
        let varied = self.rows.varied(CHUNK_ROWS_MAX);
        let profiles: BTreeMap<String, Value> = self.profiles.clone().into_iter().collect();
        let names = self.rows.names();
        let first =
            self.jobs
                .first_row(&self.template, &varied, &profiles, &names, fields_asked_for);
        let (case, checked) = first?;
        let rows = varied.first().map_or(1, |column| column.values.len());
        let task = self.jobs.shared.rows_task(&case, &varied, &profiles);
        let row_seconds = expected_seconds(&task) / rows as f64;
        let wanted = CHUNK_SECONDS / row_seconds;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a clamped number"
        )]
        let chunk_rows = wanted.clamp(CHUNK_ROWS_MIN as f64, CHUNK_ROWS_MAX as f64) as u32;
        let names = NumberColumns::of(&checked).names();
        let mut head = RunHead::new(
            case,
            self.rows.columns.clone(),
            names.into_iter().map(str::to_owned).collect(),
            checked.run.method_asked.name().to_owned(),
        );
        head.chunk_rows = chunk_rows;
        let first_row = varied.iter();
        let first_row = first_row.map(|column| (column.pointer.clone(), column.values.value(0)));
        Ok(Begun {
            head,
            first_row: first_row.collect(),
            row_seconds,
        })
    }

    /// Reads the stored profiles that rows refer to.
    fn find_profiles(&mut self, columns: &[Values]) -> Result<Vec<Fault>> {
        let named = self.rows.columns.iter().zip(columns);
        let named = named.filter_map(|(column, values)| {
            Some((&*column.name, column.pointer.as_deref()?, values))
        });
        let found = (&mut self.profiles, &mut self.profile_bytes);
        let jobs = &self.jobs;
        jobs.find_sections(named, self.rows.received, found, PROFILE_BYTES_MAX)
    }
}

/// Rows that are being received.
#[derive(Debug)]
pub struct ReceivedRows {
    columns: Vec<TitledColumn>,
    /// Rows that are not in a chunk yet, column by column, in the units of the case.
    values: Vec<Values>,
    /// Number of rows received so far, including those in chunks.
    received: u64,
}

impl ReceivedRows {
    /// No rows yet, with these columns.
    ///
    /// # Errors
    /// A column is given twice or has an invalid name, or no column varies the case.
    pub fn new(columns: Vec<TitledColumn>) -> Result<ReceivedRows, CaseError> {
        let faults = faults_of_columns(&columns);
        if !faults.is_empty() {
            return Err(CaseError(faults));
        }
        let values = columns.iter().map(|column| match column.text {
            true => Values::Texts(Vec::new()),
            false => Values::Numbers(Vec::new()),
        });
        Ok(ReceivedRows {
            values: values.collect(),
            columns,
            received: 0,
        })
    }

    /// Adds rows, column by column.
    ///
    /// # Errors
    /// The columns differ in length or type, or contain invalid values.
    pub fn push(&mut self, columns: Vec<Values>) -> Result<(), CaseError> {
        let faults = self.faults_of(&columns);
        if !faults.is_empty() {
            return Err(CaseError(faults));
        }
        self.received += columns.first().map_or(0, Values::len) as u64;
        for ((held, more), column) in self.values.iter_mut().zip(columns).zip(&self.columns) {
            match (held, more) {
                (Values::Numbers(held), Values::Numbers(more)) => {
                    held.extend(more.into_iter().map(|number| column.in_case(number)));
                }
                (Values::Texts(held), Values::Texts(more)) => held.extend(more),
                _ => unreachable!("kinds were compared"),
            }
        }
        Ok(())
    }

    /// Number of rows that are held.
    #[must_use]
    pub fn held(&self) -> usize {
        self.values.first().map_or(0, Values::len)
    }

    /// Memory of the values in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.values.iter().map(Values::bytes).sum()
    }

    /// The columns that vary the case, with at most this many of the rows that are held.
    #[must_use]
    pub fn varied(&self, most: usize) -> Vec<VariedColumn> {
        let values = self.part(0..self.held().min(most));
        let varied = self.columns.iter().zip(values);
        let varied = varied.filter_map(|(column, values)| {
            let pointer = column.pointer.clone()?;
            Some(VariedColumn { pointer, values })
        });
        varied.collect()
    }

    /// The columns that vary the case, with their names.
    pub fn into_varied(self) -> impl Iterator<Item = (String, VariedColumn)> {
        let varied = self.columns.into_iter().zip(self.values);
        varied.filter_map(|(TitledColumn { name, pointer, .. }, values)| {
            let pointer = pointer?;
            Some((name, VariedColumn { pointer, values }))
        })
    }

    /// Place in the case and name of each column that varies it.
    #[must_use]
    pub fn names(&self) -> Vec<(&str, &str)> {
        let names = self.columns.iter();
        let names = names.filter_map(|column| Some((column.pointer.as_deref()?, &*column.name)));
        names.collect()
    }

    fn part(&self, range: std::ops::Range<usize>) -> Vec<Values> {
        let values = self.values.iter().map(|values| match values {
            Values::Numbers(numbers) => Values::Numbers(numbers[range.clone()].to_vec()),
            Values::Texts(texts) => Values::Texts(texts[range.clone()].to_vec()),
        });
        values.collect()
    }

    fn faults_of(&self, columns: &[Values]) -> Vec<Fault> {
        let rows = columns.first().map_or(0, Values::len);
        let mut faults = Vec::new();
        for (column, values) in self.columns.iter().zip(columns) {
            let pointer = column_pointer(&column.name);
            if values.len() != rows {
                let detail = format!(
                    "{} values given, the first column has {rows}; all columns need as many",
                    values.len()
                );
                faults.push(Fault::new(pointer, detail));
            } else if matches!(values, Values::Texts(_)) != column.text {
                let needed = if column.text { "texts" } else { "numbers" };
                let detail =
                    format!("a value of another type given; {needed} are needed in this column");
                faults.push(Fault::new(pointer, detail));
            } else if let Values::Texts(texts) = values {
                faults.extend(faults_of_texts(&column.name, texts, self.received));
            } else if let Some(place) = &column.pointer {
                let of = (&*column.name, &**place, column.factor);
                faults.extend(of_values(of, values, self.received));
            } else if let Values::Numbers(numbers) = values {
                faults.extend(fault_of_copied(&pointer, numbers, self.received));
            }
        }
        faults
    }
}

/// The fault of a case that requests other outputs than numbers.
fn fields_asked_for(checked: &CheckedCase) -> Option<Fault> {
    let numbers = [Output::Resultants, Output::Zones, Output::Gradients];
    let mut asked = checked.run.outputs.iter();
    let other = asked.find(|asked| !numbers.contains(asked))?;
    let other = other.name();
    let detail = format!(
        "`{other}` requested; rows have numbers only: allowed are `resultants`, `zones`, which gives the share that sticks, and `gradients`"
    );
    Some(Fault::new("/outputs", detail))
}

fn faults_of_columns(columns: &[TitledColumn]) -> Vec<Fault> {
    let mut faults = Vec::new();
    if columns.len() > COLUMNS_MAX {
        let detail = format!(
            "{} columns given; at most {COLUMNS_MAX} are allowed",
            columns.len()
        );
        return vec![Fault::new("/columns", detail)];
    }
    let answered = NumberColumns::all().names();
    let answered: HashSet<&str> = answered
        .into_iter()
        .chain(["row", "status", "method", REASON, REMARKS])
        .collect();
    let (mut names, mut places) = (HashSet::new(), HashMap::new());
    for column in columns {
        let pointer = column_pointer(&column.name);
        let place = column.pointer.as_deref();
        let before = place.and_then(|place| places.insert(place, &column.name));
        if !names.insert(&column.name) {
            let detail = format!("the column `{}` is given twice", column.name);
            faults.push(Fault::new(pointer.clone(), detail));
        } else if let (Some(before), Some(place)) = (before, place) {
            let detail = format!(
                "the columns `{before}` and `{}` are given for one member of the case, `{place}`",
                column.name
            );
            faults.push(Fault::new(pointer.clone(), detail));
        }
        if has_controls(&column.name) {
            let detail = format!(
                "{:?} given; control characters are not allowed in the name of a column",
                column.name
            );
            faults.push(Fault::new(pointer.clone(), detail));
        }
        if place.is_none() && answered.contains(&*column.name) {
            let detail = format!(
                "`{}` is the name of a result column; a column that is copied needs another name",
                column.name
            );
            faults.push(Fault::new(pointer, detail));
        }
    }
    if columns.iter().all(|column| column.pointer.is_none()) {
        let detail = "no column varies the case; at least one must be named by a JSON pointer such as `/load/normal_force_n` or by a short name";
        faults.push(Fault::new("/columns", detail));
    }
    faults
}

/// Faults of texts with control characters, which would break tables and log lines; `first` is the row of the first text.
fn faults_of_texts(name: &str, texts: &[Option<String>], first: u64) -> Vec<Fault> {
    let texts = (first..).zip(texts);
    let texts = texts.filter_map(|(row, text)| Some((row, text.as_deref()?)));
    texts
        .filter(|(_, text)| has_controls(text))
        .take(FAULTS_MAX)
        .map(|(row, text)| {
            let detail = format!("{text:?} given; control characters are not allowed");
            Fault::new(format!("{}/{row}", column_pointer(name)), detail)
        })
        .collect()
}

/// The fault of the first number that cannot be copied exactly; `first` is the row of the first number.
fn fault_of_copied(column: &str, numbers: &[f64], first: u64) -> Option<Fault> {
    (first..).zip(numbers).find_map(|(row, number)| {
        let detail = require_exact(*number).err()?;
        Some(Fault::new(format!("{column}/{row}"), detail))
    })
}

fn has_controls(text: &str) -> bool {
    text.chars().any(char::is_control)
}
