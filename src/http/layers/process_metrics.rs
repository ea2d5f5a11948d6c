//! Metrics of the process itself: memory, open files, start time, and dropped log lines.

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric};
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;

/// Reads the values when the metrics are scraped.
#[derive(Debug)]
pub(crate) struct Process {
    /// How many lines of the log were dropped.
    pub dropped_lines: fn() -> u64,
    /// Start of the process in epoch seconds.
    pub started_at: i64,
}

impl Collector for Process {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), std::fmt::Error> {
        let dropped = ConstCounter::new((self.dropped_lines)());
        let about = "Log lines dropped because nobody read them";
        let metric =
            encoder.encode_descriptor("log_lines_dropped", about, None, dropped.metric_type())?;
        dropped.encode(metric)?;
        let figures = [
            (
                "process_resident_memory_bytes",
                "Memory of the process in bytes",
                resident_bytes(),
            ),
            (
                "process_open_fds",
                "Files and connections that are open",
                open_files(),
            ),
            (
                "process_start_time_seconds",
                "Start of the process, seconds since 1970",
                Some(self.started_at),
            ),
        ];
        for (name, about, value) in figures {
            let Some(value) = value else { continue };
            let gauge = ConstGauge::new(value);
            let metric = encoder.encode_descriptor(name, about, None, gauge.metric_type())?;
            gauge.encode(metric)?;
        }
        Ok(())
    }
}

/// Resident memory; `None` on systems that do not say it this way.
fn resident_bytes() -> Option<i64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: i64 = line.trim().trim_end_matches(" kB").parse().ok()?;
    Some(kilobytes * 1024)
}

fn open_files() -> Option<i64> {
    let files = std::fs::read_dir("/proc/self/fd").ok()?.count();
    i64::try_from(files).ok()
}
