//! The real program on a separate data folder, and its use of memory, descriptors, files and disk space.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Maximum time until the program listens.
const STARTS_WITHIN: Duration = Duration::from_secs(20);

/// Unit in which Linux gives process times.
const TICKS_PER_SECOND: f64 = 100.0;

/// A running service, which is killed on drop.
pub struct Service {
    child: Child,
    /// URL on which it listens, without a trailing slash.
    pub url: String,
    /// Its data folder.
    pub data: PathBuf,
    _folder: TempDir,
}

/// Resources in use at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Usage {
    /// Resident memory in MB.
    pub memory_mb: f64,
    /// Peak resident memory so far in MB.
    pub peak_mb: f64,
    /// Processor time so far in s, in user and kernel mode.
    pub processor_s: f64,
    /// Open descriptors.
    pub descriptors: usize,
    /// Files in the data folder.
    pub files: usize,
    /// Size of the data folder in MB.
    pub stored_mb: f64,
}

impl Service {
    /// Starts `railhead serve` on a new data folder and returns when it listens.
    pub fn start(workers: usize, flags: &[&str]) -> Service {
        let folder = tempfile::tempdir().expect("a folder");
        let data = folder.path().join("data");
        Service::start_on(railhead(), (folder, data), workers, flags)
    }

    /// Starts a program on a data folder. Its log goes to a file in the first folder, as in production.
    pub fn start_on(
        mut program: Command,
        (folder, data): (TempDir, PathBuf),
        workers: usize,
        flags: &[&str],
    ) -> Service {
        let log = folder.path().join("log");
        let child = program
            .args(["serve", "--listen", "127.0.0.1:0", "--log-format", "json"])
            .args(["--workers", &workers.to_string(), "--data-dir"])
            .arg(&data)
            .args(flags)
            .stderr(Stdio::from(File::create(&log).expect("a log")))
            .spawn()
            .expect("a service");
        let address = listening(&log);
        Service {
            child,
            url: format!("http://{address}"),
            data,
            _folder: folder,
        }
    }

    /// Returns the process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Returns the resources in use now.
    pub fn usage(&self) -> Usage {
        let process = PathBuf::from(format!("/proc/{}", self.pid()));
        let status = std::fs::read_to_string(process.join("status")).expect("the process lives");
        let megabytes = |name: &str| {
            status
                .lines()
                .find_map(|line| line.strip_prefix(name)?.trim().strip_suffix(" kB"))
                .and_then(|text| text.trim().parse::<f64>().ok())
                .expect("its resident memory")
                / 1024.0
        };
        let stat = std::fs::read_to_string(process.join("stat")).expect("the process lives");
        // Fields 14 and 15, in ticks. The second field, a name, may contain spaces and ends with a parenthesis.
        let ticks = stat.rsplit(')').next().expect("its fields").split(' ');
        let processor = ticks.skip(12).take(2).map(str::parse::<f64>);
        let descriptors = std::fs::read_dir(process.join("fd")).expect("its descriptors");
        let (files, bytes) = below(&self.data);
        Usage {
            memory_mb: megabytes("VmRSS:"),
            peak_mb: megabytes("VmHWM:"),
            processor_s: processor.sum::<Result<f64, _>>().expect("ticks") / TICKS_PER_SECOND,
            descriptors: descriptors.count(),
            files,
            stored_mb: bytes as f64 / 1e6,
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the real program without the variables `RAILHEAD_…` of the environment.
pub fn railhead() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_railhead"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("RAILHEAD_")) {
        command.env_remove(name);
    }
    command
}

/// Returns the address in the log event `listening`.
fn listening(log: &Path) -> String {
    let start = Instant::now();
    while start.elapsed() < STARTS_WITHIN {
        let text = std::fs::read_to_string(log).expect("the log");
        let event = text
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok())
            .find(|event| event["message"] == "listening");
        if let Some(address) = event.as_ref().and_then(|event| event["address"].as_str()) {
            return address.to_owned();
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!(
        "the service does not listen: {}",
        std::fs::read_to_string(log).unwrap_or_default()
    );
}

/// Returns the number and the bytes of the files below a folder. Files that vanish meanwhile do not count.
pub fn below(folder: &Path) -> (usize, u64) {
    let (mut files, mut bytes) = (0, 0);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(kind) = entry.metadata() else { continue };
        if kind.is_dir() {
            let (more, size) = below(&entry.path());
            files += more;
            bytes += size;
        } else {
            files += 1;
            bytes += kind.len();
        }
    }
    (files, bytes)
}
