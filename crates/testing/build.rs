//! Gives each build of the sources a file of its own for what its tests bake of the embedded motions.
use std::path::Path;
use std::time::SystemTime;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    for sources in ["../../src", "../app/src/demo", "../../Cargo.lock"] {
        println!("cargo::rerun-if-changed={sources}");
    }
    let folder = env::var("OUT_DIR").map_err(io::Error::other)?;
    for file in fs::read_dir(&folder)? {
        fs::remove_file(file?.path())?;
    }
    // Tests of an older build may still run, and write.
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let built = now.map_err(io::Error::other)?.as_nanos();
    let file = Path::new(&folder).join(format!("embedded-{built}.sabaki"));
    println!("cargo::rustc-env=SABAKI_EMBEDDED={}", file.display());
    Ok(())
}
