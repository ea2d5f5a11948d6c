//! Tests the real program when one of its solver threads stops responding. A tracer stops the thread, as a debugger does.

use std::path::PathBuf;
use std::sync::mpsc;

use nix::sys::ptrace::{self, Options};
use nix::sys::wait::{WaitPidFlag, waitpid};
use nix::unistd::Pid;

use crate::support::{Service, endless_case};

#[tokio::test(flavor = "multi_thread")]
async fn a_process_with_more_deaf_solvers_than_allowed_ends_to_be_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--workers", "1", "--abandoned-max", "0"];
    let service = Service::start(folder.path(), &flags);
    let id = service.submit(&endless_case("deaf")).await;
    service.until(&id, "running").await;
    let holder = hold(service.id(), "solver-0");
    service.cancel(&id).await;
    let ended = tokio::task::spawn_blocking(move || service.wait());
    let ended = ended.await.unwrap();
    holder.join().unwrap();
    assert_eq!(ended.code(), Some(75), "{ended}");

    // No repair is needed, and a new process serves the data folder.
    let service = Service::start(folder.path(), &flags);
    service.until(&id, "cancelled").await;
}

/// Stops a thread of a process until the process ends. Returns after the thread has stopped.
fn hold(process: u32, name: &str) -> std::thread::JoinHandle<()> {
    let thread = thread_named(process, name);
    let (held, is_held) = mpsc::channel();
    // A thread stays stopped by its tracer until the tracer ends.
    let holder = std::thread::spawn(move || {
        ptrace::seize(thread, Options::empty()).expect("a thread that may be traced");
        let all = Some(WaitPidFlag::__WALL);
        loop {
            ptrace::interrupt(thread).expect("a thread that is traced");
            waitpid(thread, all).expect("a thread that stands still");
            if !is_in_libc(process, thread) {
                break;
            }
            ptrace::cont(thread, None).expect("a thread that goes on");
        }
        held.send(()).expect("a test that waits");
        // Reports the end of the thread, without which the end of its process is not reported.
        while waitpid(thread, all).is_ok_and(|status| status.pid().is_some() && !ended(status)) {}
    });
    is_held.recv().expect("a thread that is held");
    holder
}

/// Returns whether a stopped thread is in the C library. There it may hold the lock of the allocator, which all other threads need.
fn is_in_libc(process: u32, thread: Pid) -> bool {
    let folder = PathBuf::from(format!("/proc/{process}"));
    let state = std::fs::read_to_string(folder.join(format!("task/{thread}/syscall"))).unwrap();
    let place = state.split_whitespace().last().unwrap();
    let number = |text: &str| u64::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
    let maps = std::fs::read_to_string(folder.join("maps")).unwrap();
    let mut of_libc = maps.lines().filter(|line| line.contains("/libc"));
    of_libc.any(|line| {
        let (range, _) = line.split_once(' ').unwrap();
        let (first, end) = range.split_once('-').unwrap();
        (number(first)..number(end)).contains(&number(place))
    })
}

fn ended(status: nix::sys::wait::WaitStatus) -> bool {
    use nix::sys::wait::WaitStatus::{Exited, Signaled};
    matches!(status, Exited(..) | Signaled(..))
}

fn thread_named(process: u32, name: &str) -> Pid {
    let folder = PathBuf::from(format!("/proc/{process}/task"));
    let threads = std::fs::read_dir(folder).expect("a process");
    let mut threads = threads.map(|thread| thread.expect("a thread").path());
    let found = threads.find(|thread| {
        std::fs::read_to_string(thread.join("comm")).is_ok_and(|text| text.trim_end() == name)
    });
    let found = found.unwrap_or_else(|| panic!("no thread is called {name}"));
    let id = found.file_name().and_then(|id| id.to_str()).expect("an id");
    Pid::from_raw(id.parse().expect("a number"))
}
