//! Lists of jobs, newest first, page by page: the filter, the page and the cursor between pages.

use uuid::Uuid;

use crate::jobs::model::{Job, State};

/// Which jobs to list; everything left out does not restrict.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// Only jobs in this state.
    pub state: Option<State>,
    /// Only jobs of this batch.
    pub batch: Option<Uuid>,
    /// Only jobs that carry this label with this value.
    pub label: Option<(String, String)>,
    /// Only jobs submitted at or after this time (epoch milliseconds).
    pub created_after: Option<i64>,
    /// Only jobs submitted before this time (epoch milliseconds). Together with `created_after`: a half-open window.
    pub created_before: Option<i64>,
}

/// One page of a list.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// The jobs, newest first.
    pub jobs: Vec<Job>,
    /// Where the next page begins; absent on the last page.
    pub next_cursor: Option<String>,
}

impl Filter {
    /// The cursor that continues this list after the job `last`: 40 characters of `[0-9a-f]`.
    #[must_use]
    pub fn cursor_after(&self, last: Uuid) -> String {
        format!("{}{}", last.simple(), self.change_tag())
    }

    /// The job after which `cursor` continues; `None` if it is not a cursor of this very filter.
    #[must_use]
    pub fn read_cursor(&self, cursor: &str) -> Option<Uuid> {
        let (id, mark) = cursor.split_at_checked(32)?;
        if mark != self.change_tag() {
            return None;
        }
        let id = Uuid::try_parse(id).ok()?;
        // Only our own spelling is a cursor: the parser would also take capital letters.
        (id.simple().to_string() == cursor[..32]).then_some(id)
    }

    /// Smallest id a job of the filter can have: UUIDv7 begins with 48 bits of milliseconds.
    pub(crate) fn id_from(&self) -> Option<Uuid> {
        self.created_after.map(first_id_at)
    }

    /// Smallest id that is too young for the filter.
    pub(crate) fn id_before(&self) -> Option<Uuid> {
        self.created_before.map(first_id_at)
    }

    /// Eight hexadecimal digits that tell one filter from another.
    fn change_tag(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let parts = [
            self.state.map(|state| state.name().to_owned()),
            self.label.as_ref().map(|(key, _)| key.clone()),
            self.label.as_ref().map(|(_, value)| value.clone()),
            self.created_after.map(|time| time.to_string()),
            self.created_before.map(|time| time.to_string()),
            self.batch.map(|batch| batch.to_string()),
        ];
        for part in parts {
            // Length first, so that neighbouring parts cannot run into each other.
            let part = part.map_or_else(|| "-".to_owned(), |text| format!("+{text}"));
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
        hasher.finalize().to_hex()[..8].to_owned()
    }
}

/// The smallest UUID whose leading 48 bits are the given time; times outside 48 bits are clamped.
pub(crate) fn first_id_at(epoch_ms: i64) -> Uuid {
    let millis = u128::try_from(epoch_ms.clamp(0, (1 << 48) - 1)).unwrap_or(0);
    Uuid::from_u128(millis << 80)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_leads_back_to_its_job_and_to_no_other_filter() {
        let filter = Filter {
            state: Some(State::Queued),
            ..Filter::default()
        };
        let id = Uuid::now_v7();
        let cursor = filter.cursor_after(id);
        assert!(cursor.chars().all(|c| c.is_ascii_alphanumeric()));
        assert_eq!(filter.read_cursor(&cursor), Some(id));
        assert_eq!(Filter::default().read_cursor(&cursor), None);
        for wrong in [
            "",
            "é",
            &cursor[1..],
            &cursor.to_uppercase(),
            &format!("{cursor}0"),
        ] {
            assert_eq!(filter.read_cursor(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn parts_of_a_filter_do_not_run_into_each_other() {
        let with = |key: &str, value: &str| Filter {
            label: Some((key.to_owned(), value.to_owned())),
            ..Filter::default()
        };
        assert_ne!(with("ab", "c").change_tag(), with("a", "bc").change_tag());
    }

    #[test]
    fn the_first_id_of_a_millisecond_is_not_above_any_id_of_it() {
        let id = Uuid::now_v7();
        let time = i64::try_from(id.as_u128() >> 80).unwrap();
        assert!(first_id_at(time) <= id && id < first_id_at(time + 1));
        assert!(first_id_at(-5) <= id && id < first_id_at(i64::MAX));
    }
}
