//! Promise: query after query in flight over three slots, results stay those of the CPU and memory stays flat.
//!
//! `cargo run --release --example soak -- 100000` does the same for longer.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;
#[path = "../../examples/soak.rs"]
#[allow(dead_code, reason = "the example has a main")]
mod soak;

use common::{baked::embedded, desc, memory::alone};
use sabaki_fixtures::headless::HeadlessDesc;

/// The pages of a process are those of all tests that run in it.
#[test]
fn memory_stays_flat() {
    alone(soak_alone);
}

fn soak_alone() {
    let silent = HeadlessDesc {
        validation: false,
        ..desc()
    };
    let soaked = soak::soak(embedded(), 1_500, &silent);
    println!("{soaked:?}");
    assert_eq!(soaked.queries, 1_500);
    let [early, late] = soaked.blocks;
    assert!(early == late && late > 0);
    let [early, late] = soaked.resident;
    // 1,350 queries that kept a single page each would be more.
    assert!(late < early + (4 << 20), "{early} to {late} bytes");
}

#[test]
fn validation_is_silent_all_along() {
    let soaked = soak::soak(embedded(), 200, &desc());
    assert_eq!(soaked.queries, 200);
}
