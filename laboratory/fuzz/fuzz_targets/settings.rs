#![no_main]

#[path = "../../../wire/tests/robustness/targets.rs"]
#[allow(dead_code)]
mod targets;

libfuzzer_sys::fuzz_target!(|data: &[u8]| targets::settings(data));
