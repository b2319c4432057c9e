//! A loader between the crate and Vulkan. It counts what is made and destroyed, notes every call that can fail, makes a
//! chosen one fail, and can swallow a barrier. Its state is that of the thread: tests run side by side.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    ffi::{CStr, c_char, c_void},
    ptr::null,
};

use sabaki::gpu::ash::{self, vk};

/// The `nth` call of a function returns `result` without being made; 1 is the next one.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    pub call: &'static str,
    pub nth: u64,
    pub result: vk::Result,
}

/// Steps of a command buffer that concern data that the host reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostStep {
    /// A barrier that makes what these stages wrote available to the host.
    Barrier(vk::PipelineStageFlags2),
    /// A fill of one word.
    Number,
}

#[derive(Default)]
struct State {
    loader: Option<vk::PFN_vkGetInstanceProcAddr>,
    device_lookup: Option<vk::PFN_vkGetDeviceProcAddr>,
    real: BTreeMap<&'static str, usize>,
    calls: BTreeMap<&'static str, u64>,
    live: BTreeMap<&'static str, i64>,
    fault: Option<Fault>,
    barriers: u64,
    swallowed: Option<u64>,
    for_host: Vec<HostStep>,
    hidden: vk::QueueFlags,
    driver: Option<vk::DriverId>,
    copies: u64,
    labels: Vec<String>,
    caches: Vec<u64>,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

fn with<T>(change: impl FnOnce(&mut State) -> T) -> T {
    STATE.with(|state| change(&mut state.borrow_mut()))
}

/// The system's loader behind the shim.
pub fn entry() -> ash::Entry {
    // SAFETY: the system's Vulkan loader, which is never unloaded.
    let real = unsafe { ash::Entry::load() }.unwrap();
    let loader = real.static_fn().get_instance_proc_addr;
    std::mem::forget(real);
    with(|state| state.loader = Some(loader));
    let shim = ash::StaticFn {
        get_instance_proc_addr: instance_lookup,
    };
    // SAFETY: the shim hands out the loader's functions, or ones that call them.
    unsafe { ash::Entry::from_static_fn(shim) }
}

/// Objects that have not been destroyed, by the call that makes them.
pub fn live() -> BTreeMap<&'static str, i64> {
    let mut live = with(|state| state.live.clone());
    live.retain(|_, count| *count != 0);
    live
}

/// How often each call that can fail has been made so far.
pub fn calls() -> BTreeMap<&'static str, u64> {
    with(|state| state.calls.clone())
}

/// Makes a call fail, once.
pub fn fail(fault: Fault) {
    with(|state| state.fault = Some(fault));
}

/// Whether the fault has not come to pass; it is called off.
pub fn call_off() -> bool {
    with(|state| state.fault.take()).is_some()
}

/// Swallows the `nth` barrier from now on; 0 is the next one. `None`: none.
pub fn swallow_barrier(nth: Option<u64>) {
    with(|state| state.swallowed = nth.map(|nth| state.barriers + nth));
}

/// Barriers so far.
pub fn barriers() -> u64 {
    with(|state| state.barriers)
}

/// Steps for the host since this was asked last.
pub fn steps_for_host() -> Vec<HostStep> {
    with(|state| std::mem::take(&mut state.for_host))
}

/// Copies of query results so far.
pub fn copies_of_results() -> u64 {
    with(|state| state.copies)
}

/// Labels of passes since this was asked last.
pub fn labels() -> Vec<String> {
    with(|state| std::mem::take(&mut state.labels))
}

/// Pipeline cache of each creation of pipelines since this was asked last.
pub fn caches() -> Vec<u64> {
    with(|state| std::mem::take(&mut state.caches))
}

/// What queue families are said not to be able to do.
pub fn hide_queue_flags(flags: vk::QueueFlags) {
    with(|state| state.hidden = flags);
}

/// Whose driver every device is said to have.
pub fn pretend_driver(driver: Option<vk::DriverId>) {
    with(|state| state.driver = driver);
}

/// Counts a call; says with what it fails.
fn enter(name: &'static str) -> Option<vk::Result> {
    with(|state| {
        *state.calls.entry(name).or_default() += 1;
        let fault = state.fault.as_mut().filter(|fault| fault.call == name)?;
        fault.nth -= 1;
        if fault.nth > 0 {
            return None;
        }
        state.fault.take().map(|fault| fault.result)
    })
}

fn real(name: &'static str) -> usize {
    with(|state| state.real[name])
}

fn made(name: &'static str, count: i64) {
    // Destroyed by one call.
    let name = match name {
        "vkCreateGraphicsPipelines" | "vkCreateComputePipelines" => "vkCreatePipelines",
        other => other,
    };
    with(|state| *state.live.entry(name).or_default() += count);
}

type Wrapper = (&'static str, *const c_void);

/// A call that can fail; `$count` objects are there after it.
macro_rules! fallible {
    ($name:ident($($argument:ident: $kind:ty),*) $(makes $count:expr)? $(, by $cache:expr)?) => {{
        unsafe extern "system" fn wrapper($($argument: $kind),*) -> vk::Result {
            const NAME: &str = stringify!($name);
            $(with(|state| state.caches.push($cache));)?
            if let Some(result) = enter(NAME) {
                return result;
            }
            type Real = unsafe extern "system" fn($($kind),*) -> vk::Result;
            // SAFETY: what Vulkan has by this name is of this type, and takes the caller's arguments.
            let result = unsafe { std::mem::transmute::<usize, Real>(real(NAME))($($argument),*) };
            $(if result == vk::Result::SUCCESS { made(NAME, i64::from($count)); })?
            result
        }
        (stringify!($name), wrapper as *const c_void)
    }};
}

/// A call that destroys what `$maker` has made.
macro_rules! destroying {
    ($name:ident(owner, object) of $maker:ident) => {{
        unsafe extern "system" fn wrapper(owner: u64, object: u64, callbacks: *const c_void) {
            type Real = unsafe extern "system" fn(u64, u64, *const c_void);
            made(stringify!($maker), -i64::from(object != 0));
            // SAFETY: as for the calls that can fail.
            unsafe {
                let function = std::mem::transmute::<usize, Real>(real(stringify!($name)));
                function(owner, object, callbacks);
            }
        }
        (stringify!($name), wrapper as *const c_void)
    }};
    ($name:ident(object) of $maker:ident) => {{
        unsafe extern "system" fn wrapper(object: u64, callbacks: *const c_void) {
            type Real = unsafe extern "system" fn(u64, *const c_void);
            made(stringify!($maker), -i64::from(object != 0));
            // SAFETY: as for the calls that can fail.
            unsafe {
                std::mem::transmute::<usize, Real>(real(stringify!($name)))(object, callbacks);
            }
        }
        (stringify!($name), wrapper as *const c_void)
    }};
}

macro_rules! creating {
    ($($name:ident $destroyer:ident,)*) => {
        vec![$(
            fallible!($name(owner: u64, info: *const c_void, callbacks: *const c_void, object: *mut u64) makes 1),
            destroying!($destroyer(owner, object) of $name),
        )*]
    };
}

/// Every wrapped function. Handles are 64 bits wide, as on every platform that the tests run on.
fn wrappers() -> Vec<Wrapper> {
    let mut all = creating! {
        vkCreateDebugUtilsMessengerEXT vkDestroyDebugUtilsMessengerEXT,
        vkCreateBuffer vkDestroyBuffer,
        vkCreateBufferView vkDestroyBufferView,
        vkCreateImage vkDestroyImage,
        vkCreateImageView vkDestroyImageView,
        vkCreateShaderModule vkDestroyShaderModule,
        vkCreatePipelineLayout vkDestroyPipelineLayout,
        vkCreateDescriptorSetLayout vkDestroyDescriptorSetLayout,
        vkCreateDescriptorPool vkDestroyDescriptorPool,
        vkCreateQueryPool vkDestroyQueryPool,
        vkCreatePipelineCache vkDestroyPipelineCache,
        vkCreateCommandPool vkDestroyCommandPool,
        vkCreateFence vkDestroyFence,
        vkCreateSemaphore vkDestroySemaphore,
        vkAllocateMemory vkFreeMemory,
    };
    type Pointer = *const c_void;
    all.extend([
        fallible!(vkCreateDevice(device: u64, info: Pointer, callbacks: Pointer, object: Pointer) makes 1),
        fallible!(vkCreateInstance(info: Pointer, callbacks: Pointer, instance: Pointer) makes 1),
        destroying!(vkDestroyInstance(object) of vkCreateInstance),
        destroying!(vkDestroyDevice(object) of vkCreateDevice),
        fallible!(vkCreateGraphicsPipelines(device: u64, cache: u64, count: u32, infos: Pointer, callbacks: Pointer, pipelines: Pointer) makes count, by cache),
        fallible!(vkCreateComputePipelines(device: u64, cache: u64, count: u32, infos: Pointer, callbacks: Pointer, pipelines: Pointer) makes count, by cache),
        destroying!(vkDestroyPipeline(owner, object) of vkCreatePipelines),
        fallible!(vkGetPipelineCacheData(device: u64, cache: u64, size: Pointer, data: Pointer)),
        fallible!(vkEnumerateInstanceLayerProperties(count: Pointer, layers: Pointer)),
        fallible!(vkEnumeratePhysicalDevices(instance: u64, count: Pointer, devices: Pointer)),
        fallible!(vkEnumerateDeviceExtensionProperties(device: u64, layer: Pointer, count: Pointer, extensions: Pointer)),
        fallible!(vkSetDebugUtilsObjectNameEXT(device: u64, info: Pointer)),
        fallible!(vkBindBufferMemory(device: u64, buffer: u64, memory: u64, offset: u64)),
        fallible!(vkBindImageMemory(device: u64, image: u64, memory: u64, offset: u64)),
        fallible!(vkMapMemory(device: u64, memory: u64, offset: u64, size: u64, flags: u32, data: Pointer)),
        fallible!(vkFlushMappedMemoryRanges(device: u64, count: u32, ranges: Pointer)),
        fallible!(vkInvalidateMappedMemoryRanges(device: u64, count: u32, ranges: Pointer)),
        fallible!(vkAllocateDescriptorSets(device: u64, info: Pointer, sets: Pointer)),
        fallible!(vkAllocateCommandBuffers(device: u64, info: Pointer, buffers: Pointer)),
        fallible!(vkResetCommandPool(device: u64, pool: u64, flags: u32)),
        fallible!(vkBeginCommandBuffer(buffer: u64, info: Pointer)),
        fallible!(vkEndCommandBuffer(buffer: u64)),
        fallible!(vkQueueSubmit2(queue: u64, count: u32, submits: Pointer, fence: u64)),
        fallible!(vkQueueSubmit(queue: u64, count: u32, submits: Pointer, fence: u64)),
        fallible!(vkWaitForFences(device: u64, count: u32, fences: Pointer, all: u32, timeout: u64)),
        fallible!(vkWaitSemaphores(device: u64, info: Pointer, timeout: u64)),
        fallible!(vkResetFences(device: u64, count: u32, fences: Pointer)),
        fallible!(vkGetFenceStatus(device: u64, fence: u64)),
        fallible!(vkGetQueryPoolResults(device: u64, pool: u64, first: u32, count: u32, size: usize, data: Pointer, stride: u64, flags: u32)),
        fallible!(vkQueueWaitIdle(queue: u64)),
        fallible!(vkDeviceWaitIdle(device: u64)),
        ("vkCmdPipelineBarrier2", barrier as Pointer),
        ("vkCmdFillBuffer", fill as Pointer),
        ("vkCmdBeginDebugUtilsLabelEXT", begin_label as Pointer),
        ("vkCmdCopyQueryPoolResults", copy_results as Pointer),
        ("vkGetPhysicalDeviceQueueFamilyProperties", queue_families as Pointer),
        ("vkGetPhysicalDeviceProperties2", properties as Pointer),
        ("vkGetInstanceProcAddr", instance_lookup as Pointer),
        ("vkGetDeviceProcAddr", device_lookup as Pointer),
    ]);
    all
}

unsafe extern "system" fn fill(buffer: u64, target: u64, offset: u64, size: u64, word: u32) {
    if size == 4 {
        with(|state| state.for_host.push(HostStep::Number));
    }
    type Real = unsafe extern "system" fn(u64, u64, u64, u64, u32);
    let function = real("vkCmdFillBuffer");
    // SAFETY: as for the calls that can fail.
    unsafe { std::mem::transmute::<usize, Real>(function)(buffer, target, offset, size, word) };
}

unsafe extern "system" fn barrier(buffer: u64, info: *const vk::DependencyInfo<'_>) {
    // SAFETY: the caller gives as many barriers as it says.
    let barriers = unsafe {
        match (*info).memory_barrier_count {
            0 => &[],
            count => std::slice::from_raw_parts((*info).p_memory_barriers, count as usize),
        }
    };
    let for_host = |one: &&vk::MemoryBarrier2<'_>| {
        let (stage, access) = (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
        one.dst_stage_mask.contains(stage) && one.dst_access_mask.contains(access)
    };
    let swallow = with(|state| {
        state.barriers += 1;
        let steps = barriers.iter().filter(for_host);
        let steps = steps.map(|one| HostStep::Barrier(one.src_stage_mask));
        state.for_host.extend(steps);
        state.swallowed == Some(state.barriers - 1)
    });
    if swallow {
        return;
    }
    type Real = unsafe extern "system" fn(u64, *const vk::DependencyInfo<'_>);
    // SAFETY: as for the calls that can fail.
    unsafe { std::mem::transmute::<usize, Real>(real("vkCmdPipelineBarrier2"))(buffer, info) };
}

unsafe extern "system" fn begin_label(buffer: u64, info: *const vk::DebugUtilsLabelEXT<'_>) {
    // SAFETY: the caller gives a label, whose name ends with a zero byte.
    let name = unsafe { CStr::from_ptr((*info).p_label_name) };
    let name = name.to_string_lossy().into_owned();
    with(|state| state.labels.push(name));
    type Real = unsafe extern "system" fn(u64, *const vk::DebugUtilsLabelEXT<'_>);
    let function = real("vkCmdBeginDebugUtilsLabelEXT");
    // SAFETY: as for the calls that can fail.
    unsafe { std::mem::transmute::<usize, Real>(function)(buffer, info) };
}

unsafe extern "system" fn copy_results(
    buffer: u64,
    pool: u64,
    first: u32,
    count: u32,
    target: u64,
    offset: u64,
    stride: u64,
    flags: u32,
) {
    with(|state| state.copies += 1);
    type Real = unsafe extern "system" fn(u64, u64, u32, u32, u64, u64, u64, u32);
    // SAFETY: as for the calls that can fail.
    unsafe {
        let function = std::mem::transmute::<usize, Real>(real("vkCmdCopyQueryPoolResults"));
        function(buffer, pool, first, count, target, offset, stride, flags);
    }
}

unsafe extern "system" fn queue_families(
    device: u64,
    count: *mut u32,
    families: *mut vk::QueueFamilyProperties,
) {
    type Real = unsafe extern "system" fn(u64, *mut u32, *mut vk::QueueFamilyProperties);
    let function = real("vkGetPhysicalDeviceQueueFamilyProperties");
    // SAFETY: as for the calls that can fail; Vulkan has written as many families as it says.
    unsafe {
        std::mem::transmute::<usize, Real>(function)(device, count, families);
        if !families.is_null() {
            let hidden = with(|state| state.hidden);
            for family in std::slice::from_raw_parts_mut(families, *count as usize) {
                family.queue_flags &= !hidden;
            }
        }
    }
}

unsafe extern "system" fn properties(device: u64, all: *mut vk::PhysicalDeviceProperties2<'_>) {
    type Real = unsafe extern "system" fn(u64, *mut vk::PhysicalDeviceProperties2<'_>);
    let function = real("vkGetPhysicalDeviceProperties2");
    // SAFETY: as for the calls that can fail; the structures of a chain begin alike.
    unsafe {
        std::mem::transmute::<usize, Real>(function)(device, all);
        let mut next = (*all).p_next.cast::<vk::BaseOutStructure<'_>>();
        while let Some(one) = next.as_mut() {
            let is_driver = one.s_type == vk::StructureType::PHYSICAL_DEVICE_DRIVER_PROPERTIES;
            if let (true, Some(driver)) = (is_driver, with(|state| state.driver)) {
                let place = next.cast::<vk::PhysicalDeviceDriverProperties<'_>>();
                (*place).driver_id = driver;
            }
            next = one.p_next.cast();
        }
    }
}

/// The shim's function of this name in place of the real one, which is noted.
fn wrap(name: &CStr, found: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
    let found = found? as *const c_void;
    let wrapped = wrappers()
        .into_iter()
        .find(|(wrapped, _)| wrapped.as_bytes() == name.to_bytes());
    let function = wrapped.map_or(found, |(name, wrapper)| {
        with(|state| state.real.insert(name, found as usize));
        wrapper
    });
    // SAFETY: both are functions, which their caller takes for what their name says.
    unsafe { std::mem::transmute::<*const c_void, vk::PFN_vkVoidFunction>(function) }
}

unsafe extern "system" fn instance_lookup(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    let loader = with(|state| state.loader)?;
    // SAFETY: the caller's arguments; names end with a zero byte.
    let (name, found) = unsafe { (CStr::from_ptr(name), loader(instance, name)) };
    if name == c"vkGetDeviceProcAddr" {
        let found = found.map_or(null(), |function| function as *const c_void);
        // SAFETY: it is the function of that name.
        let lookup = unsafe {
            std::mem::transmute::<*const c_void, Option<vk::PFN_vkGetDeviceProcAddr>>(found)
        };
        with(|state| state.device_lookup = lookup);
    }
    wrap(name, found)
}

unsafe extern "system" fn device_lookup(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    let lookup = with(|state| state.device_lookup)?;
    // SAFETY: as above.
    let (name, found) = unsafe { (CStr::from_ptr(name), lookup(device, name)) };
    wrap(name, found)
}
