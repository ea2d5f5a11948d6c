//! What the C library keeps of freed memory: bounded at the start of a process, given back after long tasks.

/// Blocks of at least this size, in bytes, are given back when they are freed. Left alone, glibc raises this limit to 32 MiB with the
/// blocks that it sees freed, and keeps what is below. 400 mixed cases on four workers peak at 351 to 361 MB then, and at 255 to
/// 261 MB with these three numbers, for 7 % more processor time (`cargo bench --bench load -- memory`, two and three runs; 1 MiB instead of the
/// first costs more).
const BLOCK_BYTES: i32 = 4 << 20;
/// Free memory at the end of a heap, in bytes, from which on it is given back.
const FREE_BYTES: i32 = 32 << 20;
/// Environment variables by which an operator sets the same.
const VARIABLES: [&str; 4] = [
    "GLIBC_TUNABLES",
    "MALLOC_ARENA_MAX",
    "MALLOC_MMAP_THRESHOLD_",
    "MALLOC_TRIM_THRESHOLD_",
];

/// Bounds what the process keeps of freed memory, unless the environment says how. Heaps are as many as cores: there would be eight for
/// each. To be called before there are other threads.
#[cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    expect(unsafe_code, reason = "a function of the C library")
)]
pub fn bound_heap() {
    if VARIABLES
        .iter()
        .any(|name| std::env::var_os(name).is_some())
    {
        return;
    }
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let heaps = i32::try_from(cores.max(2)).unwrap_or(i32::MAX);
        // SAFETY: the function takes numbers, and locks what it changes.
        unsafe {
            libc::mallopt(libc::M_ARENA_MAX, heaps);
            libc::mallopt(libc::M_MMAP_THRESHOLD, BLOCK_BYTES);
            libc::mallopt(libc::M_TRIM_THRESHOLD, FREE_BYTES);
        }
    }
}

/// Gives free pages back to the system. glibc keeps what lies between blocks that are still in use: about 100 MB after 900 motions
/// of a creep map, whose operators come and go beside those that are kept.
#[cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    expect(unsafe_code, reason = "a function of the C library")
)]
pub(crate) fn give_memory_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function takes a number, touches free memory only and locks every arena while it does.
    unsafe {
        libc::malloc_trim(0);
    }
}
