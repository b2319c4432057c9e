//! Queries beside the pictures: a thread that answers, on the CPU or on a device of its own.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use super::cullers::Cullers;
use super::map_choices::{MapChoice, MapChoices};
use crate::headless::{DeviceChoice, Message};
use sabaki::graph::Playhead;
use sabaki::query::{Answer, Attack, CullPath, QueryContext, QuerySettings};

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
    pub culling: CullPath,
    /// By which maps.
    pub maps: MapChoice,
}

/// The answer.
#[derive(Clone, Debug)]
pub struct Reply {
    /// That of the question.
    pub number: u32,
    /// What to do.
    pub answer: Answer,
    /// Who culled in the end.
    pub culling: CullPath,
    /// By which maps in the end.
    pub maps: MapChoice,
    /// How long the query took, seconds; neither the delay nor maps that had to be drawn are counted.
    pub seconds: f64,
    /// Why the wished device did not cull, or not by the wished maps.
    pub trouble: Option<String>,
}

/// What the thread is to do.
#[derive(Debug)]
enum Order {
    Answer(Box<Question>),
    Draw(MapChoice),
}

/// Puts questions and gets replies, in their order.
#[derive(Debug)]
pub struct Asker {
    orders: Sender<Order>,
    replies: Receiver<Reply>,
    /// Dropped with it: then nobody waits any more.
    _stays: Sender<()>,
}

impl Asker {
    /// Puts a question.
    pub fn ask(&self, question: Question) {
        self.order(Order::Answer(Box::new(question)));
    }

    /// Has maps drawn, so that no question waits for them.
    pub fn draw(&self, maps: MapChoice) {
        self.order(Order::Draw(maps));
    }

    fn order(&self, order: Order) {
        if self.orders.send(order).is_err() {
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
    maps: &MapChoices<'_>,
    desc: &AskerDesc,
    act: impl FnOnce(Asker) -> T,
) -> (T, Vec<Message>) {
    let (orders, to_do) = channel();
    let (from_answerer, replies) = channel();
    let (stays, gone) = channel();
    std::thread::scope(|scope| {
        let answerer = scope.spawn(move || {
            let mut answerer = Answerer {
                maps,
                delay: desc.delay,
                cullers: Cullers::new(desc),
                context: QueryContext::default(),
                gone,
            };
            answerer.work(&to_do, &from_answerer);
            answerer.cullers.destroy()
        });
        let done = act(Asker {
            orders,
            replies,
            _stays: stays,
        });
        (done, answerer.join().unwrap_or_default())
    })
}

/// The thread's.
struct Answerer<'a> {
    maps: &'a MapChoices<'a>,
    delay: Duration,
    cullers: Cullers,
    context: QueryContext,
    /// Says so when nobody waits any more.
    gone: Receiver<()>,
}

impl Answerer<'_> {
    fn work(&mut self, orders: &Receiver<Order>, replies: &Sender<Reply>) {
        while let Ok(order) = orders.recv() {
            if self.nobody_waits(Duration::ZERO) {
                return;
            }
            let reply = match order {
                Order::Answer(question) => self.answer(&question),
                Order::Draw(maps) => {
                    // Whoever asks by them hears what was wrong.
                    let _ = self.maps.get(maps);
                    continue;
                }
            };
            if self.nobody_waits(self.delay) || replies.send(reply).is_err() {
                return;
            }
        }
    }

    /// Whether that is so within some time, which passes before it is known that somebody does.
    fn nobody_waits(&self, within: Duration) -> bool {
        self.gone.recv_timeout(within) == Err(RecvTimeoutError::Disconnected)
    }

    fn answer(&mut self, question: &Question) -> Reply {
        let mut reply = Reply {
            number: question.number,
            answer: Answer::default(),
            culling: question.culling,
            maps: question.maps,
            seconds: 0.0,
            trouble: None,
        };
        let baked = self.maps.get(question.maps).unwrap_or_else(|why| {
            reply.maps = MapChoice::default();
            reply.trouble = Some(why.to_string());
            self.maps.baked()
        });
        let started = Instant::now();
        self.cullers
            .answer(baked, question, (&mut self.context, &mut reply));
        reply.seconds = started.elapsed().as_secs_f64();
        reply
    }
}
