//! `sabaki doctor`.

use std::fmt::Write;

use sabaki::gpu::PathReport;
use sabaki_fixtures::headless::{DeviceInfo, devices};
use serde_json::{Value, json};

use super::culling::{self, DeviceArgs};
use super::{Done, Failure};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let (name, why) = match args.device.headless() {
        Ok(device) => {
            let name = device.device_name().to_owned();
            culling::destroy(device);
            (Some(name), None)
        }
        Err(error) => (None, Some(error.to_string())),
    };
    let usable = name.is_some();
    let devices = devices().map_err(|error| error.to_string());
    if as_json {
        let described = devices.as_deref().unwrap_or_default();
        let document = Done::json(&json!({
            "vulkan": devices.is_ok(),
            "why_not": devices.as_ref().err().or(why.as_ref()),
            "devices": described.iter().map(to_json).collect::<Vec<_>>(),
            "chosen": name,
            "paths": {
                "exact": true,
                "cpu": true,
                "stencil": usable,
                "compute": usable,
            },
        }));
        return Ok(Done::answer(document, usable));
    }
    let mut text = String::new();
    match &devices {
        Ok(devices) => devices.iter().for_each(|one| describe(one, &mut text)),
        Err(why) => text.push_str(&format!("no Vulkan: {why}\n")),
    }
    text.push_str("culling paths:\n  exact    runs\n  cpu      runs\n");
    let how = match (&name, &why) {
        (Some(name), _) => format!("runs on {name}"),
        (None, why) => format!("does not run: {}", why.as_deref().unwrap_or("no device")),
    };
    // Drivers compute where they draw; one that does not says so when it is asked to.
    for path in ["stencil", "compute"] {
        let _ = writeln!(text, "  {path}  {how}");
    }
    Ok(Done::answer(text, usable))
}

fn to_json(device: &DeviceInfo) -> Value {
    let report = &device.report;
    let path = |path: &PathReport| {
        json!({
            "runs": path.runs(),
            "lacks": path.lacks,
            "counts_exact": path.counts_exact,
        })
    };
    let fallbacks = report
        .fallbacks
        .iter()
        .map(|one| json!({ "lacks": one.name, "instead": one.fallback }));
    json!({
        "name": device.name,
        "kind": device.kind,
        "api": device.api,
        "usable": report.is_usable(),
        "missing": report.missing(),
        "paths": { "stencil": path(&report.stencil), "compute": path(&report.compute) },
        "fallbacks": fallbacks.collect::<Vec<_>>(),
        "stencil_format": report.stencil_format.map(|format| format!("{format:?}")),
        "precise_queries": report.features.precise_queries,
    })
}

fn describe(device: &DeviceInfo, text: &mut String) {
    let DeviceInfo {
        name,
        kind,
        api,
        report,
    } = device;
    let _ = writeln!(text, "device: {name} ({kind}, Vulkan {api})");
    let mut line = |what: &str, value: &str| {
        let _ = writeln!(text, "  {what:<16} {value}");
    };
    let format = report.stencil_format.map(|format| format!("{format:?}"));
    line("stencil format", format.as_deref().unwrap_or("none"));
    let precise = if report.features.precise_queries {
        "yes"
    } else {
        "no"
    };
    line("precise queries", precise);
    for (name, path) in [
        ("stencil path", &report.stencil),
        ("compute path", &report.compute),
    ] {
        match path.runs() {
            true => line(name, "runs"),
            false => line(name, &format!("lacks {}", path.lacks.join(", "))),
        }
    }
    for one in &report.fallbacks {
        let instead = one.fallback.unwrap_or_default();
        line("lacks", &format!("{}; instead: {instead}", one.name));
    }
}
