//! The library in forty lines: clips to a graph, an attack, a dodge, played back. It needs neither the command nor a Vulkan device.
//!
//! `cargo run --release --example dodge`

use std::error::Error;

use glam::Vec3;
use sabaki::anim::Pose;
use sabaki::graph::{self, ClipSource, EdgeId, GraphSettings, Playhead};
use sabaki::maps::{BakeSettings, Baker, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request};
use sabaki_fixtures::demo;

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

    // The CPU culls. To cull on a device, take a `Session` (`examples/bring_your_own_device.rs`).
    let settings = QuerySettings::default();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let request = Request::new(playhead, &attack);
    Query::new(&baked, &settings).answer(request, &mut context, &mut answer);
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
