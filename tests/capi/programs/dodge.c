/* A renderer in C: its own Vulkan device, found without any Vulkan header but the few declarations below; opens a
 * baked graph, asks how to avoid a ball by both paths, submits, polls, and prints the answers.
 *
 *     dodge BAKED
 */
#define _POSIX_C_SOURCE 200112L
#include <dlfcn.h>
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sabaki.h"

/* What of Vulkan this program needs. A renderer includes <vulkan/vulkan.h>. */
typedef void (*Function)(void);
typedef Function (*GetInstanceProcAddr)(void *, const char *);
typedef struct { uint32_t type; const void *next; const char *app; uint32_t v; const char *engine; uint32_t w, api; } AppInfo;
typedef struct { uint32_t type; const void *next; uint32_t flags; const AppInfo *app; uint32_t layers; const char *const *l; uint32_t extensions; const char *const *e; } InstanceInfo;
typedef struct { uint32_t type; const void *next; uint32_t flags, family, count; const float *priorities; } QueueInfo;
typedef struct { uint32_t type; const void *next; uint32_t value; } OneFeature;
typedef struct { uint32_t type; const void *next; uint32_t flags, queues; const QueueInfo *q; uint32_t layers; const char *const *l; uint32_t extensions; const char *const *e; const uint32_t *features; } DeviceInfo;
typedef struct { uint32_t type; const void *next; uint32_t flags, family; } PoolInfo;
typedef struct { uint32_t type; const void *next; uint64_t pool; uint32_t level, count; } BufferInfo;
typedef struct { uint32_t type; const void *next; uint32_t flags; const void *inheritance; } BeginInfo;
typedef struct { uint32_t type; const void *next; uint32_t waits; const void *w; const void *stages; uint32_t buffers; void *const *b; uint32_t signals; const void *s; } SubmitInfo;
typedef struct { uint32_t type; const void *next; uint64_t size; uint32_t index; } MemoryInfo;
typedef struct { uint32_t type; const void *next; uint32_t flags; uint64_t size; const void *data; } CacheInfo;
typedef struct { uint32_t count; struct { uint32_t flags, heap; } types[32]; uint32_t heaps; struct { uint64_t size; uint32_t flags; } h[16]; } MemoryProperties;
enum { FEATURES = 55, PRECISE = 23 }; /* booleans of VkPhysicalDeviceFeatures, and position of occlusionQueryPrecise */

static void *instance, *physical_device, *device;
static GetInstanceProcAddr lookup;

#define CALL(name, ...) ((int32_t(*)())lookup(instance, name))(__VA_ARGS__)

static void fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, sabaki_last_error());
    exit(1);
}

static void check(int32_t result, const char *what) {
    if (result != 0) fail(what);
}

static sabaki_device make_device(void) {
    void *loader = dlopen("libvulkan.so.1", RTLD_NOW);
    if (!loader) fail("libvulkan.so.1");
    lookup = (GetInstanceProcAddr)dlsym(loader, "vkGetInstanceProcAddr");
    const uint32_t api = 1u << 22 | 3u << 12;
    AppInfo app = {0};
    app.api = api;
    InstanceInfo info = {1, 0, 0, &app, 0, 0, 0, 0};
    check(CALL("vkCreateInstance", &info, (void *)0, &instance), "vkCreateInstance");
    uint32_t count = 1;
    int32_t found = CALL("vkEnumeratePhysicalDevices", instance, &count, &physical_device);
    if (found < 0 || count == 0) fail("no device");

    sabaki_device host = {0};
    host.size = sizeof host;
    host.get_instance_proc_addr = (void *)lookup;
    host.instance = instance;
    host.physical_device = physical_device;
    host.api_version = api;
    char text[512] = "";
    check(sabaki_check(&host, text, sizeof text), "sabaki_check");
    printf("%s", text);

    const float priority = 1.0f;
    uint32_t features[FEATURES] = {0};
    features[PRECISE] = strstr(text, "occlusionQueryPrecise") ? 0 : 1;
    OneFeature rendering = {1000044003, 0, 1}, synchronization = {1000314007, &rendering, 1};
    QueueInfo queue = {2, 0, 0, 0, 1, &priority};
    DeviceInfo wanted = {3, &synchronization, 0, 1, &queue, 0, 0, 0, 0, features};
    check(CALL("vkCreateDevice", physical_device, &wanted, (void *)0, &device), "vkCreateDevice");
    host.device = device;
    host.precise_queries = features[PRECISE];
    check(sabaki_check(&host, text, sizeof text), "sabaki_check");
    if (!strstr(text, "stencil: lacks dynamicRendering") || !strstr(text, "compute: runs")) fail("a path that lacks a feature");
    host.dynamic_rendering = host.synchronization2 = 1;
    check(sabaki_check(&host, text, sizeof text), "sabaki_check");
    if (!strstr(text, "stencil: runs")) fail("the stencil path");
    return host;
}

/* An allocator of the renderer's own: a VkDeviceMemory for each block, which host and device see alike. */
typedef struct { int live, most, unmapped; } Blocks;

static sabaki_status allocate(void *user, const sabaki_memory_desc *desc, sabaki_block *block) {
    Blocks *blocks = user;
    MemoryProperties properties;
    uint32_t type = 0;
    const uint32_t visible_and_coherent = 2 | 4;
    if (desc->usage > SABAKI_MEMORY_READBACK || !desc->name[0] || !desc->buffer == !desc->image) fail("a request for memory");
    if (blocks->live == blocks->most) return SABAKI_ERROR;
    CALL("vkGetPhysicalDeviceMemoryProperties", physical_device, &properties);
    while (type < properties.count && !(desc->memory_type_bits >> type & 1 && (properties.types[type].flags & visible_and_coherent) == visible_and_coherent)) type++;
    if (type == properties.count) return SABAKI_ERROR;
    MemoryInfo info = {5, 0, desc->size, type};
    check(CALL("vkAllocateMemory", device, &info, (void *)0, &block->memory), "vkAllocateMemory");
    check(CALL("vkMapMemory", device, block->memory, (uint64_t)0, ~(uint64_t)0, 0, &block->mapped), "vkMapMemory");
    block->size = desc->size;
    block->coherent = 1;
    if (blocks->unmapped && desc->usage == SABAKI_MEMORY_DEVICE) block->mapped = 0;
    block->token = (uint64_t)++blocks->live;
    return SABAKI_OK;
}

static void release(void *user, const sabaki_block *block) {
    if (!block->token) fail("a block of somebody else");
    ((Blocks *)user)->live--;
    CALL("vkFreeMemory", device, block->memory, (void *)0);
}

/* The renderer's own memory for the objects of the driver. */
typedef struct { void *user; void *(*allocate)(void *, size_t, size_t, int); void *(*again)(void *, void *, size_t, size_t, int); void (*release)(void *, void *); void *internal[2]; } Callbacks;

static void *host_allocate(void *user, size_t size, size_t alignment, int scope) {
    void *memory = 0;
    (void)scope;
    if (posix_memalign(&memory, alignment < sizeof(void *) ? sizeof(void *) : alignment, size)) return 0;
    ((int *)user)[0]++;
    ((int *)user)[1]++;
    return memory;
}

static void host_release(void *user, void *memory) {
    if (memory) ((int *)user)[0]--;
    free(memory);
}

static void *host_allocate_again(void *user, void *before, size_t size, size_t alignment, int scope) {
    void *memory = host_allocate(user, size, alignment, scope);
    const size_t had = before ? malloc_usable_size(before) : 0;
    if (memory && before) memcpy(memory, before, had < size ? had : size);
    if (memory) host_release(user, before);
    return memory;
}

/* Memory that ends at any block is an error, and leaves none behind. */
static void run_out_of_memory(const sabaki_graph *graph, sabaki_device host, sabaki_path path) {
    Blocks blocks = {0, 0, 0};
    const sabaki_allocator allocator = {sizeof allocator, &blocks, allocate, release};
    sabaki_culler *culler = 0;
    host.allocator = &allocator;
    while (sabaki_culler_create(graph, &host, path, 1, &culler) != SABAKI_OK) {
        if (culler || blocks.live || !strstr(sabaki_last_error(), "allocator")) fail("out of memory");
        if (++blocks.most > 64) fail("enough memory");
    }
    printf("%d blocks\n", blocks.live);
    if (blocks.live != blocks.most) fail("the number of blocks");
    sabaki_culler_destroy(culler);
    if (blocks.live) fail("blocks that were not released");
}

/* The functions of the device, with flushes that fail as long as `flushes_fail` is a result. */
static int flushes_fail;
static Function (*device_lookup)(void *, const char *);
static int32_t (*real_flush)(void *, uint32_t, const void *);

static int32_t flush(void *owner, uint32_t count, const void *ranges) {
    if (flushes_fail) return flushes_fail;
    return real_flush(owner, count, ranges);
}

static Function find_of_device(void *owner, const char *name) {
    Function found = device_lookup(owner, name);
    if (strcmp(name, "vkFlushMappedMemoryRanges") != 0) return found;
    real_flush = (int32_t(*)(void *, uint32_t, const void *))found;
    return (Function)flush;
}

static Function find(void *owner, const char *name) {
    Function found = lookup(owner, name);
    if (strcmp(name, "vkGetDeviceProcAddr") != 0) return found;
    device_lookup = (Function(*)(void *, const char *))found;
    return (Function)find_of_device;
}

static sabaki_status allocate_incoherent(void *user, const sabaki_memory_desc *desc, sabaki_block *block) {
    sabaki_status status = allocate(user, desc, block);
    block->coherent = 0;
    return status;
}

/* A call that fails while a query is recorded (only the compute path makes calls that can) leaves the answer to the CPU, also that of a lost device. */
static void fail_to_record(const sabaki_graph *graph, sabaki_device host) {
    Blocks blocks = {0, 64, 0};
    const sabaki_allocator allocator = {sizeof allocator, &blocks, allocate_incoherent, release};
    host.allocator = &allocator;
    host.get_instance_proc_addr = (void *)find;
    sabaki_culler *culler = 0;
    check(sabaki_culler_create(graph, &host, SABAKI_COMPUTE, 1, &culler), "sabaki_culler_create");
    const sabaki_place place = {0, 0.0f, 2.0f, -1.0f, 0.5f};
    const sabaki_key ball[2] = {{0, 0.9f, {3.4f, 1.5f, 1.6f}, 0.1f}, {0, 1.4f, {1.5f, 1.5f, -1.9f}, 0.1f}};
    sabaki_answer answer = {sizeof answer, 0, 0, 0, 0, 0, 0}, lost = answer;
    void *commands = &blocks; /* Nothing is recorded. */
    if (sabaki_record(culler, 0, 0, &place, ball, 2) != SABAKI_ERROR) fail("no command buffer");
    if (!strstr(sabaki_last_error(), "commands is NULL")) fail("the words for it");
    flushes_fail = -1; /* VK_ERROR_OUT_OF_HOST_MEMORY */
    check(sabaki_record(culler, 0, commands, &place, ball, 2), "sabaki_record");
    check(sabaki_poll(culler, 0, &answer), "sabaki_poll");
    if (!answer.counted_by_cpu) fail("who counted");
    if (sabaki_record(culler, 0, commands, &place, ball, 0) != SABAKI_ERROR) fail("an attack of nothing");
    sabaki_place then;
    check(sabaki_sample_place(culler, 0, 1.0f, &then), "an answer after a question that was refused");
    flushes_fail = -4; /* VK_ERROR_DEVICE_LOST */
    if (sabaki_record(culler, 0, commands, &place, ball, 2) != SABAKI_DEVICE_LOST) fail("a lost device");
    check(sabaki_answer_now(culler, 0, &lost), "sabaki_answer_now");
    if (memcmp(&answer, &lost, sizeof answer) != 0) fail("answers differ");
    flushes_fail = 0;
    sabaki_culler_destroy(culler);
    if (blocks.live) fail("blocks that were not released");
}

/* One query from question to answer. Returns whether the ball is avoided. */
static int dodge(const sabaki_graph *graph, const sabaki_device *host, sabaki_path path) {
    sabaki_culler *culler = 0;
    check(sabaki_culler_create(graph, host, path, 2, &culler), "sabaki_culler_create");
    const Blocks *blocks = host->allocator ? host->allocator->user : 0;
    const int made = blocks ? blocks->live : 0;
    /* Before the device has the maps, they stay. */
    check(sabaki_release_staging(culler), "sabaki_release_staging");
    if (blocks && blocks->live != made) fail("maps that the device does not have yet");

    void *queue = 0, *commands = 0;
    uint64_t pool = 0;
    CALL("vkGetDeviceQueue", device, 0, 0, &queue);
    PoolInfo pool_info = {39, 0, 0, 0};
    check(CALL("vkCreateCommandPool", device, &pool_info, (void *)0, &pool), "vkCreateCommandPool");
    BufferInfo buffer_info = {40, 0, pool, 0, 1};
    check(CALL("vkAllocateCommandBuffers", device, &buffer_info, &commands), "vkAllocateCommandBuffers");
    BeginInfo begin = {42, 0, 1, 0};
    check(CALL("vkBeginCommandBuffer", commands, &begin), "vkBeginCommandBuffer");

    /* The character at the start of the first edge, and a ball that will fly at its head. */
    const sabaki_place place = {0, 0.0f, 2.0f, -1.0f, 0.5f};
    const sabaki_key ball[2] = {{0, 0.9f, {3.4f, 1.5f, 1.6f}, 0.1f}, {0, 1.4f, {1.5f, 1.5f, -1.9f}, 0.1f}};
    sabaki_answer answer = {sizeof answer, 0, 0, 0, 0, 0, 0}, by_cpu = answer;
    check(sabaki_record(culler, 1, commands, &place, ball, 2), "sabaki_record");
    if (sabaki_poll(culler, 1, &answer) != SABAKI_NOT_YET) fail("answered before the device has run");
    check(CALL("vkEndCommandBuffer", commands), "vkEndCommandBuffer");
    SubmitInfo submit = {4, 0, 0, 0, 0, 1, &commands, 0, 0};
    check(CALL("vkQueueSubmit", queue, 1, &submit, (uint64_t)0), "vkQueueSubmit");
    sabaki_status status;
    while ((status = sabaki_poll(culler, 1, &answer)) == SABAKI_NOT_YET) {
    }
    check(status, "sabaki_poll");
    check(CALL("vkDeviceWaitIdle", device), "vkDeviceWaitIdle");
    check(sabaki_release_staging(culler), "sabaki_release_staging");
    if (blocks && blocks->live != made - 1) fail("staging memory that was not released");

    /* The same question twice in one batch, the second slot first. */
    check(CALL("vkResetCommandPool", device, pool, 0), "vkResetCommandPool");
    check(CALL("vkBeginCommandBuffer", commands, &begin), "vkBeginCommandBuffer");
    const sabaki_query queries[2] = {{sizeof queries[0], 1, &place, ball, 2}, {sizeof queries[0], 0, &place, ball, 2}};
    const sabaki_query same_slot[2] = {queries[0], queries[0]};
    if (sabaki_record_batch(culler, commands, same_slot, 2) != SABAKI_ERROR) fail("a slot twice");
    check(sabaki_record_batch(culler, commands, queries, 2), "sabaki_record_batch");
    check(CALL("vkEndCommandBuffer", commands), "vkEndCommandBuffer");
    check(CALL("vkQueueSubmit", queue, 1, &submit, (uint64_t)0), "vkQueueSubmit");
    check(CALL("vkDeviceWaitIdle", device), "vkDeviceWaitIdle");
    uint32_t slot;
    for (slot = 0; slot < 2; slot++) {
        sabaki_answer one = {sizeof one, 0, 0, 0, 0, 0, 0};
        check(sabaki_poll(culler, slot, &one), "sabaki_poll");
        if (memcmp(&answer, &one, sizeof answer) != 0) fail("one of a batch differs");
    }

    /* What is wrong is refused, and said. */
    if (sabaki_record(culler, 2, commands, &place, ball, 2) != SABAKI_ERROR) fail("a slot that is not there");
    if (sabaki_record(culler, 0, commands, &place, ball, 0) != SABAKI_ERROR) fail("an attack of nothing");
    if (!strstr(sabaki_last_error(), "no spheres")) fail("the words for it");
    const sabaki_key mixed[3] = {ball[0], {7, 0.9f, {3.4f, 1.5f, 1.6f}, 0.1f}, ball[1]};
    if (sabaki_record(culler, 0, commands, &place, mixed, 3) != SABAKI_ERROR) fail("keys that stand apart");
    if (!strstr(sabaki_last_error(), "keys of sphere 0 do not stand together")) fail("the words for it");

    /* Where the character is at the ball's last moment: its spheres are as far from the ball as the answer says, or further. */
    uint32_t count = sabaki_graph_spheres(graph), i;
    sabaki_sphere *body = calloc(count, sizeof *body);
    check(sabaki_sample_spheres(culler, 1, 1.4f, body, count), "sabaki_sample_spheres");
    float nearest = 1e9f;
    for (i = 0; i < count; i++) {
        float square = 0.0f, root = 1e3f;
        int axis, step;
        for (axis = 0; axis < 3; axis++) {
            float d = body[i].center[axis] - ball[1].center[axis];
            square += d * d;
        }
        for (step = 0; step < 60; step++) root = 0.5f * (root + square / root);
        if (root - body[i].radius - ball[1].radius < nearest) nearest = root - body[i].radius - ball[1].radius;
    }
    if (nearest < answer.clearance - 1e-3f) fail("nearer than the answer says");
    free(body);
    sabaki_place then;
    check(sabaki_sample_place(culler, 1, 1.4f, &then), "sabaki_sample_place");
    if (then.edge >= sabaki_graph_edges(graph)) fail("a place that is not in the graph");

    /* The same question to the CPU, with its buffer never submitted. */
    check(CALL("vkResetCommandPool", device, pool, 0), "vkResetCommandPool");
    check(CALL("vkBeginCommandBuffer", commands, &begin), "vkBeginCommandBuffer");
    check(sabaki_record(culler, 0, commands, &place, ball, 2), "sabaki_record");
    check(sabaki_answer_now(culler, 0, &by_cpu), "sabaki_answer_now");
    if (answer.counted_by_cpu || !by_cpu.counted_by_cpu) fail("who counted");
    by_cpu.counted_by_cpu = 0;
    if (memcmp(&answer, &by_cpu, sizeof answer) != 0) fail("device and CPU differ");

    printf("%s: avoided %u, clearance %.4f m, %u candidates, %u removed\n", path == SABAKI_STENCIL ? "stencil" : "compute",
           answer.avoided, answer.clearance, answer.candidates, answer.removed);
    CALL("vkDestroyCommandPool", device, pool, (void *)0);
    sabaki_culler_destroy(culler);
    return (int)answer.avoided;
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    sabaki_graph *graph = 0;
    if (sabaki_graph_open("/no/such/file", &graph) != SABAKI_ERROR || graph) fail("a file that is not there");
    check(sabaki_graph_open(arguments[1], &graph), "sabaki_graph_open");
    printf("%u joints, the first is %s\n", sabaki_graph_joints(graph), sabaki_graph_joint_name(graph, 0));
    sabaki_device host = make_device();
    int avoided = dodge(graph, &host, SABAKI_STENCIL);
    Blocks blocks = {0, 64, 1};
    const sabaki_allocator allocator = {sizeof allocator, &blocks, allocate, release};
    host.allocator = &allocator;
    int objects[2] = {0, 0};
    const Callbacks callbacks = {objects, host_allocate, host_allocate_again, host_release, {0, 0}};
    host.allocation_callbacks = &callbacks;
    CacheInfo cache_info = {17, 0, 0, 0, 0};
    check(CALL("vkCreatePipelineCache", device, &cache_info, (void *)0, &host.pipeline_cache), "vkCreatePipelineCache");
    avoided = dodge(graph, &host, SABAKI_COMPUTE) && avoided;
    CALL("vkDestroyPipelineCache", device, host.pipeline_cache, (void *)0);
    host.pipeline_cache = 0;
    if (objects[0] != 0 || objects[1] < 5) fail("objects in the renderer's memory");
    host.allocation_callbacks = 0;
    if (blocks.live) fail("blocks that were not released");
    sabaki_culler *culler = 0;
    if (sabaki_culler_create(graph, &host, SABAKI_COMPUTE, UINT32_MAX, &culler) != SABAKI_ERROR) fail("too many slots");
    if (!strstr(sabaki_last_error(), "4096") || culler) fail("the words for it");
    run_out_of_memory(graph, host, SABAKI_STENCIL);
    run_out_of_memory(graph, host, SABAKI_COMPUTE);
    fail_to_record(graph, host);
    sabaki_graph_close(graph);
    CALL("vkDestroyDevice", device, (void *)0);
    CALL("vkDestroyInstance", instance, (void *)0);
    return avoided ? 0 : 3;
}
