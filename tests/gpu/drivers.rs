//! Promise: a driver's work-around is used on every version of Vulkan on which the driver can be known.

use sabaki::gpu::ash::vk;
use sabaki::gpu::{CullerDesc, GpuError};
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{CullCase, atlas, counted, culler, sliced};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::shim::Hidden;
use sabaki_fixtures::with;
use sabaki_fixtures::{device_without, finish};

#[test]
fn moltenvk_is_known_on_every_version() {
    let atlas = atlas(&mut Random::new(3), sliced(8), 6);
    let any = CullCase::that_hits(&mut Random::new(4), &atlas, 200);
    let counts = counted(&any.input(&atlas));
    let pairs = any.candidates.iter().zip(&counts);
    let met: Vec<_> = pairs.filter(|(_, count)| count.outer > 0).collect();
    assert!(!met.is_empty());
    // More than MoltenVK has queries, and each takes one at least.
    let many = met.iter().map(|(candidate, _)| **candidate).cycle();
    let candidates: Vec<_> = many.take(33_000).collect();
    let mut input = any.input(&atlas);
    input.candidates = &candidates;
    for version in [
        vk::API_VERSION_1_1,
        vk::API_VERSION_1_2,
        vk::API_VERSION_1_3,
    ] {
        let moltenvk = with(|s: &mut Hidden| s.driver = Some(vk::DriverId::MOLTENVK));
        let mut device = device_without(moltenvk, version);
        let desc = CullerDesc {
            max_candidates: 33_000,
            frames_in_flight: 1,
            ..CullerDesc::new(CullPath::Stencil, &atlas)
        };
        let mut culler = culler(&mut device, &desc);
        // SAFETY: `run` gives a buffer that is being recorded.
        let refused = device.run(|cmd| unsafe { culler.record(cmd, 0, &input) });
        let Err(GpuError::Limit { limit, .. }) = refused else {
            panic!("{version:x}: {refused:?}");
        };
        assert_eq!(limit, "the driver's queries in one submission");
        culler.destroy(device.memory().unwrap());
        finish(device);
    }
}
