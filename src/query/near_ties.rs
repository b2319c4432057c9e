//! Second test of candidates whose scores differ by less than the sampling error.
//!
//! [`Evaluation::Lazy`] tests an evasion on its baked body track, whose samples lie up to half a sample away from those that
//! [`Evaluation::Exhaustive`] poses. If two scores differ by less than this error, their order would depend on the culling path. Such
//! candidates are tested again at the samples of the exhaustive test, so that all paths choose the same one.

use super::candidate_tests::{NEAR_TIE, Tests};
use super::evaluated::Evaluated;
use super::evaluation::Evaluation;

impl Tests<'_, '_> {
    /// Maximum difference of scores that count as nearly tied.
    pub(super) fn near_tie(&self) -> f32 {
        self.input.query.settings.weights.distance.abs() * NEAR_TIE
    }

    /// Tests the candidates that are nearly tied with the best score again, and those that are hit by less than the error. Returns whether the best
    /// score has become so much worse that skipped candidates may win.
    pub(super) fn settle_near_ties(&mut self) -> bool {
        if self.input.state.request.evaluation == Evaluation::Exhaustive {
            return false;
        }
        let before = self.best_score();
        let most = before + self.near_tie();
        let input = self.input;
        let is_near = |index: usize, one: &Evaluated| match one.score {
            Some(score) => score.total <= most,
            None => one.clearance.metres > -0.5 * NEAR_TIE && input.score(index, 0.0).total <= most,
        };
        let (first, second) = {
            let mut near = self.tested().filter(|(index, one)| is_near(*index, one));
            (near.next(), near.next())
        };
        if let (Some((_, only)), None) = (first, second)
            && only.score.is_some()
        {
            return false;
        }
        self.settle_all(is_near);
        self.best_score() > most
    }

    /// Tests the hits that are nearly tied with the shallowest hit again.
    pub(super) fn settle_hits(&mut self) {
        let depths = self.tested().map(|(_, one)| one.clearance.metres);
        let least = depths.fold(f32::NEG_INFINITY, f32::max) - NEAR_TIE;
        let is_near = |one: &Evaluated| one.clearance.metres >= least;
        if self.tested().filter(|(_, one)| is_near(one)).count() > 1 {
            self.settle_all(|_, one| is_near(one));
        }
    }

    /// Tests all candidates for which `is_near` holds. No test changes the result of another candidate.
    fn settle_all(&mut self, is_near: impl Fn(usize, &Evaluated) -> bool) {
        for index in 0..self.results.evaluated.len() {
            let one = self.results.evaluated[index].filter(|one| is_near(index, one));
            if let Some(one) = one {
                self.settle(index, one);
            }
        }
    }

    /// The results so far, with the candidates' indices.
    fn tested(&self) -> impl Iterator<Item = (usize, Evaluated)> {
        let evaluated = self.results.evaluated.iter().enumerate();
        evaluated.filter_map(|(index, one)| Some((index, (*one)?)))
    }

    /// Tests a candidate on its final motion over the whole attack, unless that was done.
    fn settle(&mut self, index: usize, before: Evaluated) {
        if before.is_final {
            return;
        }
        let clearance = self.input.test_whole(index, self.results.workers.body());
        self.results.evaluated[index] = Some(Evaluated {
            is_final: true,
            ..self.input.result(index, clearance)
        });
    }
}
