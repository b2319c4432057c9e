//! Promise: the committed shader table says what the committed SPIR-V says, which naga finds valid.
//!
//! `SABAKI_WRITE_SPIRV=1 cargo test shader_table` writes the tables again.

use std::fs;
use std::path::{Path, PathBuf};

use sabaki_fixtures::shader_table::{is_current, table};

fn shaders() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

#[test]
fn the_shader_table_is_that_of_the_spirv() {
    is_current(&shaders());
}

/// What naga refuses is not written into a table.
#[test]
#[should_panic(expected = "count.comp: ")]
fn damaged_spirv_is_refused() {
    let target = tempfile::tempdir().unwrap();
    let name = "count.comp.spv";
    let mut bytes = fs::read(shaders().join("spirv").join(name)).unwrap();
    bytes.truncate(bytes.len() / 2);
    fs::write(target.path().join(name), bytes).unwrap();
    table(target.path());
}
