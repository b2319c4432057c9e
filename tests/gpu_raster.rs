//! Promise: the device's rasterizer and the CPU's draw the same maps, to the texel, and validation has nothing to say.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::{Random, device, drifting, finish};
use sabaki::{
    gpu::{
        GpuError, Headless,
        stencil::{Rasterizer, RasterizerDesc},
    },
    region::{Disc, Drawing, MapRect, raster},
};

fn rect(u: i32, v: i32, width: u32, height: u32) -> MapRect {
    MapRect {
        u,
        v,
        width,
        height,
    }
}

/// Draws with a target of `side` texels, by both rules, on both sides.
fn agree(device: &mut Headless, side: u32, drawings: &[Drawing]) {
    let desc = RasterizerDesc {
        name: "test",
        side,
        ..RasterizerDesc::default()
    };
    let mut rasterizer = device
        .make(|context, memory| Rasterizer::new(context, memory, &desc))
        .unwrap();
    let every = device.every_frame(&mut rasterizer, drawings).unwrap();
    let any = device.any_frame(&mut rasterizer, drawings).unwrap();
    rasterizer.destroy(device.memory().unwrap());
    for (index, drawing) in drawings.iter().enumerate() {
        let frames = drawing.frames();
        assert_eq!(
            every[index],
            raster::every_frame(drawing),
            "{index}: {frames} frames"
        );
        assert_eq!(
            any[index],
            raster::any_frame(drawing),
            "{index}: {frames} frames"
        );
    }
}

#[test]
fn random_drawings_agree() {
    let mut device = device();
    let mut random = Random(1);
    let drawings: Vec<_> = (0..200)
        .map(|_| {
            let (width, height) = (random.int(1, 90), random.int(1, 90));
            let rect = rect(
                random.int(-99, 99),
                random.int(-99, 99),
                width as u32,
                height as u32,
            );
            let (frames, discs) = (random.int(1, 40), random.int(0, 8));
            drifting(&mut random, rect, frames as usize, discs as usize)
        })
        .collect();
    // In one target, and in many batches through a small one.
    agree(&mut device, 2048, &drawings);
    agree(&mut device, 96, &drawings);
    finish(device);
}
