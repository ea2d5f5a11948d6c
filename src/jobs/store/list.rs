//! Lists of jobs and batches, newest first, page by page: the filter, the page and the cursor between pages.

use uuid::Uuid;

use crate::jobs::model::job::State;
use crate::jobs::model::kind::Kind;

/// Where the jobs of a list belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Membership {
    /// To this batch.
    Batch(Uuid),
    /// To no batch: each was submitted alone.
    Alone,
}

/// Which work of a kind to list; everything left out does not restrict. Lists of batches and runs know no states, memberships and times of
/// changes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filter {
    /// The kind of the work.
    pub kind: Kind,
    /// Only jobs in one of these states; any if there is none.
    pub states: Vec<State>,
    /// Only jobs of one batch, or of none.
    pub member: Option<Membership>,
    /// Only work that carry each of these labels with its value.
    pub labels: Vec<(String, String)>,
    /// Only work whose name contains this text; ASCII letters match in either case.
    pub name: Option<String>,
    /// Only work submitted at or after this time (epoch milliseconds).
    pub created_after: Option<i64>,
    /// Only work submitted before this time (epoch milliseconds). Together with `created_after`: a half-open window.
    pub created_before: Option<i64>,
    /// Only jobs that changed at or after this time (epoch milliseconds), progress aside.
    pub updated_after: Option<i64>,
}

/// One page of a list. It may have fewer entries than asked for although more follow: where many have to be looked at to find
/// some, a page ends after a bounded number of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Page<T> {
    /// The entries, newest first.
    pub entries: Vec<T>,
    /// Where the next page begins; absent on the last page.
    pub next_cursor: Option<String>,
    /// Number of entries of the whole list.
    pub total: Total,
}

impl<T> Page<T> {
    /// The same page with other entries.
    #[must_use]
    pub fn map<U>(self, entry: impl FnMut(T) -> U) -> Page<U> {
        Page {
            entries: self.entries.into_iter().map(entry).collect(),
            next_cursor: self.next_cursor,
            total: self.total,
        }
    }
}

/// Number of entries of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Total {
    /// So many.
    Exactly(u64),
    /// So many were counted, there may be more.
    AtLeast(u64),
}

/// A job that changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The job.
    pub id: Uuid,
    /// Its batch.
    pub batch: Option<Uuid>,
    /// [`Kind::Case`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// When, epoch milliseconds.
    pub at: i64,
}

impl Filter {
    /// All work of a kind.
    #[must_use]
    pub fn of(kind: Kind) -> Filter {
        Filter {
            kind,
            ..Filter::default()
        }
    }

    /// The cursor that continues this list after the entry `last`: 40 characters of `[0-9a-f]`.
    #[must_use]
    pub fn cursor_after(&self, last: Uuid) -> String {
        format!("{}{}", last.simple(), self.digest())
    }

    /// The entry after which `text` continues; `None` if it is not a cursor of this very filter.
    #[must_use]
    pub fn read_cursor(&self, text: &str) -> Option<Uuid> {
        let (id, digest) = text.split_at_checked(32)?;
        if digest != self.digest() {
            return None;
        }
        let read = Uuid::try_parse(id).ok()?;
        // Only our own spelling is a cursor: the parser would also take capital letters.
        (read.simple().to_string() == id).then_some(read)
    }

    /// Whether jobs themselves have to be read, because no index knows all that is asked for.
    pub(crate) fn reads_jobs(&self) -> bool {
        self.labels.len() > 1
            || self.name.is_some()
            || self.updated_after.is_some()
            || (self.alone() && !self.labels.is_empty())
    }

    /// Whether only jobs of no batch are listed.
    pub(crate) fn alone(&self) -> bool {
        self.member == Some(Membership::Alone)
    }

    /// The batch whose jobs are listed.
    pub(crate) fn batch(&self) -> Option<Uuid> {
        match self.member {
            Some(Membership::Batch(id)) => Some(id),
            Some(Membership::Alone) | None => None,
        }
    }

    /// Smallest id a job of the filter can have: UUIDv7 begins with 48 bits of milliseconds.
    pub(crate) fn id_from(&self) -> Option<Uuid> {
        self.created_after.map(first_id_at)
    }

    /// Smallest id that is too young for the filter.
    pub(crate) fn id_before(&self) -> Option<Uuid> {
        self.created_before.map(first_id_at)
    }

    /// Eight hexadecimal digits of a digest of the filter.
    fn digest(&self) -> String {
        let mut parts = vec![
            Some(self.kind.name().to_owned()),
            self.created_after.map(|time| time.to_string()),
            self.created_before.map(|time| time.to_string()),
            self.updated_after.map(|time| time.to_string()),
            self.member.map(|member| match member {
                Membership::Batch(id) => id.to_string(),
                Membership::Alone => "none".to_owned(),
            }),
            self.name.clone(),
            Some(self.states.len().to_string()),
        ];
        let states = self.states.iter().map(|state| state.name().to_owned());
        let labels = self.labels.iter().flat_map(|(key, value)| [key, value]);
        parts.extend(states.chain(labels.cloned()).map(Some));
        let mut hasher = blake3::Hasher::new();
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
            states: vec![State::Queued],
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
            labels: vec![(key.to_owned(), value.to_owned())],
            ..Filter::default()
        };
        assert_ne!(with("ab", "c").digest(), with("a", "bc").digest());
    }

    #[test]
    fn the_first_id_of_a_millisecond_is_not_above_any_id_of_it() {
        let id = Uuid::now_v7();
        let time = i64::try_from(id.as_u128() >> 80).unwrap();
        assert!(first_id_at(time) <= id && id < first_id_at(time + 1));
        assert!(first_id_at(-5) <= id && id < first_id_at(i64::MAX));
    }
}
