//! The command `sabaki`.

use std::process::ExitCode;

mod cli;
mod measure;

fn main() -> ExitCode {
    cli::main()
}
