//! Promise: the device's rasterizer and the CPU's draw the same maps, to the texel, and validation
//! has nothing to say.

use sabaki::gpu::{GpuError, Rasterizer, RasterizerDesc};
use sabaki::maps::{Disc, Drawing, raster};
use sabaki_fixtures::cull::{disc, drifting, map_rect as rect};
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;
use sabaki_fixtures::{device, finish};

/// Draws with a target of `side` texels, by both rules, on both sides.
pub(super) fn agree(device: &mut Headless, side: u32, drawings: &[Drawing]) {
    let desc = RasterizerDesc {
        side,
        ..RasterizerDesc::default()
    };
    let made = device.make(|context, memory| Rasterizer::new(context, memory, &desc));
    let mut rasterizer = made.unwrap();
    let every = device.every_frame(&mut rasterizer, drawings).unwrap();
    let any = device.any_frame(&mut rasterizer, drawings).unwrap();
    rasterizer.destroy(device.memory().unwrap());
    for (index, drawing) in drawings.iter().enumerate() {
        let frames = drawing.frames();
        let [is_every, is_any] = [
            every[index] == raster::every_frame(drawing),
            any[index] == raster::any_frame(drawing),
        ];
        assert!(is_every && is_any, "{index}: {frames} frames");
    }
}

/// Draws with a device of its own, by targets of these sizes.
fn agree_with_targets(sides: &[u32], drawings: &[Drawing]) {
    let mut device = device();
    for &side in sides {
        agree(&mut device, side, drawings);
    }
    finish(device);
}

#[test]
fn random_drawings_agree() {
    let mut random = Random::new(1);
    let drawings: Vec<_> = (0..200)
        .map(|_| {
            let [width, height] = [(); 2].map(|()| random.int(1, 90) as u32);
            let [u, v] = [(); 2].map(|()| random.int(-99, 99));
            let rect = rect(u, v, width, height);
            let (frames, discs) = (random.int(1, 40), random.int(0, 8));
            drifting(&mut random, rect, frames as usize, discs as usize)
        })
        .collect();
    // In one target, and in many batches through a small one.
    agree_with_targets(&[2048, 96], &drawings);
}

#[test]
fn any_number_of_frames_agrees() {
    let mut random = Random::new(7);
    // About 254 and 255 a stencil value runs out; further on it does so again.
    let lengths = [
        1, 2, 3, 100, 252, 253, 254, 255, 256, 257, 258, 300, 507, 508, 509, 510, 511, 700,
    ];
    let drawings: Vec<_> = lengths
        .into_iter()
        .map(|frames| drifting(&mut random, rect(0, 0, 40, 30), frames, 3))
        .collect();
    let kept = drawings.iter().filter(|drawing| {
        let maps = raster::every_frame(drawing);
        maps.body.count() > 0 && (drawing.frames() == 1 || maps.evasion.count() > 0)
    });
    assert!(kept.count() > lengths.len() / 2, "most have both maps");
    // All at once, which mixes their lengths in one target, and each alone.
    agree_with_targets(&[256, 40], &drawings);
}

#[test]
fn the_odd_cases_agree() {
    let mut random = Random::new(8);
    let at = |x, z, radius| Disc { x, z, radius };
    let drawing = |rect, frames: &[&[Disc]]| {
        let mut drawing = with(|s: &mut Drawing| s.rect = rect);
        for frame in frames {
            drawing.discs.extend_from_slice(frame);
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
        drawing
    };
    let whole = rect(-3, 4, 20, 10);
    let all = at(160, 80, 1000);
    let mut drawings = vec![
        drawing(rect(0, 0, 0, 0), &[]),
        drawing(rect(0, 0, 0, 7), &[&[all]]),
        drawing(whole, &[]),
        drawing(whole, &[&[]]),
        drawing(whole, &[&[all], &[], &[all]]),
        drawing(whole, &[&[], &[all]]),
        drawing(whole, &[&[all], &[all], &[]]),
        // Two discs of one frame count once.
        drawing(whole, &[&[all, all, all], &[at(0, 0, 100)], &[all, all]]),
        // A point: at a texel's centre, and beside it.
        drawing(whole, &[&[at(8, 8, 0), at(7 * 16, 8, 0)]]),
        drawing(whole, &[&[at(-50, -50, 40), at(-50, 20, 60)]]),
        drawing(rect(0, 0, 1, 1), &[&[at(8, 8, 1)], &[at(9, 8, 1)]]),
    ];
    // Neighbours in the target: discs that reach far over the borders of their own maps.
    for _ in 0..30 {
        let discs: Vec<_> = (0..4).map(|_| disc(&mut random, whole, 60)).collect();
        drawings.push(drawing(whole, &[&discs[..2], &discs[1..]]));
    }
    agree_with_targets(&[64], &drawings);
    agree_with_targets(&[128], &[]);
}

#[test]
fn the_largest_maps_agree() {
    let mut random = Random::new(9);
    let drawings: Vec<_> = [(2048, 3), (5, 2048), (700, 900)]
        .into_iter()
        .map(|(width, height)| drifting(&mut random, rect(0, 0, width, height), 4, 3))
        .collect();
    agree_with_targets(&[2048], &drawings);
}

#[test]
fn more_discs_than_one_rendering_takes_agree() {
    let mut random = Random::new(13);
    let drawings = [300, 2].map(|frames| drifting(&mut random, rect(0, 0, 40, 30), frames, 200));
    agree_with_targets(&[64], &drawings);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let mut device = device();
    let desc = with(|s: &mut RasterizerDesc| (s.name, s.side) = ("test", 64));
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let mut random = Random::new(10);
    let wide = drifting(&mut random, rect(0, 0, 65, 1), 2, 1);
    let mut torn = drifting(&mut random, rect(0, 0, 9, 9), 3, 1);
    torn.frame_ends[1] = 9;
    let mut refused = |drawing: &Drawing| {
        let result = device.every_frame(&mut rasterizer, std::slice::from_ref(drawing));
        result.unwrap_err().to_string()
    };
    assert_eq!(refused(&wide), "side of a map: 65 needed, 64 is the most");
    let words = "drawing 0: its frame ends do not divide its discs";
    assert_eq!(refused(&torn), words);
    rasterizer.destroy(device.memory().unwrap());

    let side = u32::MAX;
    let desc = RasterizerDesc { side, ..desc };
    let result = device.make(|context, memory| Rasterizer::new(context, memory, &desc));
    assert!(matches!(result, Err(GpuError::Limit { .. })));
    finish(device);
}
