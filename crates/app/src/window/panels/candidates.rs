//! Lists all candidates of the last query, with outcomes and the terms of the scores.

use egui::{Color32, RichText, Sense};

use crate::live::{Fighter, Throw};
use sabaki::query::{CandidateReport, CandidateResult};

/// The candidates that are listed.
#[derive(Default)]
pub(in crate::window) struct Listed {
    /// The sorted lines of the throw with this number.
    lines: Vec<CandidateLine>,
    of: u32,
}

struct CandidateLine {
    candidate: usize,
    result: CandidateResult,
    text: String,
    name: String,
}

/// Height of a line, in points.
const LINE: f32 = 17.0;
/// Number of visible lines.
const LINES: f32 = 11.0;

/// Draws the list. A click on a line shows the candidate as a ghost; another click hides it.
pub(in crate::window) fn candidates(
    ui: &mut egui::Ui,
    fighter: &mut Fighter<'_>,
    listed: &mut Listed,
) {
    let Some(last) = fighter.last() else {
        ui.label(RichText::new("click one of them to see its ghost").weak());
        return;
    };
    if listed.of != last.number {
        listed.of = last.number;
        listed.lines = lines(fighter, last);
    }
    let head = format!(
        "{:<9} {:>4} {:>5} {:>5} {:>4} {:>5}",
        "result", "p", "V_a", "V_d", "V_t", "V"
    );
    ui.label(RichText::new(head).monospace().size(11.0).weak());
    let (mut picked, before) = (fighter.picked(), fighter.picked());
    let count = listed.lines.len();
    egui::ScrollArea::vertical()
        .id_salt("candidates")
        .max_height(LINE * LINES)
        .auto_shrink([false, true])
        .show_rows(ui, LINE - ui.spacing().item_spacing.y, count, |ui, rows| {
            for line in &listed.lines[rows] {
                let is_picked = picked == Some(line.candidate);
                if listing(ui, line, is_picked) {
                    picked = (!is_picked).then_some(line.candidate);
                }
            }
        });
    if picked != before {
        fighter.pick(picked);
    }
}

/// Draws one line. Returns whether it was clicked.
fn listing(ui: &mut egui::Ui, line: &CandidateLine, is_picked: bool) -> bool {
    let wide = egui::vec2(ui.available_width(), LINE - ui.spacing().item_spacing.y);
    let (rect, response) = ui.allocate_exact_size(wide, Sense::click());
    let painter = ui.painter_at(rect);
    if is_picked || response.hovered() {
        let shade = if is_picked { 85 } else { 48 };
        painter.rect_filled(rect, 2.0, Color32::from_gray(shade));
    }
    let font = egui::FontId::monospace(11.0);
    let at = egui::pos2(rect.left(), rect.center().y);
    let align = egui::Align2::LEFT_CENTER;
    painter.text(at, align, &line.text, font, colour(line.result));
    response.on_hover_text(&line.name).clicked()
}

fn colour(result: CandidateResult) -> Color32 {
    match result {
        CandidateResult::Chosen => Color32::from_rgb(130, 225, 140),
        CandidateResult::Outscored => Color32::from_gray(205),
        CandidateResult::Culled => Color32::from_rgb(225, 175, 90),
        CandidateResult::Hit => Color32::from_rgb(240, 115, 95),
        CandidateResult::NotInTime => Color32::from_gray(120),
    }
}

fn lines(fighter: &Fighter<'_>, last: &Throw<'_>) -> Vec<CandidateLine> {
    let graph = fighter.baked().graph();
    let name = |report: &CandidateReport| {
        let Some(edge) = report.evasion else {
            return "only moves".to_owned();
        };
        let event = graph.edge(edge).event;
        event.map_or_else(String::new, |event| {
            graph.describe_event(graph.event(event))
        })
    };
    let all = last.answer().candidates.iter().enumerate();
    let mut lines: Vec<(f32, CandidateLine)> = all
        .map(|(candidate, report)| {
            let total = report.score.map_or(f32::INFINITY, |score| score.total);
            let line = CandidateLine {
                candidate,
                result: report.result,
                text: text(report),
                name: name(report),
            };
            (total, line)
        })
        .collect();
    lines.sort_by(|a, b| {
        (rank(a.1.result), a.0)
            .partial_cmp(&(rank(b.1.result), b.0))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    lines.into_iter().map(|(_, line)| line).collect()
}

fn rank(result: CandidateResult) -> u8 {
    match result {
        CandidateResult::Chosen => 0,
        CandidateResult::Outscored => 1,
        CandidateResult::Hit => 2,
        CandidateResult::Culled => 3,
        CandidateResult::NotInTime => 4,
    }
}

fn text(report: &CandidateReport) -> String {
    let result = match report.result {
        CandidateResult::Chosen => "chosen",
        CandidateResult::Outscored => "outscored",
        CandidateResult::NotInTime => "late",
        CandidateResult::Culled => "culled",
        CandidateResult::Hit => "hit",
    };
    let rate = report
        .rate
        .map_or_else(|_| "-".to_owned(), |rate| format!("{:.2}", rate.rate));
    match (report.score, report.clearance) {
        (Some(score), _) => format!(
            "{result:<9} {rate:>4} {:>5.2} {:>5.2} {:>4.2} {:>5.2}",
            score.avoid, score.distance, score.time, score.total
        ),
        (None, Some(hit)) => format!("{result:<9} {rate:>4}  {:.1} cm deep", -100.0 * hit.metres),
        (None, None) => match report.overlap.filter(|overlap| overlap.body > 0) {
            Some(overlap) => format!("{result:<9} {rate:>4}  {} texels met", overlap.body),
            None => format!("{result:<9} {rate:>4}"),
        },
    }
}
