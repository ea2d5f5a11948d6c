//! Checked cases of a batch on their way to the job table: a nameless file, so that a batch of any size needs little
//! memory and leaves nothing behind, however the process ends.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Result, Seek, SeekFrom, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::jobs::disk_reserve::nameless;
use crate::jobs::model::submit_options::CaseOptions;

/// What the job table needs to know of a case besides its text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StagedCase {
    pub(crate) index: u32,
    /// The text is what a row of a table puts into the template.
    pub(crate) row: bool,
    pub(crate) name: Option<String>,
    pub(crate) labels: BTreeMap<String, String>,
    pub(crate) method: String,
    pub(crate) outputs: String,
    pub(crate) cost_us: u32,
    pub(crate) slice_us: u32,
    pub(crate) digest: String,
    pub(crate) own: CaseOptions,
}

/// Staged cases, first in, first out.
#[derive(Debug)]
pub(crate) struct Staging(BufWriter<File>);

impl Staging {
    /// Makes an empty staging file in a folder.
    pub(crate) fn new(folder: &Path) -> Result<Staging> {
        Ok(Staging(BufWriter::with_capacity(
            1 << 18,
            nameless(folder)?,
        )))
    }

    /// Appends a case.
    pub(crate) fn push(&mut self, staged: &StagedCase, case: &[u8]) -> Result<()> {
        for part in [serde_json::to_vec(staged)?.as_slice(), case] {
            self.0.write_all(&(part.len() as u64).to_le_bytes())?;
            self.0.write_all(part)?;
        }
        Ok(())
    }

    /// Ends the writing and reads from the beginning.
    pub(crate) fn into_reader(self) -> Result<StagingReader> {
        let mut file = self.0.into_inner()?;
        file.seek(SeekFrom::Start(0))?;
        Ok(StagingReader(BufReader::with_capacity(1 << 18, file)))
    }
}

/// A staging file that is being read.
#[derive(Debug)]
pub(crate) struct StagingReader(BufReader<File>);

impl StagingReader {
    /// The next cases: at most `jobs`, and no further one once `bytes` are reached.
    pub(crate) fn take(&mut self, jobs: usize, bytes: usize) -> Result<Vec<(StagedCase, Vec<u8>)>> {
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

    fn part(&mut self) -> Result<Option<Vec<u8>>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_comes_out_in_order_and_no_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let mut staging = Staging::new(folder.path()).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let staged = |index| StagedCase {
            index,
            row: false,
            name: Some("a\nb".to_owned()),
            labels: BTreeMap::new(),
            method: "auto".to_owned(),
            outputs: "[]".to_owned(),
            cost_us: 7,
            slice_us: 7,
            digest: "d".to_owned(),
            own: CaseOptions::default(),
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
}
