use sabaki::anim::JointId;
use sabaki::crowd::*;
use sabaki::io::{ReadOptions, read_clip};
use sabaki::lod::*;
use sabaki::math::*;
use std::sync::Arc;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let loaded = read_clip(std::path::Path::new(&args[1]), &ReadOptions::default()).unwrap();
    let isa = match args[2].as_str() {
        "p" => Isa::Portable,
        "2" => Isa::Avx2,
        _ => Isa::Avx512,
    };
    let n: usize = args[3].parse().unwrap();
    let dv: f32 = args[4].parse().unwrap();
    let ends: Vec<(JointId, f32)> = loaded
        .skeleton
        .joints()
        .iter()
        .enumerate()
        .filter(|(_, j)| j.name.ends_with("_End"))
        .map(|(i, _)| (JointId(i as u16), 0.0))
        .take(loaded.skeleton.len().saturating_sub(24))
        .collect();
    let levels = Levels::in_order(&loaded.skeleton, &ends).unwrap();
    let level = levels.levels.last().unwrap().clone();
    let m = rehang(&loaded.skeleton, &loaded.clip, &level).unwrap();
    let moving = m
        .tracks
        .iter()
        .filter(|t| matches!(t.translations, Translations::Moving(_)))
        .count();
    let rep = Arc::new(
        Repertoire::new(&loaded.skeleton, &[loaded.clip.clone()], &[level.clone()]).unwrap(),
    );
    println!(
        "joints {} moving {} frames {} rate {} bytes {}",
        level.kept.len(),
        moving,
        m.frames,
        m.frame_rate,
        rep.bytes()
    );
    let form = if args.get(5).is_some_and(|a| a.contains('q')) {
        Form::Rotations
    } else {
        Form::Matrices
    };
    let layout = if args.get(5).is_some_and(|a| a.contains('r')) {
        Layout::Rows
    } else {
        Layout::Blocks
    };
    let memory = if args.get(5).is_some_and(|a| a.contains('s')) {
        Memory::Streamed
    } else {
        Memory::Cached
    };
    let threads = if args.get(5).is_some_and(|a| a.contains('2')) {
        2
    } else {
        1
    };
    let mut crowd = Crowd::new(
        rep.clone(),
        CrowdSettings {
            output: Output {
                form,
                layout,
                memory,
            },
            isa,
            threads,
        },
    );
    let mut s: u64 = 12345;
    let mut r = move || {
        s ^= s >> 12;
        s ^= s << 25;
        s ^= s >> 27;
        (s.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40) as f32 / (1 << 24) as f32
    };
    for _ in 0..n {
        crowd
            .add(&Character {
                time: r() * 100.0,
                speed: 1.0 + dv * (r() - 0.5),
                ..Default::default()
            })
            .unwrap();
    }
    let t = Instant::now();
    let lines = crowd.lines();
    println!("first sort {:?}", t.elapsed());
    let mut out = vec![Line([1.0; 16]); lines + 4096];
    let joints = (n * level.kept.len()) as f64;
    let mut times = vec![];
    for _ in 0..1000 {
        crowd.advance(1.0 / 60.0);
        let t = Instant::now();
        crowd.pose(&mut out).unwrap();
        times.push(t.elapsed().as_nanos() as f64);
    }
    let mean: f64 = times.iter().sum::<f64>() / times.len() as f64;
    times.sort_by(f64::total_cmp);
    println!(
        "{isa:?} min {:.3} median {:.3} mean {:.3} p95 {:.3} ns/joint  median {:.1} us",
        times[0] / joints,
        times[500] / joints,
        mean / joints,
        times[950] / joints,
        times[500] / 1e3
    );
}
