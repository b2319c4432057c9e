//! The target that has the name of the program.
#![no_main]
#![allow(missing_docs)]

#[path = "../targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::of_name(env!("CARGO_BIN_NAME"))(bytes));
