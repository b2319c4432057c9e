//! How far a bake is, on a terminal; Ctrl-C stops it.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use sabaki::graph::{BakeProgress, BakeStage, BakeWatch};

use super::super::cancel;

const STAGES: usize = BakeStage::Exits as usize + 1;

/// Shows the stage of a bake, the share of it that is done, and the time left; of the search the pairs of windows a second, too. Stderr may
/// be no terminal: nothing is shown then.
#[derive(Debug)]
pub(crate) struct BakeBar {
    started: Instant,
    /// The bar, and the stage that it shows.
    shown: Mutex<(ProgressBar, Option<BakeStage>)>,
}

impl BakeBar {
    /// Begins to hear Ctrl-C.
    pub(crate) fn new() -> Self {
        cancel::listen();
        Self {
            started: Instant::now(),
            shown: Mutex::new((ProgressBar::hidden(), None)),
        }
    }

    /// Shows a stage that is short.
    pub(crate) fn short(&self, what: &'static str) {
        let bar = ProgressBar::new_spinner().with_message(what);
        self.show(&mut self.lock().0, bar, what);
    }

    fn show(&self, shown: &mut ProgressBar, bar: ProgressBar, what: &str) {
        shown.finish_and_clear();
        *shown = bar;
        shown.tick();
        let seconds = self.started.elapsed().as_secs_f64();
        tracing::info!("{what} at {seconds:.3} s");
    }

    fn lock(&self) -> MutexGuard<'_, (ProgressBar, Option<BakeStage>)> {
        // A bar is of use, whatever befell the thread that drew it last.
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for BakeBar {
    fn drop(&mut self) {
        self.lock().0.finish_and_clear();
    }
}

impl BakeWatch for BakeBar {
    fn progress(&self, progress: BakeProgress) {
        let (shown, last) = &mut *self.lock();
        let BakeProgress { stage, done, all } = progress;
        if last.replace(stage) != Some(stage) {
            self.show(shown, bar(stage), words(stage));
        }
        shown.set_length(all);
        shown.set_position(done);
    }

    fn is_stopped(&self) -> bool {
        cancel::is_asked()
    }
}

fn words(stage: BakeStage) -> &'static str {
    match stage {
        BakeStage::Transitions => "searching transitions",
        BakeStage::Feet => "testing feet",
        BakeStage::Joins => "linking events",
        BakeStage::Links => "searching links",
        BakeStage::Choice => "choosing links",
        BakeStage::Entries => "testing entries",
        BakeStage::Exits => "testing exits",
    }
}

fn bar(stage: BakeStage) -> ProgressBar {
    let message = format!("{}/{STAGES} {}", stage as usize + 1, words(stage));
    let bar = ProgressBar::new(0).with_message(message);
    let rate = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        // A bar that cannot be written is not worth an error.
        let _ = write!(
            out,
            "{:.0} million pairs a second, ",
            state.per_sec() * 1e-6
        );
    };
    let of_search = match stage {
        BakeStage::Transitions => "{rate}",
        _ => "",
    };
    let template = format!("{{msg}} {{wide_bar}} {{percent}}%, {of_search}{{eta}} left");
    match ProgressStyle::with_template(&template) {
        Ok(style) => bar.with_style(style.with_key("rate", rate)),
        Err(_) => bar,
    }
}
