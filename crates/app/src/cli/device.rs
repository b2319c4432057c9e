//! The Vulkan device of the command: a headless one, with cullers for each graph.

use sabaki::gpu::{GpuError, compute, stencil};
use sabaki::maps::RegionAtlas;
use sabaki::query::cull::{Counted, CullInput, CullPath, Overlap, cpu};
use sabaki_app::headless::{DeviceChoice, DeviceInfo, Headless, HeadlessDesc};
use serde_json::{Value, json};

use super::DeviceArgs;

/// An open device.
pub(crate) struct Opened {
    // `None` only while it is destroyed.
    headless: Option<Headless>,
    stencil: Vec<stencil::Culler>,
    compute: Vec<compute::Culler>,
    name: String,
}

/// A graph's cullers on the device, by their positions.
pub(crate) struct Culler {
    /// Or why there is none.
    stencil: Result<usize, String>,
    /// Made when it is first asked for.
    compute: Option<usize>,
}

impl Culler {
    /// Whether the stencil path can run, or why not.
    pub(crate) fn stencil(&self) -> Result<(), &str> {
        self.stencil.as_ref().map(|_| ()).map_err(String::as_str)
    }
}

/// A device of this machine.
pub(crate) struct DeviceReport(DeviceInfo);

/// Every device of the machine.
pub(crate) fn list() -> Result<Vec<DeviceReport>, String> {
    let devices = sabaki_app::headless::devices().map_err(|error| error.to_string())?;
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
            stencil: Vec::new(),
            compute: Vec::new(),
            name,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn culler(&mut self, atlas: &RegionAtlas) -> Culler {
        Culler {
            stencil: self.make_stencil(atlas).map_err(|error| error.to_string()),
            compute: None,
        }
    }

    fn make_stencil(&mut self, atlas: &RegionAtlas) -> Result<usize, GpuError> {
        let headless = self.headless.as_mut().ok_or(GpuError::Unfinished)?;
        let desc = stencil::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..stencil::CullerDesc::new("stencil", atlas)
        };
        let made = headless.make(|context, memory| stencil::Culler::new(context, memory, &desc));
        self.stencil.push(made?);
        Ok(self.stencil.len() - 1)
    }

    fn make_compute(&mut self, atlas: &RegionAtlas) -> Result<usize, GpuError> {
        let headless = self.headless.as_mut().ok_or(GpuError::Unfinished)?;
        let desc = compute::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..compute::CullerDesc::new("compute", atlas)
        };
        let made = headless.make(|context, memory| compute::Culler::new(context, memory, &desc));
        self.compute.push(made?);
        Ok(self.compute.len() - 1)
    }

    fn count(
        &mut self,
        (culler, path): (&mut Culler, CullPath),
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        if path == CullPath::Compute && culler.compute.is_none() {
            culler.compute = Some(self.make_compute(input.atlas)?);
        }
        let headless = self.headless.as_mut().ok_or(GpuError::Unfinished)?;
        match (path, &culler.stencil, culler.compute) {
            (CullPath::Compute, _, Some(index)) => {
                headless.cull_compute(&mut self.compute[index], input)
            }
            (_, &Ok(index), _) => headless.cull(&mut self.stencil[index], input),
            _ => Err(GpuError::Unfinished),
        }
    }

    /// Counts by the device's way that `path` names.
    pub(crate) fn cull(
        &mut self,
        (culler, path): (&mut Culler, CullPath),
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, String> {
        if path == CullPath::Stencil {
            culler.stencil()?;
        }
        match self.count((culler, path), input) {
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
            let stencil = self.stencil.drain(..);
            stencil.for_each(|culler| culler.destroy(memory));
            let compute = self.compute.drain(..);
            compute.for_each(|culler| culler.destroy(memory));
        }
        report(headless.destroy());
    }
}

fn report(messages: Vec<sabaki_app::headless::Message>) {
    for message in messages {
        eprintln!("validation: {message:?}");
    }
}
