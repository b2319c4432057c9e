//! `sabaki bake submit`: hands all steps of a plan to a queue.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use sabaki::archive::write_atomically;
use serde_json::json;

use super::super::{Done, Failure};
use super::shared_bake::{SharedBake, quoted};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan. All nodes must see it under the same path.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Graph file that the join writes.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Submits to Slurm: an array job whose indices are the shards, the graph, an array job that tests its entries, and the join. Each
    /// waits for the one before.
    #[arg(long, required = true)]
    slurm: bool,
    /// Prints the script instead of running it.
    #[arg(long)]
    print: bool,
    /// Options of `sbatch` for both jobs, after --, for example the partition or the memory.
    #[arg(last = true, value_name = "OPTION")]
    options: Vec<String>,
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let bake = SharedBake::open(&args.folder)?;
    let script = script(args, bake.shards())?;
    if args.print {
        return Ok(Done::ok(match as_json {
            true => Done::json(&json!({ "script": script })),
            false => script,
        }));
    }
    let logs = args.folder.join("logs");
    std::fs::create_dir_all(&logs).map_err(|source| Failure::Write { path: logs, source })?;
    let path = args.folder.join("submit.sh");
    write_atomically(&path, |file| file.write_all(script.as_bytes())).map_err(|source| {
        Failure::Write {
            path: path.clone(),
            source,
        }
    })?;
    let ran = Command::new("sh")
        .arg(&path)
        .output()
        .map_err(|error| Failure::Usage(format!("cannot run sh: {error}")))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if !ran.status.success() {
        return Err(Failure::Usage(format!(
            "{}: {}",
            path.display(),
            text(&ran.stderr)
        )));
    }
    let jobs = text(&ran.stdout);
    let names: Vec<&str> = jobs.split_whitespace().collect();
    let [shards, graph, entries, join] = names[..] else {
        return Err(Failure::Usage(format!("sbatch said: {jobs}")));
    };
    Ok(Done::ok(match as_json {
        true => Done::json(&json!({
            "shards_job": shards, "graph_job": graph, "entries_job": entries, "join_job": join, "script": path.display().to_string(),
        })),
        false => format!(
            "job {shards}: {count} shards; job {graph}: the graph; job {entries}: its entries in {count} shares; job {join}: the join, which writes {}\n",
            args.out.display(),
            count = bake.shards(),
        ),
    }))
}

/// A path as text of a script.
fn in_script(path: &Path) -> Result<String, Failure> {
    let refused = || {
        let what = "this name is not UTF-8, and the script cannot hold it";
        Failure::Usage(format!("{}: {what}", path.display()))
    };
    path.to_str().map(str::to_owned).ok_or_else(refused)
}

/// The script that submits all jobs and prints their numbers.
fn script(args: &Args, shards: usize) -> Result<String, Failure> {
    let absolute = |path: &Path| {
        let found = std::path::absolute(path).map_err(|source| Failure::Open {
            path: path.to_owned(),
            source,
        })?;
        in_script(&found)
    };
    let program = std::env::current_exe()
        .map_err(|error| Failure::Usage(format!("the path of this program is unknown: {error}")))?;
    let program = quoted(&in_script(&program)?);
    let folder = absolute(&args.folder)?;
    let out = quoted(&absolute(&args.out)?);
    let log = |name: &str| quoted(&format!("{folder}/logs/{name}"));
    let [shard_log, graph_log, entries_log, join_log] =
        ["shard-%a", "graph", "entries-%a", "join"].map(log);
    let folder = quoted(&folder);
    let options: String = args
        .options
        .iter()
        .map(|option| format!(" {}", quoted(option)))
        .collect();
    let last = shards - 1;
    Ok(format!(
        r#"#!/bin/sh
# Submits all steps of a plan of sabaki to Slurm: the shards as an array job, the graph, its entries as an array job, and the join. Each
# waits for the one before.
set -eu
after() {{
    echo "--dependency=afterok:$1 --kill-on-invalid-dep=yes"
}}
shards=$(sbatch --parsable --job-name=sabaki-shards --array=0-{last} --requeue --output={shard_log} --open-mode=append{options} <<'END'
#!/bin/sh
exec {program} bake shard {folder} "$SLURM_ARRAY_TASK_ID" --threads "${{SLURM_CPUS_PER_TASK:-1}}"
END
)
shards=${{shards%%;*}}
graph=$(sbatch --parsable --job-name=sabaki-graph $(after "$shards") --requeue --output={graph_log} --open-mode=append{options} <<'END'
#!/bin/sh
exec {program} bake graph {folder}
END
)
graph=${{graph%%;*}}
entries=$(sbatch --parsable --job-name=sabaki-entries $(after "$graph") --array=0-{last} --requeue --output={entries_log} --open-mode=append{options} <<'END'
#!/bin/sh
exec {program} bake entries {folder} "$SLURM_ARRAY_TASK_ID" --threads "${{SLURM_CPUS_PER_TASK:-1}}"
END
)
entries=${{entries%%;*}}
join=$(sbatch --parsable --job-name=sabaki-join $(after "$entries") --requeue --output={join_log}{options} <<'END'
#!/bin/sh
exec {program} bake join {folder} --out {out}
END
)
echo "$shards $graph $entries ${{join%%;*}}"
"#
    ))
}
