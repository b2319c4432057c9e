//! `sabaki doctor`.

use super::culling::{self, DeviceArgs};
use super::{Done, Failure};
use serde_json::json;

pub(crate) fn run(args: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    let opened = culling::try_open(args);
    let usable = opened.is_ok();
    let why = opened.as_ref().err().cloned();
    let devices = culling::list();
    let name = opened.as_ref().ok().map(|device| device.name().to_owned());
    let text = if as_json {
        Done::json(&json!({
            "vulkan": devices.is_ok(),
            "why_not": devices.as_ref().err().or(why.as_ref()),
            "devices": devices.as_deref().unwrap_or_default().iter().map(culling::DeviceReport::to_json).collect::<Vec<_>>(),
            "chosen": name,
            "paths": {
                "exact": true,
                "cpu": true,
                "stencil": usable,
                "compute": usable,
            },
        }))
    } else {
        let mut text = String::new();
        match &devices {
            Ok(devices) => devices
                .iter()
                .for_each(|device| text.push_str(&device.describe())),
            Err(why) => text.push_str(&format!("no Vulkan: {why}\n")),
        }
        text.push_str("culling paths:\n  exact    runs\n  cpu      runs\n");
        let how = match (&name, &why) {
            (Some(name), _) => format!("runs on {name}"),
            (None, why) => format!("does not run: {}", why.as_deref().unwrap_or("no device")),
        };
        // Drivers compute where they draw; one that does not says so when it is asked to.
        for path in ["stencil", "compute"] {
            text.push_str(&format!("  {path}  {how}\n"));
        }
        text
    };
    Ok(Done::answer(text, usable))
}
