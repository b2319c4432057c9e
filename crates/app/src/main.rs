//! The command `sabaki`.

use std::process::ExitCode;

mod cli;

fn main() -> ExitCode {
    cli::main()
}
