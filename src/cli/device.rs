//! The Vulkan device of the command: a headless one, with a culler for each graph.

use sabaki::avoid::cull::{CullInput, Overlap, cpu};
use sabaki::gpu::stencil::{Culler as StencilCuller, CullerDesc};
use sabaki::gpu::{DeviceChoice, DeviceInfo, GpuError, Headless, HeadlessDesc};
use sabaki::region::RegionAtlas;
use serde_json::{Value, json};

use super::DeviceArgs;

/// An open device.
pub(crate) struct Opened {
    // `None` only while it is destroyed.
    headless: Option<Headless>,
    cullers: Vec<StencilCuller>,
    name: String,
}

/// One of the device's cullers, by its position.
pub(crate) struct Culler(usize);

/// A device of this machine.
pub(crate) struct DeviceReport(DeviceInfo);

/// Every device of the machine.
pub(crate) fn list() -> Result<Vec<DeviceReport>, String> {
    let devices = sabaki::gpu::devices().map_err(|error| error.to_string())?;
    Ok(devices.into_iter().map(DeviceReport).collect())
}

impl DeviceReport {
    pub(crate) fn to_json(&self) -> Value {
        let DeviceInfo {
            name,
            kind,
            api,
            report,
        } = &self.0;
        json!({
            "name": name,
            "kind": kind.to_string(),
            "api": api,
            "usable": report.is_usable(),
            "missing": report.missing,
            "fallbacks": report.fallbacks.iter().map(|one| json!({
                "lacks": one.name,
                "instead": one.fallback,
            })).collect::<Vec<_>>(),
            "stencil_format": report.stencil_format.map(|format| format!("{format:?}")),
            "precise_queries": report.precise_queries,
        })
    }

    pub(crate) fn describe(&self) -> String {
        let DeviceInfo {
            name,
            kind,
            api,
            report,
        } = &self.0;
        let mut text = format!("device: {name} ({kind}, Vulkan {api})\n");
        let mut line = |what: &str, value: &str| text.push_str(&format!("  {what:<16} {value}\n"));
        let format = report
            .stencil_format
            .map_or("none".to_owned(), |format| format!("{format:?}"));
        line("stencil format", &format);
        line(
            "precise queries",
            if report.precise_queries { "yes" } else { "no" },
        );
        for missing in &report.missing {
            line("lacks", missing);
        }
        for one in &report.fallbacks {
            line(
                "lacks",
                &format!(
                    "{}; instead: {}",
                    one.name,
                    one.fallback.unwrap_or_default()
                ),
            );
        }
        text
    }
}

impl Opened {
    pub(crate) fn new(args: &DeviceArgs) -> Result<Self, String> {
        let device = args
            .device
            .clone()
            .map_or(DeviceChoice::Best, DeviceChoice::Named);
        let desc = HeadlessDesc {
            device,
            validation: args.validation,
            ..HeadlessDesc::default()
        };
        Self::open(&desc).map_err(|error| error.to_string())
    }

    fn open(desc: &HeadlessDesc) -> Result<Self, GpuError> {
        let headless = Headless::new(desc)?;
        let name = headless.device_name().to_owned();
        Ok(Self {
            headless: Some(headless),
            cullers: Vec::new(),
            name,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn culler(&mut self, atlas: &RegionAtlas) -> Result<Culler, String> {
        let Some(headless) = &mut self.headless else {
            return Err(closed());
        };
        let desc = CullerDesc::new("cull", atlas);
        let made = headless.make(|context, memory| StencilCuller::new(context, memory, &desc));
        self.cullers.push(made.map_err(|error| error.to_string())?);
        Ok(Culler(self.cullers.len() - 1))
    }

    pub(crate) fn cull(
        &mut self,
        culler: &mut Culler,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, String> {
        let Some(headless) = &mut self.headless else {
            return Err(closed());
        };
        match headless.cull(&mut self.cullers[culler.0], input) {
            Ok(overlaps) => Ok(overlaps),
            // A limit of this device or of the culler's buffers: the CPU has none, and counts the
            // same.
            Err(GpuError::Limit {
                limit,
                needed,
                most,
            }) => {
                tracing::warn!(
                    limit,
                    needed,
                    most,
                    "beyond the device's limits, counted on the cpu"
                );
                let mut overlaps = Vec::new();
                cpu::count(input, &mut overlaps);
                Ok(overlaps)
            }
            Err(error) => Err(error.to_string()),
        }
    }
}

impl Drop for Opened {
    fn drop(&mut self) {
        let Some(mut headless) = self.headless.take() else {
            return;
        };
        if let Ok(memory) = headless.memory() {
            self.cullers
                .drain(..)
                .for_each(|culler| culler.destroy(memory));
        }
        report(headless.destroy());
    }
}

fn closed() -> String {
    "the device is closed".to_owned()
}

fn report(messages: Vec<sabaki::gpu::Message>) {
    for message in messages {
        eprintln!("validation: {message:?}");
    }
}
