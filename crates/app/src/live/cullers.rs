//! Who counts the overlaps of a query: the CPU, or a device that is opened when it is first asked for.

use std::convert::Infallible;

use super::asker::{AskerDesc, Question, Reply};
use super::map_choices::MapChoice;
use crate::headless::{Headless, HeadlessDesc, Message};
use sabaki::gpu::{GpuError, compute, stencil};
use sabaki::maps::BakedGraph;
use sabaki::query::cull::{Counted, CullInput, Overlap, cpu};
use sabaki::query::{CullPath, Query, QueryContext, Request};

/// Who counts, each made when it is first asked for.
pub(super) struct Cullers {
    desc: HeadlessDesc,
    device: Option<Result<Headless, String>>,
    /// Those of the choices of maps that were culled by on the device.
    resident: Vec<(MapChoice, Resident)>,
    cpu: cpu::Culler,
}

/// One atlas on the device.
#[derive(Default)]
struct Resident {
    stencil: Option<stencil::Culler>,
    compute: Option<compute::Culler>,
}

impl Cullers {
    pub(super) fn new(desc: &AskerDesc) -> Self {
        Self {
            desc: HeadlessDesc {
                device: desc.device.clone(),
                validation: desc.validation,
                ..HeadlessDesc::default()
            },
            device: None,
            resident: Vec::new(),
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
        }
    }

    /// Writes the answer, and who culled.
    pub(super) fn answer(
        &mut self,
        baked: &BakedGraph,
        question: &Question,
        (context, reply): (&mut QueryContext, &mut Reply),
    ) {
        let query = Query::new(baked, &question.settings);
        let request = Request {
            evaluation: question.culling.evaluation(),
            ..Request::new(question.playhead, &question.attack)
        };
        let Reply {
            answer,
            culling,
            maps,
            trouble,
            ..
        } = reply;
        let mut session = query.start(request, context);
        let Ok(()) = session.run(answer, |input, counts| {
            if let Err(why) = self.count((*culling, *maps), input, counts) {
                *trouble = Some(why);
                *culling = CullPath::Cpu;
                self.cpu.count(input, counts);
            }
            Ok::<_, Infallible>(())
        });
    }

    fn count(
        &mut self,
        (culling, maps): (CullPath, MapChoice),
        input: &CullInput<'_>,
        counts: &mut Vec<Overlap>,
    ) -> Result<(), String> {
        if !culling.needs_device() {
            self.cpu.count(input, counts);
            return Ok(());
        }
        let open = || Headless::new(&self.desc).map_err(|error| error.to_string());
        let device = self.device.get_or_insert_with(open);
        let device = device.as_mut().map_err(|why| why.clone())?;
        let place = self.resident.iter().position(|(of, _)| *of == maps);
        let place = place.unwrap_or_else(|| {
            self.resident.push((maps, Resident::default()));
            self.resident.len() - 1
        });
        let resident = &mut self.resident[place].1;
        let counted = match culling {
            CullPath::Compute => resident.by_compute(device, input),
            _ => resident.by_stencil(device, input),
        };
        *counts = counted.map_err(|error| error.to_string())?;
        Ok(())
    }

    /// What validation has said of the device.
    pub(super) fn destroy(self) -> Vec<Message> {
        let Some(Ok(mut device)) = self.device else {
            return Vec::new();
        };
        if let Ok(memory) = device.memory() {
            for (_, resident) in self.resident {
                if let Some(culler) = resident.stencil {
                    culler.destroy(memory);
                }
                if let Some(culler) = resident.compute {
                    culler.destroy(memory);
                }
            }
        }
        device.destroy()
    }
}

impl Resident {
    fn by_stencil(
        &mut self,
        device: &mut Headless,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        let desc = stencil::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..stencil::CullerDesc::new("stencil", input.atlas)
        };
        let culler = match &mut self.stencil {
            Some(culler) => culler,
            none => none.insert(
                device.make(|context, memory| stencil::Culler::new(context, memory, &desc))?,
            ),
        };
        device.cull(culler, input)
    }

    fn by_compute(
        &mut self,
        device: &mut Headless,
        input: &CullInput<'_>,
    ) -> Result<Vec<Overlap>, GpuError> {
        let desc = compute::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..compute::CullerDesc::new("compute", input.atlas)
        };
        let culler = match &mut self.compute {
            Some(culler) => culler,
            none => none.insert(
                device.make(|context, memory| compute::Culler::new(context, memory, &desc))?,
            ),
        };
        device.cull_compute(culler, input)
    }
}
