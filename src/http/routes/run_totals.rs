//! `/v1/runs/{id}/totals`: what the answers of a run come to, in all and per section of a line.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::State;
use axum::http::Uri;
use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::extract::caller::Caller;
use crate::http::extract::ids::RunId;
use crate::http::extract::query::{Parameters, query, reader};
use crate::http::limits::memory::Memory;
use crate::http::problem::error::ApiError;
use crate::http::routes::run_results::{ChunkSource, RunResultProblems, require_ended, selected};
use crate::jobs::codec::table::{RowTable, TableColumn, TableKind};
use crate::jobs::sync::blocking;

/// Columns whose totals are made when none are named.
const COLUMNS: [&str; 4] = [
    "force_x_n",
    "force_y_n",
    "friction_power_n",
    "pressure_max_mpa",
];
/// Percentiles when none are named.
const PERCENTILES: [f64; 4] = [50.0, 90.0, 99.0, 100.0];
/// Most sections.
const SECTIONS_MAX: usize = 10_000;

query! {
    /// Parameters of the totals of a run.
    RunTotalsQuery(() => ()) {
        /// Columns of numbers, with commas between; forces, power and pressure when left out
        #[param(example = "force_y_n,friction_power_n")]
        columns: Vec<String> as String = reader("names of columns with commas between", |text| {
            Some(text.split(',').map(|name| name.trim().to_owned()).collect())
        });
        /// Percentiles from 0 to 100, with commas between; 50, 90, 99 and 100 when left out
        #[param(example = "50,95,99.9")]
        percentiles: Vec<f64> as String = reader("numbers from 0 to 100 with commas between", |text| {
            numbers(text).filter(|all| all.iter().all(|percent| (0.0..=100.0).contains(percent)))
        });
        /// Comma-separated thresholds: counts the rows whose absolute value is at least each threshold
        #[param(example = "20000,30000")]
        above: Vec<f64> as String = reader("numbers with commas between", numbers);
        /// A column that was passed through unchanged: totals for each of its values, or of its intervals if it holds numbers
        #[param(example = "section")]
        by: String as String = reader("the name of a column", |text| Some(text.to_owned()));
        /// With `by`, and needed there if it holds numbers: the length of an interval
        #[param(exclusive_minimum = 0.0, example = 100)]
        width: f64 as f64 = reader("a number above 0", |text| {
            text.parse().ok().filter(|width: &f64| *width > 0.0 && width.is_finite())
        });
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |text: &str| {
        text.trim()
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
    };
    text.split(',').map(number).collect()
}

/// What the answers of a run come to.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunTotals {
    /// All rows.
    all: SectionTotals,
    /// Sections in the order of their values; only with `by`.
    sections: Option<Vec<SectionTotals>>,
}

/// What the answers to some rows come to.
#[none_is_absent]
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SectionTotals {
    /// The value of `by`; only for texts.
    value: Option<String>,
    /// Where the interval begins; only for numbers.
    from: Option<f64>,
    /// Number of rows.
    rows: u64,
    /// Number of rows by what became of them.
    statuses: BTreeMap<String, u64>,
    /// Totals by column; of the rows that have a number there.
    columns: BTreeMap<String, ColumnTotals>,
}

/// What the numbers of a column come to.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ColumnTotals {
    /// Rows that have a number.
    count: u64,
    /// The least number; null if there is none.
    min: Option<f64>,
    /// The largest number.
    max: Option<f64>,
    /// The mean.
    mean: Option<f64>,
    /// Percentiles of the absolute values.
    percentiles: BTreeMap<String, f64>,
    /// How many are at least this large, whatever their signs.
    above: BTreeMap<String, u64>,
}

/// Totals of the answers of an ended run: percentiles, exceedances, in all and per section of the line.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/totals",
    tag = "runs",
    operation_id = "get_run_totals",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        RunTotalsQuery
    ),
    responses((status = 200, description = "The totals", body = RunTotals), RunResultProblems)
)]
pub(crate) async fn totals(
    Caller(jobs): Caller,
    RunId(id): RunId,
    uri: Uri,
    State(memory): State<Memory>,
) -> Result<Json<RunTotals>, ApiError> {
    let query = RunTotalsQuery::read(&uri, &())?;
    let run = jobs.run(id).await?;
    require_ended(&run)?;
    let named = query.columns;
    let names = named.unwrap_or_else(|| COLUMNS.map(str::to_owned).to_vec());
    for (name, kind) in selected(&run, Some(names.clone()))? {
        if kind != TableKind::Numbers {
            let detail = format!("`{name}` holds no numbers");
            return Err(ApiError::bad_parameter("columns", detail));
        }
    }
    let section = section_of(&run.head.answers(), query.by, query.width)?;
    let rows = usize::try_from(run.head.rows).unwrap_or(usize::MAX);
    // Every number is kept once for all rows and once for its section.
    let bytes = rows.saturating_mul(16 * names.len());
    let share = memory.rows(jobs.tenant(), bytes).await?;
    let mut wanted = names.clone();
    wanted.push("status".to_owned());
    wanted.extend(section.iter().map(|section| section.name.clone()));
    let mut gathered = Gathered::new(names, section);
    let mut source = ChunkSource::new(jobs, run);
    while let Some(chunk) = source.next().await? {
        let table = source.answers(&chunk, wanted.clone()).await?;
        gathered.add(&table)?;
    }
    let percentiles = query.percentiles.unwrap_or_else(|| PERCENTILES.to_vec());
    let above = query.above.unwrap_or_default();
    let totals = blocking(move || {
        let _share = share;
        gathered.totals(&percentiles, &above)
    });
    Ok(Json(totals.await?))
}

/// How rows are told apart.
struct RowSection {
    name: String,
    /// Length of an interval; texts have none.
    width: Option<f64>,
}

fn section_of(
    columns: &[(String, TableKind)],
    by: Option<String>,
    width: Option<f64>,
) -> Result<Option<RowSection>, ApiError> {
    let Some(name) = by else {
        return match width {
            None => Ok(None),
            Some(_) => Err(ApiError::bad_parameter("width", "`width` belongs to `by`")),
        };
    };
    let kind = columns.iter().find(|(known, _)| *known == name);
    match (kind, width) {
        (None, _) => {
            let detail = format!("`{name}` is no column of this run");
            Err(ApiError::bad_parameter("by", detail))
        }
        (Some((_, TableKind::Texts)), None) => Ok(Some(RowSection { name, width })),
        (Some((_, TableKind::Texts)), Some(_)) => Err(ApiError::bad_parameter(
            "width",
            format!("`{name}` holds texts, which have no intervals"),
        )),
        (Some(_), None) => Err(ApiError::bad_parameter(
            "width",
            format!("`{name}` holds numbers; `width` says how long an interval is"),
        )),
        (Some(_), Some(_)) => Ok(Some(RowSection { name, width })),
    }
}

/// What tells a section from others: the number of its interval, or its text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum SectionKey {
    Interval(i64),
    Text(String),
}

struct Gathered {
    names: Vec<String>,
    section: Option<RowSection>,
    all: Numbers,
    sections: BTreeMap<SectionKey, Numbers>,
}

/// The numbers of some rows.
struct Numbers {
    rows: u64,
    statuses: BTreeMap<String, u64>,
    columns: Vec<Vec<f64>>,
}

impl Numbers {
    fn new(columns: usize) -> Numbers {
        Numbers {
            rows: 0,
            statuses: BTreeMap::new(),
            columns: vec![Vec::new(); columns],
        }
    }
}

impl Gathered {
    fn new(names: Vec<String>, section: Option<RowSection>) -> Gathered {
        Gathered {
            all: Numbers::new(names.len()),
            names,
            section,
            sections: BTreeMap::new(),
        }
    }

    fn add(&mut self, table: &RowTable) -> Result<(), ApiError> {
        let Some(TableColumn::Texts(statuses)) = table.column("status") else {
            return Err(ApiError::internal(&"answers without a status"));
        };
        let columns: Vec<&[f64]> = self
            .names
            .iter()
            .filter_map(|name| match table.column(name)? {
                TableColumn::Numbers(numbers) => Some(numbers.as_slice()),
                _ => None,
            })
            .collect();
        for (row, status) in statuses.iter().enumerate() {
            let status = status.as_deref().unwrap_or_default();
            note(&mut self.all, status, &columns, row);
            let Some(section) = &self.section else {
                continue;
            };
            let Some(key) = section.key(table, row) else {
                continue;
            };
            let width = self.names.len();
            let numbers = self.sections.entry(key);
            note(
                numbers.or_insert_with(|| Numbers::new(width)),
                status,
                &columns,
                row,
            );
            if self.sections.len() > SECTIONS_MAX {
                let detail = format!("there are more than {SECTIONS_MAX} sections");
                return Err(ApiError::bad_parameter("by", detail));
            }
        }
        Ok(())
    }

    fn totals(self, percentiles: &[f64], above: &[f64]) -> RunTotals {
        let names = &self.names;
        let width = self.section.as_ref().and_then(|section| section.width);
        let sections = self.sections.into_iter().map(|(key, numbers)| {
            let mut totals = totals_of(names, numbers, percentiles, above);
            match key {
                SectionKey::Text(text) => totals.value = Some(text),
                #[expect(clippy::cast_precision_loss, reason = "from a number")]
                SectionKey::Interval(place) => {
                    totals.from = width.map(|width| place as f64 * width);
                }
            }
            totals
        });
        RunTotals {
            sections: self.section.is_some().then(|| sections.collect()),
            all: totals_of(names, self.all, percentiles, above),
        }
    }
}

impl RowSection {
    fn key(&self, table: &RowTable, row: usize) -> Option<SectionKey> {
        match table.column(&self.name)? {
            TableColumn::Texts(texts) => {
                Some(SectionKey::Text(texts[row].clone().unwrap_or_default()))
            }
            TableColumn::Numbers(numbers) => self.interval(numbers[row]),
            #[expect(clippy::cast_precision_loss, reason = "for an interval")]
            TableColumn::Integers(numbers) => self.interval(numbers[row] as f64),
        }
    }

    fn interval(&self, number: f64) -> Option<SectionKey> {
        let place = (number / self.width?).floor();
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        (!place.is_nan()).then_some(SectionKey::Interval(place as i64))
    }
}

fn note(numbers: &mut Numbers, status: &str, columns: &[&[f64]], row: usize) {
    numbers.rows += 1;
    match numbers.statuses.get_mut(status) {
        Some(count) => *count += 1,
        None => drop(numbers.statuses.insert(status.to_owned(), 1)),
    }
    for (kept, column) in numbers.columns.iter_mut().zip(columns) {
        if !column[row].is_nan() {
            kept.push(column[row]);
        }
    }
}

fn totals_of(
    names: &[String],
    numbers: Numbers,
    percentiles: &[f64],
    above: &[f64],
) -> SectionTotals {
    let columns = names.iter().cloned().zip(numbers.columns);
    SectionTotals {
        value: None,
        from: None,
        rows: numbers.rows,
        statuses: numbers.statuses,
        columns: columns
            .map(|(name, values)| (name, column_totals(values, percentiles, above)))
            .collect(),
    }
}

fn column_totals(values: Vec<f64>, percentiles: &[f64], above: &[f64]) -> ColumnTotals {
    let count = values.len();
    let found = |value: f64| (count > 0).then_some(value);
    let min = values.iter().copied().fold(f64::INFINITY, f64::min);
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    #[expect(clippy::cast_precision_loss, reason = "a number of rows")]
    let mean = values.iter().sum::<f64>() / count.max(1) as f64;
    let mut sizes: Vec<f64> = values.into_iter().map(f64::abs).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let percentile = |percent: f64| {
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place among the rows"
        )]
        let place = (percent / 100.0 * count as f64).ceil() as usize;
        sizes.get(place.max(1) - 1).copied()
    };
    let percentiles = percentiles.iter();
    ColumnTotals {
        count: count as u64,
        min: found(min),
        max: found(max),
        mean: found(mean),
        percentiles: percentiles
            .filter_map(|percent| Some((percent.to_string(), percentile(*percent)?)))
            .collect(),
        above: above
            .iter()
            .map(|limit| {
                let below = sizes.partition_point(|size| size < limit);
                (limit.to_string(), (count - below) as u64)
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_and_exceedances_are_of_sizes() {
        let values: Vec<f64> = (1..=100)
            .map(|k| f64::from(k) * if k % 2 == 0 { -1.0 } else { 1.0 })
            .collect();
        let totals = column_totals(values, &[0.0, 50.0, 99.0, 100.0], &[90.0, 90.5]);
        let percentiles: Vec<f64> = ["0", "50", "99", "100"]
            .map(|p| totals.percentiles[p])
            .to_vec();
        assert_eq!(percentiles, [1.0, 50.0, 99.0, 100.0]);
        assert_eq!((totals.above["90"], totals.above["90.5"]), (11, 10));
        assert_eq!((totals.min, totals.max), (Some(-100.0), Some(99.0)));
        let none = column_totals(Vec::new(), &[50.0], &[1.0]);
        assert_eq!((none.count, none.mean, none.above["1"]), (0, None, 0));
        assert!(none.percentiles.is_empty());
    }
}
