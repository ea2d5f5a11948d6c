//! Feeds `railhead_fuzz::case`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| railhead_fuzz::case(data));
