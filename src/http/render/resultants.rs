//! Forces and moments as JSON and as a table, piece by piece as the client takes them.

use std::ops::Range;

use axum::body::Body;
use serde::Serialize;

use crate::contact::solution::words::answer::HistoryPoint;
use crate::http::dto::resultants::{PatchResultants, Resultants, Sum};
use crate::http::render::csv::{finish, number};
use crate::http::render::forces::Forces;
use crate::http::render::pieces::body;

/// Motions written at once.
const POINTS: usize = 64;

/// A part of the text.
enum Section {
    Text(String),
    /// Motions of the patch at this place.
    Points(usize, Range<usize>),
    /// Sums over the patches.
    Total(Range<usize>),
}

/// The JSON that [`Resultants`] is as a whole.
///
/// # Errors
/// The origin cannot be written.
pub(crate) fn json_body(resultants: Resultants) -> Result<Body, serde_json::Error> {
    let mut parts = Vec::new();
    for (place, patch) in resultants.patches.iter().enumerate() {
        let before = if place == 0 { "{\"patches\":[" } else { "]}," };
        let load = serde_json::to_string(&patch.normal_force_n)?;
        let number = patch.patch;
        parts.push(Section::Text(format!(
            "{before}{{\"patch\":{number},\"normal_force_n\":{load},\"points\":["
        )));
        parts.extend(ranges(patch.points.len()).map(|range| Section::Points(place, range)));
    }
    let open = if resultants.patches.is_empty() {
        "{\"patches\":["
    } else {
        "]}"
    };
    parts.push(Section::Text(format!("{open}],\"total\":[")));
    parts.extend(ranges(resultants.total.len()).map(Section::Total));
    let origin = serde_json::to_string(&resultants.origin)?;
    parts.push(Section::Text(format!("],\"origin\":{origin}}}")));
    Ok(body(parts.into_iter().map(move |part| match part {
        Section::Text(text) => Ok(text.into_bytes()),
        Section::Points(patch, range) => values(&resultants.patches[patch].points, range),
        Section::Total(range) => values(&resultants.total, range),
    })))
}

/// One line per patch and motion, then one per motion with the sums over all patches.
pub(crate) fn csv_body(resultants: Resultants, sums: Vec<Sum>) -> Body {
    let with_history = sums.first().is_some_and(|sum| sum.history.is_some());
    let head = head(with_history);
    let mut parts = Vec::new();
    for (place, patch) in resultants.patches.iter().enumerate() {
        parts.extend(ranges(patch.points.len()).map(|range| Section::Points(place, range)));
    }
    parts.extend(ranges(resultants.total.len()).map(Section::Total));
    let lines = parts.into_iter().map(move |part| match part {
        Section::Text(text) => Ok(text.into_bytes()),
        Section::Points(patch, range) => patch_lines(&resultants.patches[patch], range),
        Section::Total(range) => total_lines(&resultants, &sums, range),
    });
    body(std::iter::once(head).chain(lines))
}

fn ranges(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count)
        .step_by(POINTS)
        .map(move |start| start..(start + POINTS).min(count))
}

/// Some elements of an array, with a comma before them unless they are the first.
fn values<T: Serialize>(all: &[T], range: Range<usize>) -> Result<Vec<u8>, serde_json::Error> {
    let first = range.start == 0;
    let mut text = serde_json::to_vec(&all[range])?;
    // The bracket before the elements makes way for the comma, that behind them for what follows.
    text.pop();
    match first {
        true => drop(text.drain(..1)),
        false => text[0] = b',',
    }
    Ok(text)
}

/// Before and behind the columns of [`Forces`].
const PLACE: [&str; 2] = ["patch", "point"];
const REST: [&str; 3] = [
    "friction_power_n",
    "friction_power_without_spin_n",
    "saturated",
];

/// Columns of a history, behind all others; other cases do not have them.
const HISTORY: [&str; 9] = [
    "distance_mm",
    "dissipated_n_mm",
    "shift_x_mm",
    "shift_y_mm",
    "turn_rad",
    "creepage_x_error",
    "creepage_y_error",
    "shift_x_error_mm",
    "shift_y_error_mm",
];

fn head(with_history: bool) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let history = if with_history { &HISTORY[..] } else { &[] };
    let columns = PLACE.iter().chain(&Forces::COLUMNS).chain(&REST);
    out.write_record(columns.chain(history))?;
    finish(out)
}

/// The values of the columns of a history.
fn of_history(history: &HistoryPoint) -> [Option<f64>; 9] {
    [
        Some(history.distance_mm),
        Some(history.dissipated_n_mm),
        history.shift_x_mm,
        history.shift_y_mm,
        history.turn_rad,
        history.creepage_x_error,
        history.creepage_y_error,
        history.shift_x_error_mm,
        history.shift_y_error_mm,
    ]
}

fn patch_lines(patch: &PatchResultants, range: Range<usize>) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let number = patch.patch.to_string();
    for point in &patch.points[range] {
        let sum = Sum {
            motion: point.motion,
            normal_force_n: patch.normal_force_n,
            friction_power_n: point.friction_power_n,
            friction_power_without_spin_n: point.friction_power_without_spin_n,
            saturated: point.saturated,
            history: point.history.as_deref().copied(),
        };
        let forces = Forces {
            motion: Some(point.motion),
            resultants: [point.force_x_n, point.force_y_n, point.moment_z_n_mm],
            error: point.error_estimate,
        };
        out.write_record(csv_line(&number, point.point, &sum, &forces))?;
    }
    finish(out)
}

fn total_lines(
    resultants: &Resultants,
    sums: &[Sum],
    range: Range<usize>,
) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    // The numbers of the motions are those of any patch.
    let points = resultants.patches.first().map(|patch| &patch.points[..]);
    for place in range {
        let point = points.and_then(|points| points.get(place));
        if let Some((point, sum)) =
            point.and_then(|point| Some((point.point, sums.get(point.point)?)))
        {
            let forces = Forces::of_total(Some(sum.motion), &resultants.total[place]);
            out.write_record(csv_line("total", point, sum, &forces))?;
        }
    }
    finish(out)
}

fn csv_line(
    patch: &str,
    point: usize,
    sum: &Sum,
    forces: &Forces,
) -> impl IntoIterator<Item = String> {
    let values = Forces::COLUMNS.map(|name| match name {
        "normal_force_n" => number(sum.normal_force_n),
        name => forces.number(name).map_or_else(String::new, number),
    });
    let rest = [
        number(sum.friction_power_n),
        number(sum.friction_power_without_spin_n),
        sum.saturated.to_string(),
    ];
    let place = [patch.to_owned(), point.to_string()];
    let history = sum.history.as_ref().map(of_history);
    let text = |value: Option<f64>| value.map_or_else(String::new, number);
    let history = history.into_iter().flatten().map(text);
    place.into_iter().chain(values).chain(rest).chain(history)
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;
    use serde_json::Value;

    use super::*;
    use crate::contact::case::words::motion::MotionWords;
    use crate::contact::solution::words::answer::{Origin, Total};
    use crate::http::dto::resultants::PointResultants;

    fn resultants(patches: usize, points: usize) -> Resultants {
        let point = |point: usize| PointResultants {
            point,
            motion: MotionWords {
                creepage_x: 0.1,
                creepage_y: 0.0,
                spin_per_mm: 1e-9,
            },
            force_x_n: 1.0 / (1 + point) as f64,
            force_y_n: -0.1,
            moment_z_n_mm: 1e-300,
            error_estimate: None,
            profile_uncertainty: None,
            friction_power_n: 0.0,
            friction_power_without_spin_n: 0.0,
            saturated: false,
            history: None,
        };
        let points: Vec<_> = (0..points).map(point).collect();
        let total = points.iter().map(|point| Total {
            force_x_n: point.force_x_n,
            force_y_n: point.force_y_n,
            force_z_n: None,
            moment_z_n_mm: point.moment_z_n_mm,
            error_estimate: None,
            profile_uncertainty: None,
        });
        let total = total.collect();
        let patch = |patch: usize| PatchResultants {
            patch,
            normal_force_n: 0.1 + patch as f64,
            points: (0..points.len()).map(point).collect(),
        };
        Resultants {
            patches: (0..patches).map(patch).collect(),
            total,
            origin: Origin {
                x_mm: 0.0,
                y_mm: 0.1,
                meaning: "a \"point\"".to_owned(),
            },
        }
    }

    async fn text(body: Body) -> String {
        let bytes = body.collect().await.unwrap().to_bytes();
        String::from_utf8(bytes.to_vec()).unwrap()
    }

    #[tokio::test]
    async fn the_pieces_together_are_the_whole() {
        for (patches, points) in [(0, 0), (1, 1), (2, POINTS), (3, 2 * POINTS + 1)] {
            let whole = serde_json::to_value(resultants(patches, points)).unwrap();
            let pieces = text(json_body(resultants(patches, points)).unwrap()).await;
            assert_eq!(serde_json::from_str::<Value>(&pieces).unwrap(), whole);
            let sum = Sum {
                motion: resultants(1, 1).patches[0].points[0].motion,
                normal_force_n: 1.0,
                friction_power_n: 0.0,
                friction_power_without_spin_n: 0.0,
                saturated: false,
                history: None,
            };
            let table = csv_body(resultants(patches, points), vec![sum; points]);
            let lines = text(table).await.lines().count();
            let totals = if patches == 0 { 0 } else { points };
            assert_eq!(lines, 1 + patches * points + totals);
        }
    }
}
