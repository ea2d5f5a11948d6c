//! Feeds `railhead_fuzz::batch`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| railhead_fuzz::batch(data));
