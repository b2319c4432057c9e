//! Which culling paths run on this machine, and running them.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sabaki::gpu::{self, CullerDesc, GpuError};
use sabaki::maps::RegionAtlas;
use sabaki::query::cull::{AttackDrawing, Counted, CullInput, Overlap, cpu};
use sabaki::query::{CullPath, QuerySettings};
use sabaki_fixtures::headless::{Cullers, DeviceChoice, Headless, HeadlessDesc, Message};

use super::Failure;

/// Reads a culling path from the command line.
pub(crate) fn path_parser() -> impl TypedValueParser<Value = CullPath> {
    let help = |path| match path {
        CullPath::None => {
            "No culling: candidates are tested exactly, as far as the choice needs it"
        }
        CullPath::Exact => "No culling: every candidate is tested exactly, over the whole attack",
        CullPath::Cpu => "The maps on the CPU",
        CullPath::Stencil => "The maps by the stencil buffer and occlusion queries of the device",
        CullPath::Compute => "The maps as masks of bits, by a compute shader of the device",
    };
    let values = CullPath::ALL.map(|path| PossibleValue::new(path.name()).help(help(path)));
    PossibleValuesParser::new(values)
        .try_map(|name| CullPath::from_name(&name).ok_or("no culling path has this name"))
}

/// Which device to use.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "General")]
pub(crate) struct DeviceArgs {
    /// Uses the Vulkan device whose name contains this (any case), instead of the most capable one.
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Prints the messages of Vulkan's validation layer to stderr.
    #[arg(long)]
    pub(crate) validation: bool,
}

impl DeviceArgs {
    pub(crate) fn is_given(&self) -> bool {
        self.device.is_some() || self.validation
    }

    pub(crate) fn choice(&self) -> DeviceChoice {
        let name = self.device.clone();
        name.map_or(DeviceChoice::Best, DeviceChoice::Named)
    }

    /// Creates the device.
    pub(crate) fn headless(&self) -> Result<Headless, GpuError> {
        Headless::new(&HeadlessDesc {
            device: self.choice(),
            validation: self.validation,
            ..HeadlessDesc::default()
        })
    }
}

/// Frees a device, and prints what validation said.
pub(crate) fn destroy(device: Headless) {
    report(&device.destroy());
}

fn report(messages: &[Message]) {
    for message in messages {
        eprintln!("validation: {message:?}");
    }
}

/// Opens the most capable device, if there is one, or the one that the arguments name.
///
/// # Errors
/// The device that the arguments name cannot be opened.
pub(crate) fn open(args: &DeviceArgs) -> Result<Result<Headless, String>, Failure> {
    let opened = args.headless().map_err(|error| error.to_string());
    match (opened, &args.device) {
        (Err(why), Some(name)) => Err(Failure::Device(format!("--device {name}: {why}"))),
        (opened, _) => Ok(opened),
    }
}

/// The culling paths of one graph.
pub(crate) struct Culling {
    device: Result<DeviceCullers, String>,
    cpu: cpu::Culler,
    /// Counts what no choice needs, too.
    whole: cpu::Culler,
    /// Counts the evasion maps alone: nothing is culled.
    unculled: cpu::Culler,
}

struct DeviceCullers {
    headless: Headless,
    cullers: Cullers,
    /// Why there is no stencil path, if there is none.
    stencil: Result<(), String>,
}

impl Culling {
    /// The maps of `atlas` go to the device, if there is one that takes them.
    pub(crate) fn new(device: Result<Headless, String>, atlas: &RegionAtlas) -> Self {
        Self {
            device: device.map(|headless| DeviceCullers::new(headless, atlas)),
            ..Self::without_device(String::new())
        }
    }

    /// The paths that need no device, and why there is none.
    pub(crate) fn without_device(why: String) -> Self {
        Self {
            device: Err(why),
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
            whole: cpu::Culler::default(),
            unculled: cpu::Culler::default().counting(Counted::FOR_A_SCORE),
        }
    }

    /// The paths that run here.
    pub(crate) fn paths(&self) -> Vec<CullPath> {
        let runs = |path: &CullPath| match path {
            CullPath::None | CullPath::Exact | CullPath::Cpu => true,
            CullPath::Stencil => self.stencil().is_ok(),
            CullPath::Compute => self.device.is_ok(),
        };
        CullPath::ALL.into_iter().filter(runs).collect()
    }

    /// The paths that run here and cull.
    pub(crate) fn counting(&self) -> Vec<CullPath> {
        let mut paths = self.paths();
        paths.retain(|path| path.culls());
        paths
    }

    /// Which device culls, if there is one.
    pub(crate) fn device_name(&self) -> Option<&str> {
        let device = self.device.as_ref().ok();
        device.map(|device| device.headless.device_name())
    }

    /// The stencil path where it can run, else the CPU's.
    pub(crate) fn best(&self) -> CullPath {
        if self.stencil().is_ok() {
            CullPath::Stencil
        } else {
            CullPath::Cpu
        }
    }

    /// In one line, which of these paths were used and on which device; where the stencil path was not, and cannot be, why.
    pub(crate) fn describe(&self, used: impl IntoIterator<Item = CullPath>) -> String {
        let device = self.device_name().unwrap_or("no device");
        let mut ways: Vec<String> = Vec::new();
        let mut by_device = false;
        for path in used {
            by_device |= path.needs_device();
            let way = match path {
                CullPath::None => "none".to_owned(),
                CullPath::Exact => "none, every candidate is tested".to_owned(),
                CullPath::Cpu => "on the cpu".to_owned(),
                CullPath::Stencil => format!("by stencil buffer on {device}"),
                CullPath::Compute => format!("by compute shader on {device}"),
            };
            if !ways.contains(&way) {
                ways.push(way);
            }
        }
        let why = match self.stencil() {
            Err(why) if !by_device => format!(" (no Vulkan device can be used: {why})"),
            _ => String::new(),
        };
        format!("culling: {}{why}", ways.join("\n         "))
    }

    /// Whether the stencil path can run, or why not.
    fn stencil(&self) -> Result<(), &str> {
        let device = self.device.as_ref().map_err(String::as_str)?;
        device.stencil.as_ref().copied().map_err(String::as_str)
    }

    /// Makes what a path needs on the device and takes the maps there, so that the first query's time is one like the others.
    ///
    /// # Errors
    /// As [`Culling::count`].
    pub(crate) fn warm_up(&mut self, path: CullPath, atlas: &RegionAtlas) -> Result<(), Failure> {
        let attack = AttackDrawing::default();
        let input = CullInput {
            atlas,
            attack: &attack,
            candidates: &[],
        };
        self.count(path, &input, &mut Vec::new())
    }

    /// Counts the overlaps that a choice needs. Without culling, these are those of the evasion maps alone, which are a part of the score.
    ///
    /// # Errors
    /// The paths of the device without one, or with one that fails.
    pub(crate) fn count(
        &mut self,
        path: CullPath,
        input: &CullInput<'_>,
        overlaps: &mut Vec<Overlap>,
    ) -> Result<(), Failure> {
        match path {
            CullPath::None | CullPath::Exact => self.unculled.count(input, overlaps),
            CullPath::Cpu => self.cpu.count(input, overlaps),
            CullPath::Stencil | CullPath::Compute => {
                *overlaps = self.count_on_device(path, input)?;
            }
        }
        Ok(())
    }

    /// Counts everything, outer maps included, which a choice does not need. All paths count the same.
    pub(crate) fn count_whole(&mut self, input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
        self.whole.count(input, overlaps);
    }

    /// Calls `run` with a function that counts all inputs: on the device in one submission, on the CPU one after the other.
    ///
    /// # Errors
    /// As [`Culling::count`].
    pub(crate) fn with_batch<T>(
        &mut self,
        path: CullPath,
        inputs: &[CullInput<'_>],
        run: impl FnOnce(&mut dyn FnMut() -> Result<(), Failure>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let of_gpu = |error: GpuError| cannot_run(path, &error.to_string());
        if !path.needs_device() {
            let mut overlaps = Vec::new();
            return run(&mut || {
                let each = |input| self.cpu.count(input, &mut overlaps);
                inputs.iter().for_each(each);
                Ok(())
            });
        }
        let device = self.device.as_mut().map_err(|why| cannot_run(path, why))?;
        let headless = &mut device.headless;
        let Some(first) = inputs.first() else {
            return Err(of_gpu(GpuError::Unfinished));
        };
        let slots = inputs.len() as u32;
        let desc = CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..CullerDesc::new(path, first.atlas).for_settings(&QuerySettings::default(), slots)
        };
        let made = headless.make(|context, memory| gpu::Culler::new(context, memory, &desc));
        let mut culler = made.map_err(of_gpu)?;
        let done = run(&mut || {
            let counted = headless.cull_batch(&mut culler, inputs, |_, _| (), |_, _| ());
            counted.map_err(of_gpu)
        });
        culler.destroy(headless.memory().map_err(of_gpu)?);
        done
    }

    fn count_on_device(
        &mut self,
        path: CullPath,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, Failure> {
        let device = self.device.as_mut().map_err(|why| cannot_run(path, why))?;
        let counted = device.count(path, input);
        counted.map_err(|error| cannot_run(path, &error.to_string()))
    }
}

fn cannot_run(path: CullPath, why: &str) -> Failure {
    Failure::Device(format!("the {path} path cannot run: {why}"))
}

impl DeviceCullers {
    fn new(mut headless: Headless, atlas: &RegionAtlas) -> Self {
        let mut cullers = Cullers::default();
        let stencil = cullers.get(&mut headless, CullPath::Stencil, atlas);
        Self {
            stencil: stencil.map(drop).map_err(|error| error.to_string()),
            cullers,
            headless,
        }
    }

    fn count(&mut self, path: CullPath, input: &CullInput<'_>) -> Result<Vec<Overlap>, GpuError> {
        let culler = self.cullers.get(&mut self.headless, path, input.atlas)?;
        match self.headless.cull(culler, input) {
            // A limit of this device or of the culler's buffers: the CPU has none, and counts the same.
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
            counted => counted,
        }
    }
}

impl Drop for DeviceCullers {
    fn drop(&mut self) {
        self.cullers.destroy(&mut self.headless);
        report(&self.headless.close());
    }
}
