//! Feeds `railhead_fuzz::table`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| railhead_fuzz::table(data));
