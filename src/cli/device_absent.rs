//! In the place of `device` where the command was built without Vulkan: there is never one.

use sabaki::maps::RegionAtlas;
use sabaki::query::cull::{CullInput, Overlap};
use serde_json::Value;

use super::{CullPath, DeviceArgs};

const WHY: &str = "this program was built without the feature `vulkan`";

/// Nothing: no value of it exists.
pub(crate) enum Opened {}

/// Nothing: no value of it exists.
pub(crate) enum Culler {}

/// Nothing: no value of it exists.
pub(crate) enum DeviceReport {}

/// Every device of the machine.
pub(crate) fn list() -> Result<Vec<DeviceReport>, String> {
    Err(WHY.to_owned())
}

impl DeviceReport {
    pub(crate) fn to_json(&self) -> Value {
        match *self {}
    }

    pub(crate) fn describe(&self) -> String {
        match *self {}
    }
}

impl Opened {
    pub(crate) fn new(_args: &DeviceArgs) -> Result<Self, String> {
        Err(WHY.to_owned())
    }

    pub(crate) fn name(&self) -> &str {
        match *self {}
    }

    pub(crate) fn culler(&mut self, _atlas: &RegionAtlas) -> Culler {
        match *self {}
    }

    pub(crate) fn cull(
        &mut self,
        _way: (&mut Culler, CullPath),
        _input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, String> {
        match *self {}
    }
}

impl Culler {
    pub(crate) fn stencil(&self) -> Result<(), &str> {
        match *self {}
    }
}
