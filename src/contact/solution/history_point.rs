//! A point of a history in the words of the answer.

use crate::contact::rolling::motion_answer::HistoryAnswer;
use crate::contact::solution::words::answer::HistoryPoint;

impl HistoryPoint {
    /// What a history says of a patch at a point.
    pub(crate) fn of(history: &HistoryAnswer, patch: usize) -> HistoryPoint {
        let [creepage_x_error, creepage_y_error] = history.creepage_errors;
        let [shift_x_error_mm, shift_y_error_mm] = history.shift_errors;
        let rolled = |error: Option<f64>| error.filter(|_| history.shift.is_none());
        let shifted = |error: Option<f64>| error.filter(|_| history.shift.is_some());
        HistoryPoint {
            distance_mm: history.distance,
            shift_x_mm: history.shift.map(|shift| shift.creepage_x),
            shift_y_mm: history.shift.map(|shift| shift.creepage_y),
            turn_rad: history.shift.map(|shift| shift.spin_per_mm),
            creepage_x_error: rolled(creepage_x_error),
            creepage_y_error: rolled(creepage_y_error),
            shift_x_error_mm: shifted(shift_x_error_mm),
            shift_y_error_mm: shifted(shift_y_error_mm),
            dissipated_n_mm: history.dissipated[patch],
        }
    }
}
