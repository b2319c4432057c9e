//! `sabaki compare --gpu-passes`: time of each pass on the device.

use serde_json::{Value, json};

use super::culling::PathTimes;
use super::output;

/// Milliseconds of a pass for one cull, in the mean.
fn milliseconds(times: &PathTimes) -> impl Iterator<Item = (&'static str, f64)> {
    let culls = times.culls.max(1) as f64;
    let pass =
        move |pass: &sabaki::gpu::PassTime| (pass.name, pass.time.as_secs_f64() * 1e3 / culls);
    times.passes.iter().map(pass)
}

pub(crate) fn to_json(paths: &[PathTimes]) -> Value {
    let path = |times: &PathTimes| {
        let passes = milliseconds(times).map(|(pass, ms)| json!({ "pass": pass, "ms": ms }));
        json!({
            "cull": times.path.name(),
            "culls": times.culls,
            "passes": passes.collect::<Vec<_>>(),
        })
    };
    paths.iter().map(path).collect()
}

pub(crate) fn text(paths: &[PathTimes]) -> String {
    if paths.is_empty() {
        return "\nNo device times its passes here.\n".to_owned();
    }
    let mut table = output::table(&["culled by", "pass", "gpu ms"], 2);
    for times in paths {
        for (pass, ms) in milliseconds(times) {
            let cells = [times.path.name(), pass, &format!("{ms:.4}")];
            table.add_row(cells.map(str::to_owned));
        }
    }
    format!(
        "\nGPU milliseconds by pass, for one query's culling in the mean:\n{table}\n\
         Times between two timestamps of the device. They leave out the host's work and the wait for the submission.\n"
    )
}
