//! Queries beside the pictures: a thread that answers, on the CPU or on a device of its own.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use crate::avoid::cull::{Counted, CullInput, Overlap, cpu};
use crate::avoid::{Answer, Attack, Judging, Query, QueryContext, QuerySettings, Verdict};
use crate::gpu::{DeviceChoice, GpuError, Headless, HeadlessDesc, Message, compute, stencil};
use crate::graph::Playhead;
use crate::region::BakedGraph;

/// Who counts the overlaps of a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Culling {
    /// Nobody: every candidate is tested exactly, to the end.
    Exact,
    /// The maps on the CPU.
    #[default]
    Cpu,
    /// The maps by stencil buffer and occlusion queries.
    Stencil,
    /// The maps by a compute shader.
    Compute,
}

impl Culling {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Exact, Self::Cpu, Self::Stencil, Self::Compute];

    /// As the command calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Cpu => "cpu",
            Self::Stencil => "stencil",
            Self::Compute => "compute",
        }
    }
}

/// How an [`Asker`] is made.
#[derive(Clone, Debug, Default)]
pub struct AskerDesc {
    /// Which device culls where one is asked for; it is opened then.
    pub device: DeviceChoice,
    /// Whether validation is listened to there.
    pub validation: bool,
    /// Every answer comes so much later: what a slow device would look like.
    pub delay: Duration,
}

/// How is an attack avoided?
#[derive(Clone, Debug)]
pub struct Question {
    /// The asker's own.
    pub number: u32,
    /// Where the character is.
    pub playhead: Playhead,
    /// In the same world.
    pub attack: Attack,
    /// How the query is made.
    pub settings: QuerySettings,
    /// Who culls.
    pub culling: Culling,
}

/// The answer.
#[derive(Clone, Debug)]
pub struct Reply {
    /// That of the question.
    pub number: u32,
    /// What to do.
    pub answer: Answer,
    /// Who culled in the end.
    pub culling: Culling,
    /// How long the query took, seconds; the delay not counted.
    pub seconds: f64,
    /// Why the wished device did not cull.
    pub trouble: Option<String>,
}

/// Puts questions and gets replies, in their order.
#[derive(Debug)]
pub struct Asker {
    questions: Sender<Question>,
    replies: Receiver<Reply>,
    /// Dropped with it: then nobody waits any more.
    _stays: Sender<()>,
}

impl Asker {
    /// Puts a question.
    pub fn ask(&self, question: Question) {
        if self.questions.send(question).is_err() {
            tracing::error!("nobody answers queries any more");
        }
    }

    /// The next reply, if it is there.
    #[must_use]
    pub fn poll(&self) -> Option<Reply> {
        self.replies.try_recv().ok()
    }

    /// The next reply, as soon as it is there; `None` where nothing was asked within ten minutes.
    #[must_use]
    pub fn wait(&self) -> Option<Reply> {
        self.replies.recv_timeout(Duration::from_secs(600)).ok()
    }
}

/// Runs `act` while a thread answers what it asks. When `act` returns, an open question is given up. Returns too what validation has
/// said of the device that culled.
pub fn with_asker<T>(
    baked: &BakedGraph,
    desc: &AskerDesc,
    act: impl FnOnce(Asker) -> T,
) -> (T, Vec<Message>) {
    let (questions, to_answer) = channel();
    let (from_answerer, replies) = channel();
    let (stays, gone) = channel();
    std::thread::scope(|scope| {
        let answerer = scope.spawn(move || {
            let mut cullers = Cullers::new(desc);
            answer_all(
                (baked, desc),
                &mut cullers,
                (to_answer, from_answerer, gone),
            );
            cullers.destroy()
        });
        let done = act(Asker {
            questions,
            replies,
            _stays: stays,
        });
        (done, answerer.join().unwrap_or_default())
    })
}

fn answer_all(
    (baked, desc): (&BakedGraph, &AskerDesc),
    cullers: &mut Cullers,
    (questions, replies, gone): (Receiver<Question>, Sender<Reply>, Receiver<()>),
) {
    let mut context = QueryContext::default();
    while let Ok(question) = questions.recv() {
        let started = Instant::now();
        let mut reply = Reply {
            number: question.number,
            answer: Answer::default(),
            culling: question.culling,
            seconds: 0.0,
            trouble: None,
        };
        cullers.answer(baked, &question, (&mut context, &mut reply));
        reply.seconds = started.elapsed().as_secs_f64();
        let waits = !desc.delay.is_zero();
        if waits && gone.recv_timeout(desc.delay) == Err(RecvTimeoutError::Disconnected) {
            return;
        }
        if replies.send(reply).is_err() {
            return;
        }
    }
}

/// Who counts, each made when it is first asked for.
struct Cullers {
    desc: HeadlessDesc,
    device: Option<Result<Headless, String>>,
    stencil: Option<stencil::Culler>,
    compute: Option<compute::Culler>,
    cpu: cpu::Culler,
    overlaps: Vec<Overlap>,
}

impl Cullers {
    fn new(desc: &AskerDesc) -> Self {
        Self {
            desc: HeadlessDesc {
                device: desc.device.clone(),
                validation: desc.validation,
                ..HeadlessDesc::default()
            },
            device: None,
            stencil: None,
            compute: None,
            cpu: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
            overlaps: Vec::new(),
        }
    }

    fn answer(
        &mut self,
        baked: &BakedGraph,
        question: &Question,
        (context, reply): (&mut QueryContext, &mut Reply),
    ) {
        let query = Query::new(baked, &question.settings);
        let mut prepared = query.prepare(question.playhead, &question.attack, context);
        loop {
            let input = prepared.cull_input();
            if let Err(why) = self.count(reply.culling, &input) {
                reply.trouble = Some(why);
                reply.culling = Culling::Cpu;
                self.cpu.count(&input, &mut self.overlaps);
            }
            let judging = match reply.culling {
                Culling::Exact => Judging::All,
                _ => Judging::Needed,
            };
            match prepared.decide(&self.overlaps, judging, &mut reply.answer) {
                Verdict::Answered => return,
                Verdict::Widened(wider) => prepared = wider,
            }
        }
    }

    fn count(&mut self, culling: Culling, input: &CullInput<'_>) -> Result<(), String> {
        if matches!(culling, Culling::Exact | Culling::Cpu) {
            self.cpu.count(input, &mut self.overlaps);
            return Ok(());
        }
        let open = || Headless::new(&self.desc).map_err(|error| error.to_string());
        let device = self.device.get_or_insert_with(open);
        let device = device.as_mut().map_err(|why| why.clone())?;
        let counted = match culling {
            Culling::Compute => by_compute((device, &mut self.compute), input),
            _ => by_stencil((device, &mut self.stencil), input),
        };
        self.overlaps = counted.map_err(|error| error.to_string())?;
        Ok(())
    }

    fn destroy(self) -> Vec<Message> {
        let Some(Ok(mut device)) = self.device else {
            return Vec::new();
        };
        if let Ok(memory) = device.memory() {
            if let Some(culler) = self.stencil {
                culler.destroy(memory);
            }
            if let Some(culler) = self.compute {
                culler.destroy(memory);
            }
        }
        device.destroy()
    }
}

fn by_stencil(
    (device, culler): (&mut Headless, &mut Option<stencil::Culler>),
    input: &CullInput<'_>,
) -> Result<Vec<Overlap>, GpuError> {
    if culler.is_none() {
        let desc = stencil::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..stencil::CullerDesc::new("stencil", input.atlas)
        };
        *culler =
            Some(device.make(|context, memory| stencil::Culler::new(context, memory, &desc))?);
    }
    match culler {
        Some(culler) => device.cull(culler, input),
        None => Err(GpuError::Unfinished),
    }
}

fn by_compute(
    (device, culler): (&mut Headless, &mut Option<compute::Culler>),
    input: &CullInput<'_>,
) -> Result<Vec<Overlap>, GpuError> {
    if culler.is_none() {
        let desc = compute::CullerDesc {
            counted: Counted::FOR_A_CHOICE,
            ..compute::CullerDesc::new("compute", input.atlas)
        };
        *culler =
            Some(device.make(|context, memory| compute::Culler::new(context, memory, &desc))?);
    }
    match culler {
        Some(culler) => device.cull_compute(culler, input),
        None => Err(GpuError::Unfinished),
    }
}
