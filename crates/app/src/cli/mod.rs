//! The command line: one file for each subcommand, and what they share.

mod annotate;
mod bake;
mod cancel;
mod compare;
mod coverage;
mod crowd;
mod culling;
mod demo;
mod doctor;
mod dodge;
mod duel;
mod explain;
mod export;
mod figure;
mod inspect;
mod lod;
mod mesh;
mod numbers;
mod output;
mod play;
mod plot;
mod quality;
mod queries;
mod render;
mod sheet;
mod summary;
#[cfg(feature = "window")]
mod view;

use std::process::ExitCode;

use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};

pub(crate) use output::{Done, Failure};

/// Characters that dodge: avoidance on motion graphs, culled on the GPU or the CPU.
///
/// Without a subcommand it runs a demo: it bakes the embedded motions, throws balls at a character,
/// avoids them, and writes a picture, a BVH file and a JSON file to out/.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 ok, 1 the answer is no, 2 bad input or usage, 3 done without some of the files (--keep-going), 130 stopped by Ctrl-C."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Prints one JSON document instead of tables.
    #[arg(long, global = true, help_heading = "General")]
    json: bool,
    /// Logs to stderr: -v steps, -vv details.
    #[arg(short, long, global = true, help_heading = "General", action = clap::ArgAction::Count)]
    verbose: u8,
    /// Options of the demo.
    #[command(flatten)]
    device: culling::DeviceArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Bakes clips to a graph file and prints its statistics.
    Bake(Box<bake::Args>),
    /// Proposes the events of clips: attacks and evasions, for `bake --events`.
    Annotate(annotate::Args),
    /// Throws attacks at a character and answers them.
    Dodge(Box<dodge::Args>),
    /// Compares all culling paths, with and without the grid, on the same attacks.
    Compare(compare::Args),
    /// Measures which attacks are avoided by direction, height and lead, and finds the gaps.
    Coverage(coverage::Args),
    /// Analyses levels of detail: joint energies, errors, and the distances at which levels are drawn.
    Lod(Box<lod::Args>),
    /// Measures the time to pose a crowd, with and without levels of detail, by instruction set and threads.
    Crowd(crowd::Args),
    /// Lets two characters of one graph attack and avoid in turn.
    Duel(duel::FightArgs),
    /// Runs a game without a window and measures how characters are steered, stand idle and avoid threats.
    Play(play::Args),
    /// Draws a scene to a picture (.png) or a film (.gif, .apng), without a window.
    Render(render::Args),
    /// Opens a window with a scene.
    #[cfg(feature = "window")]
    View(view::Args),
    /// Describes a file: motion (BVH, AMC, glTF, FBX), baked graph, events or attacks.
    Inspect(inspect::Args),
    /// Reports the machine's Vulkan devices and the culling paths that they support.
    Doctor(doctor::Args),
}

/// Runs the command and returns its exit code.
pub(crate) fn main() -> ExitCode {
    let cli = match Cli::try_parse_numbers() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are not errors; clap chooses the stream and the exit code.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    start_log(cli.verbose);
    match cli.run().and_then(Done::print) {
        Ok(code) => code,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Lets each option take negative numbers, so that what refuses one is the option's own range.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes_value = |arg: &clap::Arg| !arg.is_positional() && arg.get_action().takes_values();
    command
        .mut_args(|arg| match takes_value(&arg) {
            true => arg.allow_negative_numbers(true),
            false => arg,
        })
        .mut_subcommands(with_negative_numbers)
}

impl Cli {
    /// Reads the arguments of this process.
    fn try_parse_numbers() -> Result<Self, clap::Error> {
        let mut command = with_negative_numbers(Self::command());
        let matches: ArgMatches = command.try_get_matches_from_mut(std::env::args_os())?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
    }

    fn run(self) -> Result<Done, Failure> {
        let json = self.json;
        let Some(command) = self.command else {
            return demo::run(&self.device, json);
        };
        if self.device.is_given() {
            let what = "--device and --validation stand behind the subcommand that uses a device";
            return Err(Failure::Usage(what.to_owned()));
        }
        match command {
            Command::Bake(args) => bake::run(&args, json),
            Command::Annotate(args) => annotate::run(&args, json),
            Command::Dodge(args) => dodge::run(&args, json),
            Command::Compare(args) => compare::run(&args, json),
            Command::Coverage(args) => coverage::run(&args, json),
            Command::Lod(args) => lod::run(&args, json),
            Command::Crowd(args) => crowd::run(&args, json),
            Command::Duel(args) => duel::run(&args, json),
            Command::Play(args) => play::run(&args, json),
            Command::Render(args) => render::run(&args, json),
            #[cfg(feature = "window")]
            Command::View(args) => view::run(&args, json),
            Command::Inspect(args) => inspect::run(&args, json),
            Command::Doctor(args) => doctor::run(&args, json),
        }
    }
}

fn start_log(verbose: u8) {
    let level = match verbose {
        0 => tracing::Level::WARN,
        1 => tracing::Level::INFO,
        _ => tracing::Level::DEBUG,
    };
    use tracing_subscriber::layer::SubscriberExt;
    use tracing_subscriber::util::SubscriberInitExt;
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .without_time();
    // Warnings of the window system are shown only with -v.
    let others = match verbose {
        0 => tracing::Level::ERROR,
        _ => level,
    };
    let heard = tracing_subscriber::filter::Targets::new()
        .with_default(level)
        .with_targets([("winit", others), ("egui", others)]);
    tracing_subscriber::registry()
        .with(lines)
        .with(heard)
        .init();
}
