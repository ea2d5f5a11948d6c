//! The real program on a data folder of its own, and what it uses: memory, descriptors, files, bytes.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// How long the program may take to listen.
const STARTS_WITHIN: Duration = Duration::from_secs(20);

/// Linux tells times of processes in these.
const TICKS_PER_SECOND: f64 = 100.0;

/// A running service; killed when dropped.
pub struct Service {
    child: Child,
    /// Where it listens, without a slash at the end.
    pub url: String,
    data: PathBuf,
    _folder: tempfile::TempDir,
}

/// Resources that the service uses at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Usage {
    /// Resident memory in MB.
    pub memory_mb: f64,
    /// Most resident memory so far in MB.
    pub peak_mb: f64,
    /// Processor time so far in s, of the program and of the kernel for it.
    pub processor_s: f64,
    /// Open descriptors.
    pub descriptors: usize,
    /// Files in the data folder.
    pub files: usize,
    /// Bytes of the data folder in MB.
    pub stored_mb: f64,
}

impl Service {
    /// Starts `railhead serve` and returns when it listens. Its log goes to a file, as on a real machine.
    pub fn start(workers: usize, flags: &[&str]) -> Service {
        Service::start_program(env!("CARGO_BIN_EXE_railhead"), workers, flags)
    }

    /// As [`Service::start`], with another program.
    pub fn start_program(program: &str, workers: usize, flags: &[&str]) -> Service {
        let folder = tempfile::tempdir().expect("a folder");
        let (data, log) = (folder.path().join("data"), folder.path().join("log"));
        let child = Command::new(program)
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

    /// The process.
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
        // Fields 14 and 15, in ticks; the second, a name, may have spaces and ends with a bracket.
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

/// The address that the event `listening` names.
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

/// Number and bytes of the files below a folder; what vanishes meanwhile does not count.
fn below(folder: &Path) -> (usize, u64) {
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
