//! The cullers of a worker: on the CPU, or on a device that is opened when it is first needed.

use std::convert::Infallible;

use super::map_choices::MapChoice;
use super::worker_request::{QueryWorkerDesc, WorkerRequest, WorkerResponse};
use sabaki::gpu::{Culler, CullerDesc, GpuError};
use sabaki::maps::BakedGraph;
use sabaki::query::cull::{Counted, CullInput, Overlap, cpu};
use sabaki::query::{CullPath, Query, QueryContext, Request};
use sabaki_fixtures::headless::{Headless, HeadlessDesc, Message};

/// Cullers, each created when it is first needed.
pub(super) struct Cullers {
    context: QueryContext,
    desc: HeadlessDesc,
    device: Option<Result<Headless, String>>,
    /// Cullers on the device.
    resident: Vec<(CullerKey, Culler)>,
    cpu: cpu::Culler,
}

/// The properties of a culler that is kept.
#[derive(Clone, Copy, PartialEq)]
struct CullerKey {
    maps: MapChoice,
    path: CullPath,
}

impl Cullers {
    pub(super) fn new(desc: &QueryWorkerDesc) -> Self {
        Self {
            context: QueryContext::default(),
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

    /// Answers a request and stores the answer, the path and the maps in the response.
    pub(super) fn answer(
        &mut self,
        baked: &BakedGraph,
        request: &WorkerRequest,
        response: &mut WorkerResponse,
    ) {
        let query = Query::new(baked, &request.settings);
        let request = Request {
            evaluation: request.culling.evaluation(),
            ..Request::new(request.playhead, &request.attack)
        };
        let WorkerResponse {
            answer,
            culling,
            maps,
            trouble,
            ..
        } = response;
        // Taken out while the session uses it.
        let mut context = std::mem::take(&mut self.context);
        let mut session = query.start(request, &mut context);
        let Ok(()) = session.run(answer, |input, counts| {
            let key = CullerKey {
                maps: *maps,
                path: *culling,
            };
            if let Err(why) = self.count(key, input, counts) {
                *trouble = Some(why);
                *culling = CullPath::Cpu;
                self.cpu.count(input, counts);
            }
            Ok::<_, Infallible>(())
        });
        self.context = context;
    }

    fn count(
        &mut self,
        key: CullerKey,
        input: &CullInput<'_>,
        counts: &mut Vec<Overlap>,
    ) -> Result<(), String> {
        if !key.path.needs_device() {
            self.cpu.count(input, counts);
            return Ok(());
        }
        let open = || Headless::new(&self.desc).map_err(|error| error.to_string());
        let device = self.device.get_or_insert_with(open);
        let device = device.as_mut().map_err(|why| why.clone())?;
        let place = self.resident.iter().position(|(of, _)| *of == key);
        let place = match place {
            Some(place) => place,
            None => {
                let culler = make(device, key.path, input).map_err(|error| error.to_string())?;
                self.resident.push((key, culler));
                self.resident.len() - 1
            }
        };
        let counted = device.cull(&mut self.resident[place].1, input);
        *counts = counted.map_err(|error| error.to_string())?;
        Ok(())
    }

    /// Destroys the cullers. Returns the validation messages of the device.
    pub(super) fn destroy(self) -> Vec<Message> {
        let Some(Ok(mut device)) = self.device else {
            return Vec::new();
        };
        if let Ok(memory) = device.memory() {
            for (_, culler) in self.resident {
                culler.destroy(memory);
            }
        }
        device.destroy()
    }
}

/// Creates a culler for the maps of an input.
fn make(device: &mut Headless, path: CullPath, input: &CullInput<'_>) -> Result<Culler, GpuError> {
    let desc = CullerDesc {
        name: path.name(),
        counted: Counted::FOR_A_CHOICE,
        ..CullerDesc::new(path, input.atlas)
    };
    device.make(|context, memory| Culler::new(context, memory, &desc))
}
