//! Culling alone, from recording to polled counts, by number of candidates: the CPU's maps, the device's compute shader, and
//! its stencil buffer, counted by occlusion queries or by atomics. Candidates are those of the query that has the most, over
//! and over.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

use common::report::Report;
use common::{Motions, throws};
use sabaki::archive;
use sabaki::gpu::{Counting, Culler, CullerDesc, PipelineCache};
use sabaki::internal::CullCandidate;
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::{Counted, CullInput, CullPath, Overlap, cpu};
use sabaki::query::{Query, QueryContext, QuerySettings};
use sabaki_app::demo::throw::Throw;
use sabaki_app::headless::{Headless, HeadlessDesc};

const SIZES: [usize; 4] = [5, 100, 1000, 10_000];
const COLUMNS: [&str; 4] = ["cpu", "compute", "stencil, queries", "stencil, atomics"];

/// The folder with the files of a start; where it is set, the process is one.
const START: &str = "SABAKI_START";

fn main() -> ExitCode {
    let Some(folder) = std::env::var_os(START) else {
        return Report::main("cull", measure);
    };
    match start(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(report: &mut Report) {
    let mut device = Headless::new(&HeadlessDesc::default()).unwrap();
    report.device(device.device_name());
    // No cull on the device can be faster than this.
    report.table("the device alone", &["empty command buffer"]);
    report.row("submitted and waited for", |_| {
        device.run(|_| Ok(())).unwrap()
    });
    report.table("candidates culled", &COLUMNS);
    for (maps, grid) in [("default", MapGrid::default()), ("paper's", MapGrid::PAPER)] {
        let baked = Motions::read().bake_on(grid);
        for (counts, counted) in [("a choice", Counted::FOR_A_CHOICE), ("all", Counted::ALL)] {
            let mut cullers = Cullers::new(&mut device, &baked, counted);
            for size in SIZES {
                let name = format!("{maps} maps, counts for {counts}, {size:6}");
                with_candidates(&baked, counted, size, |input| {
                    report.row(&name, |column| cullers.count(&mut device, column, input));
                });
            }
            cullers.destroy(&mut device);
        }
    }
    starts(report);
    let _ = device.destroy();
}

/// Starts of a program, each in a process of its own: a culler is created and counts for the first time. On a first start the
/// driver's cache of shaders is empty and the program has kept no bytes of a pipeline cache; a second start finds what the first left.
fn starts(report: &mut Report) {
    report.table(
        "a start: a culler is created and counts",
        &["first start", "second start"],
    );
    let folder = tempfile::tempdir().unwrap();
    let baked = Motions::read().bake();
    archive::write(&folder.path().join("baked"), &baked).unwrap();
    let cache = folder.path().join("cache");
    for path in ["compute", "stencil"] {
        report.row_of_times(path, |column| {
            if column == 0 {
                let _ = fs::remove_dir_all(&cache);
                fs::create_dir(&cache).unwrap();
            }
            let mut start = Command::new(std::env::current_exe().unwrap());
            start.env(START, folder.path()).env("SABAKI_PATH", path);
            let output = start.env("MESA_SHADER_CACHE_DIR", &cache).output().unwrap();
            assert!(output.status.success(), "{output:?}");
            let text = String::from_utf8(output.stdout).unwrap();
            text.trim().parse().unwrap()
        });
    }
}

/// One start, with the files of `folder`; prints its milliseconds, which neither reading the graph nor creating the device count for.
fn start(folder: &Path) -> Result<(), Box<dyn Error>> {
    let path = match std::env::var("SABAKI_PATH")?.as_str() {
        "compute" => CullPath::Compute,
        _ => CullPath::Stencil,
    };
    let bytes = folder.join("cache").join("pipelines");
    let baked = archive::read(&folder.join("baked"))?;
    let mut device = Headless::new(&HeadlessDesc::default())?;
    with_candidates(&baked, Counted::FOR_A_CHOICE, 100, |input| {
        let began = Instant::now();
        let kept = fs::read(&bytes).unwrap_or_default();
        let made = device.make(|context, memory| {
            let cache = PipelineCache::new(context, &kept)?;
            let desc = CullerDesc {
                pipeline_cache: cache.handle(),
                ..CullerDesc::new(path, baked.atlas())
            };
            Ok((Culler::new(context, memory, &desc)?, cache))
        });
        let (mut culler, cache) = made.unwrap();
        device.cull(&mut culler, input).unwrap();
        println!("{}", began.elapsed().as_secs_f64() * 1e3);
        fs::write(&bytes, cache.bytes().unwrap()).unwrap();
        culler.destroy(device.memory().unwrap());
        cache.destroy();
    });
    let _ = device.destroy();
    Ok(())
}

/// Calls `run` with an attack and so many candidates.
fn with_candidates(
    baked: &BakedGraph,
    counted: Counted,
    size: usize,
    run: impl FnOnce(&CullInput<'_>),
) {
    let settings = QuerySettings::default();
    let throws = throws(baked, 40);
    let query = Query::new(baked, &settings);
    let mut context = QueryContext::default();
    let mut candidates_of = |throw: &Throw| {
        let session = query.start(throw.request(), &mut context);
        session.cull_input().candidates.len()
    };
    let busiest = throws.iter().max_by_key(|throw| candidates_of(throw));
    let mut session = query.start(busiest.unwrap().request(), &mut context);
    if counted == Counted::ALL {
        session.draw_outer_maps();
    }
    let input = session.cull_input();
    let all = input.candidates.iter().copied();
    let candidates: Vec<CullCandidate> = all.cycle().take(size).collect();
    run(&CullInput {
        candidates: &candidates,
        ..input
    });
}

/// One culler for each column.
struct Cullers {
    cpu: cpu::Culler,
    overlaps: Vec<Overlap>,
    /// All columns but the first.
    device: [Culler; 3],
}

impl Cullers {
    fn new(device: &mut Headless, baked: &BakedGraph, counted: Counted) -> Self {
        let mut make = |path, counting| {
            let mut desc = CullerDesc {
                counted,
                ..CullerDesc::new(path, baked.atlas())
            };
            desc.stencil.counting = Some(counting);
            if path == CullPath::Compute {
                desc.max_candidates = 10_000;
            }
            let made = device.make(|context, memory| Culler::new(context, memory, &desc));
            made.unwrap()
        };
        Self {
            cpu: cpu::Culler::default().counting(counted),
            overlaps: Vec::new(),
            device: [
                make(CullPath::Compute, Counting::Atomics),
                make(CullPath::Stencil, Counting::Queries),
                make(CullPath::Stencil, Counting::Atomics),
            ],
        }
    }

    fn count(&mut self, device: &mut Headless, column: usize, input: &CullInput<'_>) -> usize {
        match column {
            0 => self.cpu.count(input, &mut self.overlaps),
            _ => self.overlaps = device.cull(&mut self.device[column - 1], input).unwrap(),
        }
        self.overlaps.len()
    }

    fn destroy(self, device: &mut Headless) {
        let memory = device.memory().unwrap();
        for culler in self.device {
            culler.destroy(memory);
        }
    }
}
