//! Rows answered at once, without a job.

use std::collections::{BTreeMap, HashMap};

use serde_json::Value;
use tokio::runtime::Handle;

use crate::contact::error::CaseError;
use crate::contact::evaluate::answer::RowsAnswer;
use crate::contact::evaluate::many::{ManyTask, NotAtOnce, evaluate_at_once};
use crate::contact::evaluate::varied::{Values, VariedColumn, column_pointer};
use crate::contact::monitor::Monitor;
use crate::contact::problem::checked_case::CheckedCase;
use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::profiles::unknown;

impl Jobs {
    /// The stored profiles that columns name. Blocks.
    ///
    /// # Errors
    /// The tenant has no such profile, or a failed database.
    pub fn profiles_of(
        &self,
        columns: &[VariedColumn],
    ) -> Result<BTreeMap<String, Value>, JobsError> {
        let mut known = HashMap::new();
        for column in columns {
            let Values::Texts(names) = &column.values else {
                continue;
            };
            if !column.pointer.ends_with("/profile") {
                continue;
            }
            for (row, name) in names.iter().enumerate() {
                let Some(name) = name else { continue };
                let found = Handle::current().block_on(self.known_section(name, &mut known))?;
                if found.is_none() {
                    let pointer = format!("{}/{row}", column_pointer(&column.pointer));
                    return Err(CaseError(vec![unknown(pointer, name)]).into());
                }
            }
        }
        Ok(known.into_iter().collect())
    }

    /// Answers rows at once, without a job, on this thread, which may block. `checked` is the checked case of the first row, `case`.
    ///
    /// # Errors
    /// The rows exceed what one evaluation may take, or it was ended by the monitor or by `step`.
    pub fn evaluate<E>(
        &self,
        (case, checked): (&Value, &CheckedCase),
        columns: &[VariedColumn],
        profiles: &BTreeMap<String, Value>,
        monitor: &dyn Monitor,
        step: impl FnMut() -> Result<(), E>,
    ) -> Result<RowsAnswer, NotAtOnce<E>> {
        let options = &self.shared.options;
        let task = ManyTask {
            case,
            columns,
            profiles,
            known: self.known_pairs(),
            limits: &options.limits,
            time_limit: options.time_limit,
        };
        let solve = |checked: &CheckedCase, monitor: &dyn Monitor| {
            self.shared.engine.solve_whole(checked, monitor)
        };
        evaluate_at_once(&task, checked, &solve, monitor, step)
    }
}
