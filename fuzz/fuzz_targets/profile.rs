//! Feeds `railhead_fuzz::profile`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| railhead_fuzz::profile(data));
