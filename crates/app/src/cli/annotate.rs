//! `sabaki annotate`.

use std::path::{Path, PathBuf};

use sabaki::anim::EventKind;
use sabaki_fixtures::agreement::{Agreement, agreement};
use sabaki_import::annotate::propose;
use sabaki_import::{ClipEvents, EventEntry, EventsFile, LoadedClip};
use serde_json::{Value, json};

use super::bake::{self, ReadArgs};
use super::numbers::number;
use super::output::{check_can_be_written, check_is_no_input, table_of, write_file};
use super::{Done, Failure, cancel};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// BVH, AMC, glTF or FBX files, or folders of them. Their skeletons may differ.
    #[arg(long, num_args = 1.., value_name = "PATH", required = true)]
    clips: Vec<PathBuf>,
    /// Events file that is written, for `bake --events`. Default: the events are printed alone.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Leaves out events of less confidence, 0 to 1. All events have 0.5 or more.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = number(0.0..=1.0))]
    min_confidence: f32,
    /// Events file made by hand: precision and recall are printed. A clip that it does not have counts as one without events.
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// Leaves out files that cannot be read and reports them (exit code 3).
    #[arg(long)]
    keep_going: bool,
    #[command(flatten)]
    read: ReadArgs,
}

/// The kinds in the order of the tables.
const KINDS: [EventKind; 2] = [EventKind::Attack, EventKind::Evasion];

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if !args.keep_going {
        args.clips
            .iter()
            .try_for_each(|path| bake::check_is_motion(path))?;
    }
    if let Some(out) = &args.out {
        let inputs = args.clips.iter().chain(&args.against);
        let inputs: Vec<&Path> = inputs.map(PathBuf::as_path).collect();
        check_is_no_input("--out", out, &inputs)?;
        check_can_be_written("--out", out)?;
    }
    cancel::listen();
    let against = args.against.as_deref().map(EventsFile::read).transpose()?;
    let report = Report::new(args, against.as_ref())?;
    if let Some(out) = &args.out {
        report.write(out)?;
    }
    let text = if as_json {
        Done::json(&report.document())
    } else {
        report.text()
    };
    Ok(Done::without(text, &report.left_out))
}

/// What was found in all clips.
#[derive(Default)]
struct Report {
    clips: Vec<Annotated>,
    /// Agreement by kind, if there are hand-made events.
    agreement: Option<[Agreement; 2]>,
    /// Errors of files that were left out.
    left_out: Vec<String>,
}

/// A clip with its events.
struct Annotated {
    name: String,
    seconds: f64,
    proposed: Vec<EventEntry>,
    by_hand: Option<Vec<EventEntry>>,
}

impl Report {
    fn new(args: &Args, against: Option<&EventsFile>) -> Result<Self, Failure> {
        let mut report = Self {
            agreement: against.map(|_| Default::default()),
            ..Self::default()
        };
        for path in sabaki_import::motion_files(&args.clips)? {
            cancel::check()?;
            // Without --keep-going such a file is refused before.
            if let Err(failure) = bake::check_is_motion(&path) {
                report.left_out.push(failure.to_string());
                continue;
            }
            match sabaki_import::read_motions(&path, &args.read.options()) {
                Ok(motions) => {
                    let motions = motions.iter();
                    let annotated = motions.map(|motion| Annotated::new(motion, args, against));
                    report.clips.extend(annotated);
                }
                Err(error) if args.keep_going => report.left_out.push(error.to_string()),
                Err(error) => return Err(error.into()),
            }
        }
        report.compare();
        Ok(report)
    }

    fn compare(&mut self) {
        let Some(sums) = &mut self.agreement else {
            return;
        };
        for clip in &self.clips {
            let by_hand = clip.by_hand.as_deref().unwrap_or_default();
            for (kind, sum) in KINDS.into_iter().zip(sums.iter_mut()) {
                *sum += agreement(kind, &clip.proposed, by_hand);
            }
        }
    }

    fn write(&self, path: &Path) -> Result<(), Failure> {
        let with_events = self.clips.iter().filter(|clip| !clip.proposed.is_empty());
        let clips = with_events.map(|clip| ClipEvents {
            file: clip.name.clone(),
            events: clip.proposed.clone(),
        });
        let file = EventsFile {
            clips: clips.collect(),
        };
        write_file(path, Done::json(&json!(file)).as_bytes())
    }

    fn count(&self, kind: EventKind) -> usize {
        let events = self.clips.iter().flat_map(|clip| &clip.proposed);
        events.filter(|event| event.kind == kind).count()
    }

    fn document(&self) -> Value {
        let of_clip = |clip: &Annotated| {
            json!({
                "file": clip.name,
                "seconds": clip.seconds,
                "events": clip.proposed,
            })
        };
        let clips: Vec<Value> = self.clips.iter().map(of_clip).collect();
        let of_kind = |agreement: &Agreement| {
            json!({
                "proposed": agreement.proposed,
                "annotated": agreement.annotated,
                "found": agreement.found,
                "same_joints": agreement.same_joints,
                "precision": agreement.precision(),
                "recall": agreement.recall(),
            })
        };
        let agreement = self.agreement.as_ref().map(|[attacks, evasions]| {
            json!({ "attack": of_kind(attacks), "evasion": of_kind(evasions) })
        });
        json!({
            "clips": clips,
            "attacks": self.count(EventKind::Attack),
            "evasions": self.count(EventKind::Evasion),
            "agreement": agreement,
            "left_out": self.left_out,
        })
    }

    fn text(&self) -> String {
        let proposed = self.clips.iter().flat_map(|clip| {
            let events = clip.proposed.iter();
            events.map(move |event| (clip, event))
        });
        let two = |number: f64| format!("{number:.2}");
        let rows = table_of(
            3,
            proposed,
            &[
                ("clip", &|(clip, _)| clip.name.clone()),
                ("kind", &|(_, event)| name(event.kind)),
                ("joints", &|(_, event)| event.joints.join(", ")),
                ("start", &|(_, event)| two(event.start)),
                ("contact", &|(_, event)| {
                    event.contact.map_or(String::new(), two)
                }),
                ("end", &|(_, event)| two(event.end)),
                ("confidence", &|(_, event)| {
                    two(event.confidence.unwrap_or(1.0))
                }),
            ],
        );
        let (attacks, evasions) = (
            self.count(EventKind::Attack),
            self.count(EventKind::Evasion),
        );
        let clips = self.clips.len();
        let mut text =
            format!("{rows}\n{attacks} attacks and {evasions} evasions in {clips} clips\n");
        if let Some(agreement) = &self.agreement {
            text += &agreement_text(agreement);
        }
        for error in &self.left_out {
            text += &format!("left out: {error}\n");
        }
        text
    }
}

impl Annotated {
    fn new(motion: &LoadedClip, args: &Args, against: Option<&EventsFile>) -> Self {
        let LoadedClip { skeleton, clip, .. } = motion;
        let mut proposed = propose(skeleton, clip);
        proposed.retain(|event| {
            event
                .confidence
                .is_none_or(|own| own >= f64::from(args.min_confidence))
        });
        Self {
            name: clip.name().to_owned(),
            seconds: clip.duration(),
            proposed,
            by_hand: against.map(|file| file.events_of(clip.name())),
        }
    }
}

fn name(kind: EventKind) -> String {
    format!("{kind:?}").to_lowercase()
}

fn agreement_text(agreement: &[Agreement; 2]) -> String {
    let share = |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{share:.2}"));
    let rows = table_of(
        1,
        KINDS.into_iter().zip(agreement),
        &[
            ("kind", &|(kind, _)| name(*kind)),
            ("proposed", &|(_, own)| own.proposed.to_string()),
            ("by hand", &|(_, own)| own.annotated.to_string()),
            ("found", &|(_, own)| own.found.to_string()),
            ("precision", &|(_, own)| share(own.precision())),
            ("recall", &|(_, own)| share(own.recall())),
            ("same joints", &|(_, own)| own.same_joints.to_string()),
        ],
    );
    format!("\nagreement with the events made by hand (overlap of 0.5 or more)\n{rows}\n")
}
