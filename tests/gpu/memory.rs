//! Promise: the memory of a culler is known before it is created, 200 queries in flight take 64 MB at most beside the maps, and
//! most queries fit slots of that size.

use std::collections::BTreeMap;

use sabaki::gpu::{Block, Culler, CullerDesc, GpuError, Memory, MemoryDesc};
use sabaki::query::cull::{Counted, CullPath, Overlap, cpu};
use sabaki::query::{Query, QueryContext, QuerySettings};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::cull::{DEVICE_PATHS, Unmapped};
use sabaki_fixtures::throw::throws;
use sabaki_fixtures::{device, finish};

/// Notes the bytes that are asked for.
struct Counting<'a> {
    memory: &'a mut dyn Memory,
    live: BTreeMap<u64, u64>,
}

impl<'a> Counting<'a> {
    fn new(memory: &'a mut dyn Memory) -> Self {
        let live = BTreeMap::new();
        Self { memory, live }
    }
}

impl Memory for Counting<'_> {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        let block = self.memory.allocate(desc)?;
        self.live.insert(block.token, desc.requirements.size);
        Ok(block)
    }

    fn free(&mut self, block: Block) {
        self.live.remove(&block.token);
        self.memory.free(block);
    }
}

const MEGABYTE: u64 = 1_000_000;

#[test]
fn memory_is_known_before_creation() {
    let baked = embedded();
    let mut device = device();
    let context = device.context().unwrap().clone();
    let settings = QuerySettings::default();
    for path in DEVICE_PATHS {
        let plain = CullerDesc::new(path, baked.atlas());
        for desc in [plain, plain.for_settings(&settings, 200)] {
            let bytes = Culler::bytes(&context, &desc).unwrap();
            // Where the host writes the maps into the device's memory, there is no staging buffer.
            let mut memory = Counting::new(device.memory().unwrap());
            let culler = Culler::new(&context, &mut memory, &desc).unwrap();
            let (mapped, blocks) = (memory.live.values().sum::<u64>(), memory.live.len());
            culler.destroy(&mut memory);
            let mut unmapped = Unmapped(device.memory().unwrap());
            let mut memory = Counting::new(&mut unmapped);
            let culler = Culler::new(&context, &mut memory, &desc).unwrap();
            let taken: u64 = memory.live.values().sum();
            // Drivers round each buffer up.
            let rounded = 4096 * memory.live.len() as u64;
            let range = bytes..=bytes + rounded;
            assert!(range.contains(&taken), "{path:?}: {bytes}, {taken} taken");
            match blocks < memory.live.len() {
                true => assert!(mapped < bytes, "{path:?}: {mapped} of {bytes}"),
                false => assert_eq!(mapped, taken, "{path:?}"),
            }
            if desc.frames_in_flight == 200 {
                let one = plain.for_settings(&settings, 1);
                let beside = Culler::bytes(&context, &one).unwrap();
                let slots = (bytes - beside) / 199 * 200;
                println!("{path:?}: 200 queries take {slots} bytes, all with maps {taken}");
                assert!(slots <= 64 * MEGABYTE, "{path:?}: {slots}");
            }
            culler.destroy(&mut memory);
            assert_eq!(memory.live.len(), 0);
        }
    }
    finish(device);
}

/// Slots of that size hold the queries that are asked in practice.
#[test]
fn queries_fit_slots_made_for_their_settings() {
    let baked = embedded();
    let mut device = device();
    let settings = QuerySettings::default();
    let query = Query::new(baked, &settings);
    for path in DEVICE_PATHS {
        let mut desc = CullerDesc::new(path, baked.atlas());
        desc.counted = Counted::FOR_A_CHOICE;
        let desc = desc.for_settings(&settings, 1);
        let made = device.make(|context, memory| Culler::new(context, memory, &desc));
        let mut culler = made.unwrap();
        let mut cpu = cpu::Culler::default().counting(Counted::FOR_A_CHOICE);
        let (mut context, mut refused) = (QueryContext::default(), 0);
        let mut overlaps: Vec<Overlap> = Vec::new();
        for throw in throws(baked, 5, 100) {
            let session = query.start(throw.request(), &mut context);
            let input = session.cull_input();
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
            let ticket = match device.run(|cmd| unsafe { culler.record(cmd, 0, &input) }) {
                Ok(ticket) => ticket,
                Err(GpuError::Limit { .. }) => {
                    refused += 1;
                    continue;
                }
                Err(other) => panic!("{other}"),
            };
            assert!(culler.poll(ticket, &mut overlaps).unwrap());
            let mut expected = Vec::new();
            cpu.count(&input, &mut expected);
            for (found, expected) in overlaps.iter().zip(&expected) {
                assert_eq!(found.body > 0, expected.body > 0);
            }
        }
        println!("{path}: {refused} of 100 queries are refused");
        let most = if path == CullPath::Stencil { 0 } else { 25 };
        assert!(refused <= most, "{path}: {refused} of 100");
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}
