//! Promise: a batch that fails has no tickets, wherever it fails, and the culler goes on.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../../examples/common/plain_memory.rs"]
#[allow(dead_code)]
mod plain_memory;

use plain_memory::PlainMemory;
use sabaki::gpu::ash::vk;
use sabaki::gpu::{BatchEntry, Culler, CullerDesc, GpuError};
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{CullCase, DEVICE_PATHS, atlas, counted, sliced};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::shim::{self, Fault};

use super::contract::device;

#[test]
fn a_batch_that_fails_has_no_tickets() {
    let atlas = atlas(&mut Random::new(3), sliced(8), 6);
    let case = CullCase::any(&mut Random::new(4), &atlas, 20);
    let input = case.input(&atlas);
    let mut device = device();
    let context = device.context().unwrap().clone();
    // SAFETY: the handles are of the headless device, which outlives the memory.
    let mut memory = unsafe {
        PlainMemory::new(
            context.instance(),
            context.physical_device(),
            context.device(),
        )
    };
    // So that writing makes calls, which can fail.
    memory.trusts_coherence = false;
    for path in DEVICE_PATHS {
        let mut culler =
            Culler::new(&context, &mut memory, &CullerDesc::new(path, &atlas)).unwrap();
        let mut batch = [0, 1].map(|slot| BatchEntry {
            slot,
            input,
            ticket: None,
        });
        let mut failed = 0;
        for nth in 1.. {
            shim::fail(Fault {
                call: "vkFlushMappedMemoryRanges",
                nth,
                result: vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            });
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
            let ended = device.run(|cmd| unsafe { culler.record_batch(cmd, &mut batch) });
            if shim::call_off() {
                ended.unwrap();
                break;
            }
            assert!(matches!(ended, Err(GpuError::Call { .. })), "{ended:?}");
            assert!(batch.iter().all(|entry| entry.ticket.is_none()), "{nth}");
            failed += 1;
        }
        // The stencil path writes nothing: its input is part of the commands.
        match path {
            CullPath::Stencil => assert_eq!(failed, 0),
            _ => assert!(failed >= 2, "{failed} flushes"),
        }
        for entry in &batch {
            let mut overlaps = Vec::new();
            assert!(culler.poll(entry.ticket.unwrap(), &mut overlaps).unwrap());
            assert_eq!(overlaps.len(), counted(&input).len());
        }
        // Refused before anything is written: the tickets of the time before are gone as well.
        batch[1].slot = 0;
        // SAFETY: as above.
        let ended = device.run(|cmd| unsafe { culler.record_batch(cmd, &mut batch) });
        assert!(matches!(ended, Err(GpuError::NoSuchSlot { .. })));
        assert!(batch.iter().all(|entry| entry.ticket.is_none()));
        culler.destroy(&mut memory);
    }
    drop(memory);
    let mut messages = device.destroy();
    // The price of so plain an allocator.
    messages.retain(|one| !one.id.contains("-small-"));
    assert!(messages.is_empty(), "{messages:#?}");
}
