//! Times of the spans that a bake enters.

use std::cell::RefCell;
use std::sync::Mutex;
use std::time::Instant;

use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// Seconds by span, in the order in which the spans were first entered.
static SECONDS: Mutex<Vec<(&str, f64)>> = Mutex::new(Vec::new());
/// Names of the spans, by id.
static NAMES: Mutex<Vec<&str>> = Mutex::new(Vec::new());

thread_local! {
    static ENTERED: RefCell<Vec<Instant>> = const { RefCell::new(Vec::new()) };
}

/// Measures the time of each span. Spans of one name add up, and a span's time includes those inside it.
pub(crate) struct StageClock;

impl StageClock {
    /// Hears all spans from now on.
    pub(crate) fn install() {
        tracing::subscriber::set_global_default(Self).unwrap();
    }

    /// Seconds by span since the last call.
    pub(crate) fn take() -> Vec<(&'static str, f64)> {
        std::mem::take(&mut *SECONDS.lock().unwrap())
    }
}

impl Subscriber for StageClock {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        let name = metadata.name();
        metadata.is_span() && (name.starts_with("bake: ") || name.starts_with("load: "))
    }

    fn new_span(&self, span: &Attributes<'_>) -> Id {
        let mut names = NAMES.lock().unwrap();
        names.push(span.metadata().name());
        Id::from_u64(names.len() as u64)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, _: &Event<'_>) {}

    fn enter(&self, span: &Id) {
        let name = NAMES.lock().unwrap()[span.into_u64() as usize - 1];
        let mut seconds = SECONDS.lock().unwrap();
        if seconds.iter().all(|(other, _)| *other != name) {
            seconds.push((name, 0.0));
        }
        ENTERED.with_borrow_mut(|entered| entered.push(Instant::now()));
    }

    fn exit(&self, span: &Id) {
        let name = NAMES.lock().unwrap()[span.into_u64() as usize - 1];
        let entered = ENTERED.with_borrow_mut(Vec::pop);
        let mut seconds = SECONDS.lock().unwrap();
        let own = seconds.iter_mut().find(|(other, _)| *other == name);
        if let (Some((_, total)), Some(entered)) = (own, entered) {
            *total += entered.elapsed().as_secs_f64();
        }
    }
}
