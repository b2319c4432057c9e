//! Writes the graph that damage to baked files starts from: `cargo run --example seed -- FOLDER`.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../targets.rs"]
mod targets;

fn main() {
    let folder = std::env::args().nth(1).unwrap();
    let bytes = sabaki::archive::to_bytes(sabaki_fixtures::small::small()).unwrap();
    let path = std::path::Path::new(&folder).join("small");
    std::fs::write(path, targets::without_header(&bytes)).unwrap();
}
