//! A thread that answers queries while pictures are drawn, on the CPU or on a device of its own.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use super::cullers::Cullers;
use super::map_choices::{MapChoice, MapChoices};
use super::worker_request::{QueryWorkerDesc, WorkerRequest, WorkerResponse};
use sabaki::query::Answer;
use sabaki_fixtures::headless::Message;

/// A task for the thread.
#[derive(Debug)]
enum Order {
    Answer(Box<WorkerRequest>),
    Draw(MapChoice),
}

/// Sends requests to a thread and receives the responses, in the same order.
#[derive(Debug)]
pub struct QueryWorker {
    orders: Sender<Order>,
    responses: Receiver<WorkerResponse>,
    /// Closed when the worker is dropped, which stops the thread.
    _stays: Sender<()>,
}

impl QueryWorker {
    /// Sends a request.
    pub fn ask(&self, request: WorkerRequest) {
        self.order(Order::Answer(Box::new(request)));
    }

    /// Draws maps in advance, so that no request waits for them.
    pub fn draw(&self, maps: MapChoice) {
        self.order(Order::Draw(maps));
    }

    fn order(&self, order: Order) {
        if self.orders.send(order).is_err() {
            tracing::error!("the thread that answers queries has ended");
        }
    }

    /// The next response, if it is ready.
    #[must_use]
    pub fn poll(&self) -> Option<WorkerResponse> {
        self.responses.try_recv().ok()
    }

    /// Waits for the next response; `None` after ten minutes.
    #[must_use]
    pub fn wait(&self) -> Option<WorkerResponse> {
        self.responses.recv_timeout(Duration::from_secs(600)).ok()
    }
}

/// Runs `act` while a thread answers its requests. When `act` returns, open requests are dropped. Also returns the validation
/// messages of the device that culled.
pub fn with_query_worker<T>(
    maps: &MapChoices<'_>,
    desc: &QueryWorkerDesc,
    act: impl FnOnce(QueryWorker) -> T,
) -> (T, Vec<Message>) {
    let (orders, to_do) = channel();
    let (from_answerer, responses) = channel();
    let (stays, gone) = channel();
    std::thread::scope(|scope| {
        let thread = scope.spawn(move || {
            let mut thread = WorkerThread {
                maps,
                delay: desc.delay,
                cullers: Cullers::new(desc),
                gone,
            };
            thread.work(&to_do, &from_answerer);
            thread.cullers.destroy()
        });
        let done = act(QueryWorker {
            orders,
            responses,
            _stays: stays,
        });
        (done, thread.join().unwrap_or_default())
    })
}

/// State of the thread.
struct WorkerThread<'a> {
    maps: &'a MapChoices<'a>,
    delay: Duration,
    cullers: Cullers,
    /// Disconnected when the worker is dropped.
    gone: Receiver<()>,
}

impl WorkerThread<'_> {
    fn work(&mut self, orders: &Receiver<Order>, responses: &Sender<WorkerResponse>) {
        while let Ok(order) = orders.recv() {
            if self.is_dropped_within(Duration::ZERO) {
                return;
            }
            let response = match order {
                Order::Answer(request) => self.answer(&request),
                Order::Draw(maps) => {
                    // A request that uses these maps reports the error.
                    let _ = self.maps.get(maps);
                    continue;
                }
            };
            if self.is_dropped_within(self.delay) || responses.send(response).is_err() {
                return;
            }
        }
    }

    /// Waits for some time; returns true at once if the worker is dropped meanwhile.
    fn is_dropped_within(&self, within: Duration) -> bool {
        self.gone.recv_timeout(within) == Err(RecvTimeoutError::Disconnected)
    }

    fn answer(&mut self, request: &WorkerRequest) -> WorkerResponse {
        let mut response = WorkerResponse {
            number: request.number,
            answer: Answer::default(),
            culling: request.culling,
            maps: request.maps,
            seconds: 0.0,
            trouble: None,
        };
        let baked = self.maps.get(request.maps).unwrap_or_else(|why| {
            response.maps = MapChoice::default();
            response.trouble = Some(why.to_string());
            self.maps.baked()
        });
        let started = Instant::now();
        self.cullers.answer(baked, request, &mut response);
        response.seconds = started.elapsed().as_secs_f64();
        response
    }
}
