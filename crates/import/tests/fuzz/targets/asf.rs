#![no_main]
#![allow(missing_docs)]

#[path = "../../targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::asf_file(bytes));
