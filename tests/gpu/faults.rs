//! Promise: whichever Vulkan call fails, and whenever, there is a typed error, nothing leaks, and the host's device goes on.

#[path = "../../examples/common/plain_memory.rs"]
#[allow(dead_code)]
mod plain_memory;
use sabaki_fixtures::shim;

use std::{cell::RefCell, collections::BTreeMap, fs, path::Path};

use plain_memory::PlainMemory;
use sabaki::gpu::ash::vk;
use sabaki::gpu::{
    BatchEntry, Context, Culler, CullerDesc, GpuError, Memory, Rasterizer, RasterizerDesc,
};
use sabaki::maps::raster;
use sabaki::query::cull::CullPath;
use sabaki_fixtures::cull::{CullCase, DEVICE_PATHS, atlas, counted, drifting, map_rect, sliced};
use sabaki_fixtures::desc;
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::random::Random;
use shim::Fault;

use super::shimmed_device;

/// What a call that fails says, whichever call it is.
const RESULTS: [vk::Result; 4] = [
    vk::Result::ERROR_OUT_OF_HOST_MEMORY,
    vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    vk::Result::ERROR_DEVICE_LOST,
    vk::Result::ERROR_TOO_MANY_OBJECTS,
];

/// Names are a help, and no more: an object without one is no error.
const HELPS: &str = "vkSetDebugUtilsObjectNameEXT";

/// Lets every call of `work` fail, at its first use, its second one, and so on; `check` sees how each ended, and which fault there
/// was. The first use fails with every result, the later ones with one after the other. Returns the number of faults.
fn each_fault<T>(
    mut work: impl FnMut() -> Result<T, GpuError>,
    mut check: impl FnMut(Result<T, GpuError>, Option<Fault>),
) -> BTreeMap<&'static str, u32> {
    let before = shim::calls();
    check(work(), None);
    let used = shim::calls().into_iter();
    let used = used.filter(|(call, count)| before.get(call) != Some(count));
    let mut faults = BTreeMap::new();
    for (call, _) in used.collect::<Vec<_>>() {
        let first_use = RESULTS.map(|result| (1, result));
        let later = (2..).zip(RESULTS.into_iter().cycle());
        for (nth, result) in first_use.into_iter().chain(later) {
            let fault = Fault { call, nth, result };
            shim::fail(fault);
            let ended = work();
            if shim::call_off() {
                check(ended, None);
                break;
            }
            *faults.entry(call).or_default() += 1;
            check(ended, Some(fault));
        }
    }
    faults
}

/// The error is the one of the call that failed.
fn assert_typed(error: &GpuError, fault: Option<Fault>) {
    let Some(fault) = fault else {
        panic!("{error} without a fault")
    };
    let is_typed = match error {
        GpuError::Call { call, result } => {
            let is_lost = *result == vk::Result::ERROR_DEVICE_LOST;
            assert_eq!(error.is_device_lost(), is_lost);
            *call == fault.call && *result == fault.result
        }
        // An allocator's calls.
        GpuError::Memory { name, reason } => {
            !name.is_empty()
                && !reason.is_empty()
                && ["vkAllocateMemory", "vkMapMemory"].contains(&fault.call)
        }
        _ => false,
    };
    assert!(is_typed, "{error}: {fault:?}");
}

/// A device, and memory that is said not to be coherent, so that flushes and invalidates are made, which can fail.
fn device_and_memory() -> (Headless, PlainMemory) {
    let device = shimmed_device();
    let context = device.context().unwrap();
    let (instance, physical) = (context.instance(), context.physical_device());
    // SAFETY: the handles are of the headless device, which outlives the memory.
    let mut memory = unsafe { PlainMemory::new(instance, physical, context.device()) };
    memory.trusts_coherence = false;
    (device, memory)
}

/// Ends a device with such memory.
fn finish(device: Headless, memory: PlainMemory) {
    drop(memory);
    let mut messages = device.destroy();
    // The price of so plain an allocator, and no fault of the components.
    messages.retain(|one| !one.id.contains("-small-"));
    assert!(messages.is_empty(), "{messages:#?}");
}

/// Holds a component to its promise through all faults: it is made, used twice, the second time after a failed first use as well, and
/// destroyed. `owed` is what the CPU answers.
fn hold<C, T: PartialEq + std::fmt::Debug>(
    (device, memory): &(RefCell<Headless>, RefCell<PlainMemory>),
    make: impl Fn(&Context, &mut dyn Memory) -> Result<C, GpuError>,
    work: impl Fn(&mut Headless, &mut C) -> Result<T, GpuError>,
    destroy: impl Fn(C, &mut dyn Memory),
    owed: &T,
) -> BTreeMap<&'static str, u32> {
    let alive = shim::live();
    let use_twice = || {
        let context = device.borrow().context()?.clone();
        let mut made = make(&context, &mut *memory.borrow_mut())?;
        let uses = [(); 2].map(|()| work(&mut device.borrow_mut(), &mut made));
        destroy(made, &mut *memory.borrow_mut());
        let [first, second] = uses;
        Ok([first?, second?])
    };
    each_fault(use_twice, |ended, fault| {
        match ended {
            Ok(found) => {
                assert!(fault.is_none_or(|fault| fault.call == HELPS));
                assert_eq!(found.each_ref(), [owed; 2]);
            }
            Err(error) => assert_typed(&error, fault),
        }
        assert_eq!(memory.borrow().live_blocks(), 0, "{fault:?}");
        assert_eq!(shim::live(), alive, "{fault:?}");
    })
}

#[test]
fn every_call_of_every_component_and_of_the_headless_device() {
    let atlas = atlas(&mut Random::new(3), sliced(8), 6);
    let case = CullCase::that_hits(&mut Random::new(4), &atlas, 20);
    let input = case.input(&atlas);
    let owed = counted(&input);
    assert!(owed.iter().any(|one| one.body > 0));
    let mut of_all = vec![creation_of_a_device()];
    let (device, memory) = device_and_memory();
    let held = (RefCell::new(device), RefCell::new(memory));
    for path in DEVICE_PATHS {
        let desc = CullerDesc::new(path, &atlas);
        of_all.push(hold(
            &held,
            |context, memory| Culler::new(context, memory, &desc),
            |device, culler| device.cull(culler, &input),
            |culler, memory| culler.destroy(memory),
            &owed,
        ));
    }
    let rect = map_rect(0, 0, 40, 30);
    let drawings = [drifting(&mut Random::new(5), rect, 3, 4)];
    of_all.push(hold(
        &held,
        |context, memory| Rasterizer::new(context, memory, &RasterizerDesc::default()),
        |device, rasterizer| device.any_frame(rasterizer, &drawings),
        |rasterizer, memory| rasterizer.destroy(memory),
        &vec![raster::any_frame(&drawings[0])],
    ));
    finish(held.0.into_inner(), held.1.into_inner());
    assert_eq!(shim::live(), BTreeMap::new());
    let mut faults = BTreeMap::new();
    for (call, count) in of_all.into_iter().flatten() {
        *faults.entry(call).or_insert(0) += count;
    }

    // Every call that the crate itself names in an error has failed here.
    let (root, mut named) = (Path::new(env!("CARGO_MANIFEST_DIR")), Vec::new());
    calls_named_in(&root.join("src/gpu"), &mut named);
    for call in &named {
        let has_failed = faults.contains_key(&**call);
        assert!(has_failed, "{call} was never made to fail");
    }
    let all: u32 = faults.values().sum();
    println!("{all} faults of {} calls: {faults:#?}", faults.len());
    assert!(named.len() >= 15 && all > 400, "{} {all}", named.len());
}

/// A device of our own that fails half made leaves nothing behind either.
fn creation_of_a_device() -> BTreeMap<&'static str, u32> {
    each_fault(
        || {
            // SAFETY: the shim calls the system's loader.
            let device = unsafe { Headless::with_loader(shim::entry(), &desc()) }?;
            assert_eq!(device.destroy(), []);
            Ok(())
        },
        |ended, fault| {
            // Where the list of extensions cannot be had it is taken to be empty, which is no loss on Vulkan 1.3.
            let harmless = [HELPS, "vkEnumerateDeviceExtensionProperties"];
            match ended {
                Ok(()) => assert!(fault.is_none_or(|fault| harmless.contains(&fault.call))),
                Err(error) => assert_typed(&error, fault),
            }
            assert_eq!(shim::live(), BTreeMap::new(), "{fault:?}");
        },
    )
}

/// The names in `.call("vk...")`.
fn calls_named_in(folder: &Path, names: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            calls_named_in(&path, names);
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        for (at, opening) in text.match_indices(".call(\"vk") {
            let name = &text[at + opening.len() - 2..];
            names.push(name[..name.find('"').unwrap()].to_owned());
        }
    }
}

/// A batch that fails has no tickets, wherever it fails, and the culler goes on.
#[test]
fn a_batch_that_fails_has_no_tickets() {
    let atlas = atlas(&mut Random::new(3), sliced(8), 6);
    let case = CullCase::any(&mut Random::new(4), &atlas, 20);
    let input = case.input(&atlas);
    let (mut device, mut memory) = device_and_memory();
    let context = device.context().unwrap().clone();
    for path in DEVICE_PATHS {
        let desc = CullerDesc::new(path, &atlas);
        let mut culler = Culler::new(&context, &mut memory, &desc).unwrap();
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
    finish(device, memory);
}
