//! Which culling paths run on this machine, and running them.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sabaki::internal::AttackDrawing;
use sabaki::maps::RegionAtlas;
use sabaki::query::CullPath;
use sabaki::query::cull::{Counted, CullInput, Overlap, cpu};

use super::Failure;

#[path = "device.rs"]
mod device;

pub(crate) use device::{DeviceReport, PathTimes, list};

/// Reads a culling path from the command line.
pub(crate) fn path_parser() -> impl TypedValueParser<Value = CullPath> {
    let help = |path| match path {
        CullPath::Exact => "No culling: every candidate is tested exactly, over the whole attack",
        CullPath::Cpu => "The maps on the CPU",
        CullPath::Stencil => {
            "The maps by the stencil buffer and occlusion queries of the Vulkan device"
        }
        CullPath::Compute => "The maps as masks of bits, by a compute shader of the Vulkan device",
    };
    let values = CullPath::ALL.map(|path| PossibleValue::new(path.name()).help(help(path)));
    PossibleValuesParser::new(values)
        .try_map(|name| CullPath::from_name(&name).ok_or("no culling path has this name"))
}

/// Which device to use.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "General")]
pub(crate) struct DeviceArgs {
    /// Use the Vulkan device whose name contains this (any case); otherwise the most capable one.
    #[arg(long, global = true, value_name = "NAME")]
    pub(crate) device: Option<String>,
    /// Listen to Vulkan's validation layer, and print what it says on stderr.
    #[arg(long, global = true)]
    pub(crate) validation: bool,
}

impl DeviceArgs {
    /// Refuses these options where no device is used. `by` names the command.
    pub(crate) fn check_unused(&self, by: &str) -> Result<(), Failure> {
        let option = match (&self.device, self.validation) {
            (Some(_), _) => "--device",
            (None, true) => "--validation",
            (None, false) => return Ok(()),
        };
        let what = format!("{option} needs a command that uses a Vulkan device; {by} uses none");
        Err(Failure::Usage(what))
    }
}

/// The culling paths of one graph.
pub(crate) struct Culling {
    device: Device,
    culler: Option<device::Culler>,
    cpu: cpu::Culler,
    /// Counts what no choice needs, too.
    whole: cpu::Culler,
}

/// One path of a [`Culling`].
pub(crate) struct OnePath<'a> {
    culling: &'a mut Culling,
    path: CullPath,
}

impl OnePath<'_> {
    pub(crate) fn path(&self) -> CullPath {
        self.path
    }

    /// As [`Culling::count`].
    pub(crate) fn count(
        &mut self,
        input: &CullInput<'_>,
        overlaps: &mut Vec<Overlap>,
    ) -> Result<(), Failure> {
        self.culling.count(self.path, input, overlaps)
    }

    /// As [`Culling::count_whole`].
    pub(crate) fn count_whole(
        &mut self,
        input: &CullInput<'_>,
        overlaps: &mut Vec<Overlap>,
    ) -> Result<(), Failure> {
        self.culling.count_whole(input, overlaps)
    }
}

/// A Vulkan device, or why there is none.
pub(crate) type Device = Result<device::Opened, String>;

/// Opens the most capable device, if there is one, or the one that the arguments name.
///
/// # Errors
/// The device that the arguments name cannot be opened.
pub(crate) fn open(args: &DeviceArgs) -> Result<Device, Failure> {
    match (try_open(args), &args.device) {
        (Err(why), Some(name)) => Err(Failure::Device(format!("--device {name}: {why}"))),
        (device, _) => Ok(device),
    }
}

/// Opens the device that the arguments ask for.
pub(crate) fn try_open(args: &DeviceArgs) -> Device {
    device::Opened::new(args)
}

impl Culling {
    /// The maps of `atlas` go to the device, if there is one that takes them.
    pub(crate) fn new(mut device: Device, atlas: &RegionAtlas) -> Self {
        let culler = device.as_mut().ok().map(|device| device.culler(atlas));
        Self {
            device,
            culler,
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
            whole: cpu::Culler::default(),
        }
    }

    /// The paths that need no device, and why there is none.
    pub(crate) fn without_device(why: String) -> Self {
        Self {
            device: Err(why),
            culler: None,
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
            whole: cpu::Culler::default(),
        }
    }

    /// One of these paths, for use.
    pub(crate) fn on(&mut self, path: CullPath) -> OnePath<'_> {
        OnePath {
            culling: self,
            path,
        }
    }

    /// The paths that run here.
    pub(crate) fn paths(&self) -> Vec<CullPath> {
        let runs = |path: &CullPath| match path {
            CullPath::Exact | CullPath::Cpu => true,
            CullPath::Stencil => self.stencil().is_ok(),
            CullPath::Compute => self.device.is_ok(),
        };
        CullPath::ALL.into_iter().filter(runs).collect()
    }

    /// Which device culls, if there is one.
    pub(crate) fn device_name(&self) -> Option<&str> {
        self.device.as_ref().ok().map(device::Opened::name)
    }

    /// Times of the passes on the device, if [`device::Opened::time_passes`] was asked for.
    pub(crate) fn pass_times(&self) -> Vec<&PathTimes> {
        let device = self.device.as_ref().ok();
        device.map_or(Vec::new(), |device| device.pass_times().collect())
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
        format!("culling: {}{why}", ways.join("; "))
    }

    /// The name of the device that takes the stencil path, or why none does.
    fn stencil(&self) -> Result<&str, &str> {
        let device = self.device.as_ref().map_err(String::as_str)?;
        let culler = self.culler.as_ref().ok_or("it has no maps")?;
        culler.stencil().map(|()| device.name())
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

    /// Counts everything, outer maps included, which a choice does not need and the times of
    /// [`Culling::count`] do not hold. All paths count the same.
    ///
    /// # Errors
    /// None.
    pub(crate) fn count_whole(
        &mut self,
        input: &CullInput<'_>,
        overlaps: &mut Vec<Overlap>,
    ) -> Result<(), Failure> {
        self.whole.count(input, overlaps);
        Ok(())
    }

    /// Counts the overlaps that a choice needs. [`CullPath::Exact`] counts them as well, on the CPU: they are a part of
    /// the score.
    ///
    /// # Errors
    /// The paths of the device without one, or with one that fails.
    pub(crate) fn count(
        &mut self,
        path: CullPath,
        input: &CullInput<'_>,
        overlaps: &mut Vec<Overlap>,
    ) -> Result<(), Failure> {
        if !path.needs_device() {
            self.cpu.count(input, overlaps);
            return Ok(());
        }
        let counted = match (&mut self.device, &mut self.culler) {
            (Ok(device), Some(culler)) => device.cull(culler, path, input),
            (Err(why), _) => Err(why.clone()),
            _ => Err("the device has no maps".to_owned()),
        };
        let failed = |why| format!("the {} path cannot run: {why}", path.name());
        *overlaps = counted.map_err(|why| Failure::Device(failed(why)))?;
        Ok(())
    }
}
