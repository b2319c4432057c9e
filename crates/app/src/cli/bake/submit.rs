//! `sabaki bake submit`: hands all steps of a plan to Slurm.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::json;

use super::super::{Done, Failure};
use super::shared::{SharedBake, quoted};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan. All nodes must see it under the same path.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Graph file that the join writes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Submits to Slurm: an array job whose indices are the shards, which search; the graph; an array job that tests its entries; and the
    /// join. Each waits for the one before.
    #[arg(long, required = true)]
    slurm: bool,
    /// Prints the commands instead of running them.
    #[arg(long)]
    print: bool,
    /// Options of `sbatch` for all jobs, after --, for example the partition or the memory.
    #[arg(last = true, value_name = "OPTION")]
    options: Vec<String>,
}

/// Names of the jobs, in order.
const JOBS: [&str; 4] = ["search", "graph", "entries", "join"];

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let shards = SharedBake::open(&args.folder)?.plan.shards;
    let (folder, out) = (absolute(&args.folder)?, absolute(&args.out)?);
    let program = std::env::current_exe()
        .map_err(|error| Failure::Usage(format!("the path of this program is unknown: {error}")))?;
    let step = format!("exec {} bake", quoted(&absolute(&program)?));
    let place = quoted(&folder);
    let of_shard = |shard: &str| {
        format!("{step} shard {place} {shard} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"")
    };
    let each = of_shard("\"$SLURM_ARRAY_TASK_ID\"");
    let join = format!("{step} join {place} --out {}", quoted(&out));
    let works = [each.clone(), of_shard("0"), each, join];
    let mut jobs: Vec<String> = Vec::new();
    let mut printed = String::new();
    for (name, work) in JOBS.into_iter().zip(works) {
        let is_array = ["search", "entries"].contains(&name);
        let log = if is_array { "-%a" } else { "" };
        let mut words = vec![
            "--parsable".to_owned(),
            format!("--job-name=sabaki-{name}"),
            "--requeue".to_owned(),
            "--open-mode=append".to_owned(),
            format!("--output={folder}/logs/{name}{log}"),
        ];
        if is_array {
            words.push(format!("--array=0-{}", shards - 1));
        }
        if let Some(before) = jobs.last() {
            words.push(format!("--dependency=afterok:{before}"));
            words.push("--kill-on-invalid-dep=yes".to_owned());
        }
        words.extend_from_slice(&args.options);
        words.push(format!("--wrap={work}"));
        if args.print {
            let line: Vec<String> = words.iter().map(|word| quoted(word)).collect();
            printed += &format!("sbatch {}\n", line.join(" "));
            jobs.push(format!("JOB_OF_{}", name.to_uppercase()));
        } else {
            jobs.push(submitted(&args.folder, &words)?);
        }
    }
    Ok(Done::ok(match (args.print, as_json) {
        (true, true) => Done::json(&json!({ "script": printed })),
        (true, false) => printed,
        (false, true) => {
            let jobs: Vec<_> = JOBS.into_iter().zip(jobs).collect();
            Done::json(&json!({ "jobs": jobs }))
        }
        (false, false) => format!(
            "jobs {}: {shards} shards, the graph, its entries, and the join, which writes {out}\n",
            jobs.join(", ")
        ),
    }))
}

/// Submits a job, and returns its number.
fn submitted(folder: &Path, words: &[String]) -> Result<String, Failure> {
    let logs = folder.join("logs");
    std::fs::create_dir_all(&logs).map_err(Failure::file(&logs))?;
    let ran = Command::new("sbatch").args(words).output();
    let ran = ran.map_err(|error| Failure::Usage(format!("cannot run sbatch: {error}")))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if !ran.status.success() {
        return Err(Failure::Usage(format!("sbatch: {}", text(&ran.stderr))));
    }
    // A cluster's name may follow the number.
    let job = text(&ran.stdout);
    Ok(job.split(';').next().unwrap_or_default().to_owned())
}

/// An absolute path, as text of a job.
fn absolute(path: &Path) -> Result<String, Failure> {
    let found = std::path::absolute(path).map_err(Failure::file(path))?;
    let refused = || {
        let what = "this name is not UTF-8, and a job cannot hold it";
        Failure::Usage(format!("{}: {what}", path.display()))
    };
    found.to_str().map(str::to_owned).ok_or_else(refused)
}
