//! The Vulkan device of the command: a headless one, with cullers for each graph.

use sabaki::gpu::{self, CullerDesc, GpuError, PassTime, PathReport};
use sabaki::maps::RegionAtlas;
use sabaki::query::cull::{Counted, CullInput, CullPath, Overlap, cpu};
use sabaki_fixtures::headless::{DeviceChoice, DeviceInfo, Headless, HeadlessDesc};
use serde_json::{Value, json};

use super::DeviceArgs;

/// An open device.
pub(crate) struct Opened {
    // `None` only while it is destroyed.
    headless: Option<Headless>,
    cullers: Vec<gpu::Culler>,
    /// Times of the passes of each culler.
    times: Vec<PathTimes>,
    /// Whether cullers that are created have timestamps.
    is_timed: bool,
    name: String,
}

/// Times of the passes of a culling path on the device.
#[derive(Clone, Debug)]
pub(crate) struct PathTimes {
    pub(crate) path: CullPath,
    /// Number of culls.
    pub(crate) culls: usize,
    /// Sums over all culls.
    pub(crate) passes: Vec<PassTime>,
}

/// A graph's cullers on the device, by their positions.
pub(crate) struct Culler {
    /// Stencil culler, or the reason why there is none.
    stencil: Result<usize, String>,
    /// Compute culler; created at its first use.
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
    let devices = sabaki_fixtures::headless::devices().map_err(|error| error.to_string())?;
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
            "missing": report.missing(),
            "paths": json!({
                "stencil": path_json(&report.stencil),
                "compute": path_json(&report.compute),
            }),
            "fallbacks": report.fallbacks.iter().map(|one| json!({
                "lacks": one.name,
                "instead": one.fallback,
            })).collect::<Vec<_>>(),
            "stencil_format": report.stencil_format.map(|format| format!("{format:?}")),
            "precise_queries": report.features.precise_queries,
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
            if report.features.precise_queries {
                "yes"
            } else {
                "no"
            },
        );
        for (name, path) in [("stencil", &report.stencil), ("compute", &report.compute)] {
            match path.runs() {
                true => line(&format!("{name} path"), "runs"),
                false => line(
                    &format!("{name} path"),
                    &format!("lacks {}", path.lacks.join(", ")),
                ),
            }
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

fn path_json(path: &PathReport) -> Value {
    json!({
        "runs": path.runs(),
        "lacks": path.lacks,
        "counts_exact": path.counts_exact,
    })
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
            times: Vec::new(),
            is_timed: false,
            name,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn culler(&mut self, atlas: &RegionAtlas) -> Culler {
        let stencil = self.make(CullPath::Stencil, atlas);
        Culler {
            stencil: stencil.map_err(|error| error.to_string()),
            compute: None,
        }
    }

    /// Creates a culler; returns its position.
    fn make(&mut self, path: CullPath, atlas: &RegionAtlas) -> Result<usize, GpuError> {
        let headless = self.headless.as_mut().ok_or(GpuError::Unfinished)?;
        let desc = CullerDesc {
            name: path.name(),
            counted: Counted::FOR_A_CHOICE,
            timestamps: self.is_timed,
            ..CullerDesc::new(path, atlas)
        };
        let made = headless.make(|context, memory| gpu::Culler::new(context, memory, &desc));
        self.cullers.push(made?);
        self.times.push(PathTimes {
            path,
            culls: 0,
            passes: Vec::new(),
        });
        Ok(self.cullers.len() - 1)
    }

    fn count(
        &mut self,
        culler: &mut Culler,
        path: CullPath,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        if path == CullPath::Compute && culler.compute.is_none() {
            culler.compute = Some(self.make(CullPath::Compute, input.atlas)?);
        }
        let index = match path {
            CullPath::Compute => culler.compute,
            _ => culler.stencil.as_ref().ok().copied(),
        };
        let index = index.ok_or(GpuError::Unfinished)?;
        let headless = self.headless.as_mut().ok_or(GpuError::Unfinished)?;
        let (culler, times) = (&mut self.cullers[index], &mut self.times[index]);
        times.culls += 1;
        headless.cull_timed(culler, input, &mut times.passes)
    }

    /// Times the passes of all cullers that are created from now on.
    pub(crate) fn time_passes(&mut self) {
        self.is_timed = true;
    }

    /// The times of all cullers that have timestamps.
    pub(crate) fn pass_times(&self) -> impl Iterator<Item = &PathTimes> {
        self.times.iter().filter(|one| !one.passes.is_empty())
    }

    /// Counts by the device's way that `path` names.
    pub(crate) fn cull(
        &mut self,
        culler: &mut Culler,
        path: CullPath,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, String> {
        if path == CullPath::Stencil {
            culler.stencil()?;
        }
        match self.count(culler, path, input) {
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
            let cullers = self.cullers.drain(..);
            cullers.for_each(|culler| culler.destroy(memory));
        }
        report(headless.destroy());
    }
}

fn report(messages: Vec<sabaki_fixtures::headless::Message>) {
    for message in messages {
        eprintln!("validation: {message:?}");
    }
}
