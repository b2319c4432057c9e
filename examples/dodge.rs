//! The library in forty lines: clips to a graph, an attack, a dodge, played back. No command, no Vulkan:
//! `cargo run --release --no-default-features --features demo --example dodge`.

use std::error::Error;

use glam::Vec3;
use sabaki::anim::Pose;
use sabaki::graph::{self, ClipSource, EdgeId, GraphSettings, Playhead};
use sabaki::maps::{BakeSettings, Baker, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Judging, Query, QueryContext, QuerySettings, Verdict, cull};
use sabaki_app::demo;

fn main() -> Result<(), Box<dyn Error>> {
    // Offline: clips and events in, one immutable baked graph out. `sabaki_import::read_clips` reads your own clips.
    let motions = demo::motions()?;
    let source = ClipSource {
        skeleton: &motions.skeleton,
        clips: &motions.clips,
        events: &motions.events,
    };
    let (graph, report) = graph::build(source, &GraphSettings::default())?;
    println!(
        "{} transitions found in {:.0} s of motion",
        report.transitions, report.seconds
    );
    let baked = Baker::new(graph, BakeSettings::default())?.finish_on_cpu()?;

    // Where the character is, and a ball that will fly at its head.
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let key = |t, z| SphereKey {
        t,
        center: Vec3::new(0.0, 1.5, z),
        radius: 0.1,
    };
    let attack = Attack::new(vec![vec![key(0.9, 3.0), key(1.4, -1.0)]])?;

    // The query stops in the middle for whoever culls: here the CPU, in a renderer `sabaki::gpu::stencil`.
    let settings = QuerySettings::default();
    let query = Query::new(&baked, &settings);
    let (mut context, mut answer, mut overlaps) =
        (QueryContext::default(), Answer::default(), Vec::new());
    let mut prepared = query.prepare(playhead, &attack, &mut context);
    loop {
        cull::cpu::count(&prepared.cull_input(), &mut overlaps);
        match prepared.decide(&overlaps, Judging::Needed, &mut answer) {
            Verdict::Answered => break,
            Verdict::Widened(wider) => prepared = wider,
        }
    }
    println!(
        "avoided: {}, by {:.1} cm",
        answer.avoided,
        100.0 * answer.clearance().metres
    );

    // Every frame: a pose in the world, from the moment of the query on.
    let mut pose = Pose::default();
    answer.motion.sample(baked.graph(), 1.2, &mut pose);
    println!("after 1.2 s the root is at {}", pose.root);
    Ok(())
}
