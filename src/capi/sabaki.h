/* sabaki for C and C++: finds a motion that avoids an attack, with your Vulkan device.
 *
 *     cargo rustc --release --lib --no-default-features --features capi --crate-type staticlib
 *     cc renderer.c -I src/capi target/release/libsabaki.a -lm -lpthread -ldl
 *
 * (--crate-type cdylib makes a shared library.) This header needs no Vulkan header: VkInstance, VkPhysicalDevice,
 * VkDevice and VkCommandBuffer are pointers, and are passed as such. No Vulkan library is linked: functions are looked up with
 * the vkGetInstanceProcAddr that you pass.
 *
 * Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw. A heading of 0 faces +Z,
 * pi/2 faces +X.
 *
 * Threads: one thread at a time may use an object; any number of threads may share a graph. Nothing here submits, waits, or
 * destroys your objects. The documentation of the Rust module `sabaki::gpu`, section "Contract", says what the commands do to
 * your command buffer (stages, layouts, state).
 */
#ifndef SABAKI_H
#define SABAKI_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t sabaki_status;
enum {
    SABAKI_OK = 0,
    SABAKI_NOT_YET = 1,      /* poll again */
    SABAKI_ERROR = -1,       /* see sabaki_last_error(); nothing has changed */
    SABAKI_DEVICE_LOST = -2  /* as VK_ERROR_DEVICE_LOST: destroy everything on the device */
};

/* Message of the last failed call on this thread. Valid until the next call fails. Never NULL. */
const char *sabaki_last_error(void);

/* ---- Graphs: made by the command `sabaki bake`, opened when the program starts ---- */

typedef struct sabaki_graph sabaki_graph;

/* Opens a baked file. `*graph` is set on success only. */
sabaki_status sabaki_graph_open(const char *path, sabaki_graph **graph);
/* The same from the `size` bytes of a baked file in memory, which are not needed afterwards. */
sabaki_status sabaki_graph_load(const void *bytes, size_t size, sabaki_graph **graph);
/* Closes a graph. Cullers keep what they need of it. NULL is allowed. */
void sabaki_graph_close(sabaki_graph *graph);
/* Numbers of joints, of spheres of the body, and of edges. */
uint32_t sabaki_graph_joints(const sabaki_graph *graph);
uint32_t sabaki_graph_spheres(const sabaki_graph *graph);
uint32_t sabaki_graph_edges(const sabaki_graph *graph);
/* Name of a joint; NULL beyond the last one. Valid as long as the graph. */
const char *sabaki_graph_joint_name(const sabaki_graph *graph, uint32_t joint);

/* ---- Your device ---- */

typedef struct sabaki_device {
    void *get_instance_proc_addr; /* PFN_vkGetInstanceProcAddr */
    void *instance;               /* VkInstance */
    void *physical_device;        /* VkPhysicalDevice */
    void *device;                 /* VkDevice; NULL only for sabaki_check() */
    uint32_t queue_family;        /* family of the queue that runs the command buffers */
    uint32_t api_version;         /* VkApplicationInfo::apiVersion: VK_API_VERSION_1_1 or later */
    /* Enabled features: 1 or 0. The compute path needs none of them. */
    uint32_t precise_queries;        /* occlusionQueryPrecise */
    uint32_t fragment_atomics;       /* fragmentStoresAndAtomics */
    uint32_t dynamic_rendering;      /* dynamicRendering: the stencil path needs it */
    uint32_t synchronization2;       /* synchronization2 */
    uint32_t extended_dynamic_state; /* extendedDynamicState: the stencil path needs it below Vulkan 1.3 */
} sabaki_device;

/* Whether some path runs: SABAKI_OK, or SABAKI_ERROR with a message that names what is missing. If `device->device` is NULL, this
 * asks the physical device for everything that it offers; otherwise it looks at the enabled features and the queue family. If
 * `text` is not NULL, at most `size` bytes are written to it, including the terminating zero: a line for each path ("stencil:
 * runs" or "stencil: lacks ..."), then one for each optional feature that is missing, with its fallback. */
sabaki_status sabaki_check(const sabaki_device *device, char *text, size_t size);

typedef enum sabaki_path { SABAKI_STENCIL = 0, SABAKI_COMPUTE = 1 } sabaki_path;

/* ---- Dodging ---- */

/* The place of a character: a frame of an edge of the graph, the position (x, z), and the heading. */
typedef struct sabaki_place {
    uint32_t edge;
    float frame;
    float x, z, heading;
} sabaki_place;

/* A key of an attack. An attack is a set of spheres that move on straight lines from key to key. `t` counts from now, in
 * seconds. The keys of one sphere stand together, in the order of time. */
typedef struct sabaki_key {
    uint32_t sphere;
    float t;
    float center[3];
    float radius;
} sabaki_key;

typedef struct sabaki_answer {
    uint32_t avoided;        /* 1: the attack misses, tested exactly. 0: it hits; the motion with the smallest depth */
    float clearance;         /* smallest distance between body and attack, metres; negative where they overlap */
    float seconds;           /* length of the motion */
    uint32_t candidates;     /* number of candidates */
    uint32_t removed;        /* number of candidates that culling removed */
    uint32_t counted_by_cpu; /* 1: the CPU counted, because of a limit or a failure of the device; the result is the same */
} sabaki_answer;

typedef struct sabaki_sphere {
    float center[3];
    float radius;
} sabaki_sphere;

typedef struct sabaki_joint {
    float position[3];
    float rotation[4];
} sabaki_joint;

typedef struct sabaki_culler sabaki_culler;

/* Creates pipelines and memory (with gpu-allocator) on your device, for `slots` queries in flight. `*culler` is set on success
 * only; a failure leaves nothing behind. */
sabaki_status sabaki_culler_create(const sabaki_graph *graph, const sabaki_device *device, sabaki_path path,
                                   uint32_t slots, sabaki_culler **culler);

/* Frees everything. The device must have finished what was recorded. NULL is allowed. */
void sabaki_culler_destroy(sabaki_culler *culler);

/* Starts a query for a motion that avoids an attack, and records the culling of its candidates into `commands`, a
 * VkCommandBuffer that is being recorded, outside of rendering. It is submitted once, on a queue of the family, in the order
 * of recording. What was recorded into the slot before has finished, or will never be submitted. */
sabaki_status sabaki_record(sabaki_culler *culler, uint32_t slot, void *commands, const sabaki_place *place,
                            const sabaki_key *keys, size_t key_count);

/* The answer, if the device has finished: SABAKI_OK. Otherwise SABAKI_NOT_YET. Never waits. */
sabaki_status sabaki_poll(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The answer now: the CPU counts instead of the device. For a lost device, or where waiting is not possible. */
sabaki_status sabaki_answer_now(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The body in the answer's motion, `seconds` after the query started. Valid until the slot's next query. `count` is the length
 * of the array; the numbers of joints and spheres are those of the graph. */
sabaki_status sabaki_sample_joints(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_joint *joints,
                                   size_t count);
sabaki_status sabaki_sample_spheres(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_sphere *spheres,
                                    size_t count);
/* The place of the character at that time, for the next query. */
sabaki_status sabaki_sample_place(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_place *place);

#ifdef __cplusplus
}
#endif

#endif
