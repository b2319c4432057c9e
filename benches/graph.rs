//! Building: the distance maps of all pairs of clips on one core by instruction set, the graph, the bake.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::hint::black_box;
use std::process::ExitCode;

use common::motions;
use common::report::Report;
use sabaki::graph::search::{DistanceMap, PointCloud, Windows};
use sabaki::graph::{self, GraphSettings, MotionGraph};
use sabaki::maps::{BakeSettings, Baker};
use sabaki::math::Isa;
use sabaki_fixtures::demo::Motions;

fn main() -> ExitCode {
    Report::main("graph", |report| {
        let motions = motions();
        distance_maps(report, &motions);
        building(report, &motions);
    })
}

/// The layouts that the maps read are made anew each time.
fn distance_maps(report: &mut Report, motions: &Motions) {
    let weights = vec![1.0; motions.skeleton.len()];
    let cloud = |clip: &sabaki::anim::Clip| {
        PointCloud::new(&motions.skeleton, &clip.resampled(30.0).unwrap(), &weights)
    };
    let clouds: Vec<PointCloud> = motions.clips.iter().map(cloud).collect();
    let sets: Vec<Isa> = Isa::available().collect();
    let names: Vec<String> = sets.iter().map(|isa| format!("{isa:?}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    report.table("distance maps on one core, by instruction set", &names);
    report.row(format!("all pairs of {} clips", clouds.len()), |column| {
        let windows: Vec<Windows> = clouds.iter().map(|cloud| Windows::new(cloud, 10)).collect();
        for (i, a) in windows.iter().enumerate() {
            for b in &windows[i..] {
                let map = DistanceMap::new(a, b).with_isa(sets[column]);
                map.for_each_row(|_, row| {
                    black_box(row);
                });
            }
        }
    });
}

fn building(report: &mut Report, motions: &Motions) {
    let build = |settings: &GraphSettings| -> MotionGraph {
        graph::build(motions.source(), settings).unwrap().0
    };
    let on = |threads| GraphSettings {
        threads,
        ..GraphSettings::default()
    };
    let without_links = GraphSettings {
        links: None,
        ..on(1)
    };
    let columns = [
        "graph, 1 thread",
        "graph, 2 threads",
        "without links, 1 thread",
        "bake on the CPU",
    ];
    let graph = build(&on(0));
    report.table("building", &columns);
    report.row(
        format!("{} clips", motions.clips.len()),
        |column| match column {
            0 => black_box(build(&on(1))).nodes().len(),
            1 => black_box(build(&on(2))).nodes().len(),
            2 => black_box(build(&without_links)).nodes().len(),
            _ => {
                let baker = Baker::new(graph.clone(), BakeSettings::default()).unwrap();
                black_box(baker.finish_on_cpu().unwrap())
                    .graph()
                    .nodes()
                    .len()
            }
        },
    );
}
