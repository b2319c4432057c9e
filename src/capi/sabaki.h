/* sabaki for C and C++: a guest in your Vulkan renderer that finds a motion which an attack misses.
 *
 *     cargo rustc --release --lib --no-default-features --features capi --crate-type staticlib
 *     cc renderer.c -I src/capi target/release/libsabaki.a -lm -lpthread -ldl
 *
 * (--crate-type cdylib makes a shared library.) This header needs no Vulkan header: handles are what VkInstance,
 * VkPhysicalDevice, VkDevice and VkCommandBuffer are, pointers. No Vulkan library is linked: functions are found by the
 * vkGetInstanceProcAddr that you give.
 *
 * Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw. A heading of 0 faces +Z,
 * pi/2 faces +X.
 *
 * Threads: an object is used by one thread at a time; graphs may be shared by any number. Nothing here submits, waits, or
 * destroys what is yours. What the commands do to your command buffer (stages, layouts, state) stands in the documentation
 * of the Rust module `sabaki::gpu`, under "Contract".
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
    SABAKI_ERROR = -1,       /* sabaki_last_error() says what; nothing has changed */
    SABAKI_DEVICE_LOST = -2  /* as VK_ERROR_DEVICE_LOST: destroy everything on the device */
};

/* Of the last call on this thread that failed. Lives until the next one does. Never NULL. */
const char *sabaki_last_error(void);

/* ---- Graphs: baked once by the command `sabaki bake`, opened whenever the program starts ---- */

typedef struct sabaki_graph sabaki_graph;

/* A baked file. `*graph` is set on success only. */
sabaki_status sabaki_graph_open(const char *path, sabaki_graph **graph);
/* Cullers hold on to what they need. NULL is allowed. */
void sabaki_graph_close(sabaki_graph *graph);
uint32_t sabaki_graph_joints(const sabaki_graph *graph);
uint32_t sabaki_graph_spheres(const sabaki_graph *graph);
uint32_t sabaki_graph_edges(const sabaki_graph *graph);
/* NULL beyond the last one. Lives as long as the graph. */
const char *sabaki_graph_joint_name(const sabaki_graph *graph, uint32_t joint);

/* ---- The device: yours ---- */

typedef struct sabaki_device {
    void *get_instance_proc_addr; /* PFN_vkGetInstanceProcAddr */
    void *instance;               /* VkInstance */
    void *physical_device;        /* VkPhysicalDevice */
    void *device;                 /* VkDevice with what sabaki_check() asks for; unused by sabaki_check() */
    uint32_t queue_family;        /* of the queue that the command buffers run on */
    uint32_t api_version;         /* VkApplicationInfo::apiVersion: VK_API_VERSION_1_1 or later */
    uint32_t precise_queries;     /* 1 where occlusionQueryPrecise is enabled, else 0 */
    uint32_t fragment_atomics;    /* 1 where fragmentStoresAndAtomics is enabled, else 0 */
} sabaki_device;

/* Whether the physical device can be used: SABAKI_OK, or SABAKI_ERROR naming what is missing. `text`, if not NULL, gets at
 * most `size` bytes, with the terminating zero, that say what will be done without, a line each. */
sabaki_status sabaki_check(const sabaki_device *device, char *text, size_t size);

typedef enum sabaki_path { SABAKI_STENCIL = 0, SABAKI_COMPUTE = 1 } sabaki_path;

/* ---- Dodging ---- */

/* Where a character is: at a frame of an edge of the graph, standing at (x, z) and facing `heading`. */
typedef struct sabaki_place {
    uint32_t edge;
    float frame;
    float x, z, heading;
} sabaki_place;

/* An attack is spheres that move on straight lines from key to key. `t` counts from now. Keys of one sphere are
 * neighbours, in the order of time. */
typedef struct sabaki_key {
    uint32_t sphere;
    float t;
    float center[3];
    float radius;
} sabaki_key;

typedef struct sabaki_answer {
    uint32_t avoided;        /* 1: nothing is hit, tested exactly. 0: the least bad motion */
    float clearance;         /* smallest distance of surfaces, metres; negative where they meet */
    float seconds;           /* of motion until the answer's path ends */
    uint32_t candidates;
    uint32_t removed;        /* by the maps */
    uint32_t counted_by_cpu; /* 1: the device's limits or its failure left the counting to the CPU, with the same result */
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

/* Makes pipelines and memory (its own, by gpu-allocator) on your device, for `slots` queries in flight. `*culler` is set on
 * success only; after a failure nothing is left. */
sabaki_status sabaki_culler_create(const sabaki_graph *graph, const sabaki_device *device, sabaki_path path,
                                   uint32_t slots, sabaki_culler **culler);

/* Frees everything. The device must have finished what was recorded. NULL is allowed. */
void sabaki_culler_destroy(sabaki_culler *culler);

/* Asks how to avoid an attack, and records the culling of the candidates into `commands`, a VkCommandBuffer that is being
 * recorded, outside of rendering. It is submitted once, on a queue of the family, in the order of recording. What was recorded
 * into the slot before has finished, or will never be submitted. */
sabaki_status sabaki_record(sabaki_culler *culler, uint32_t slot, void *commands, const sabaki_place *place,
                            const sabaki_key *keys, size_t key_count);

/* Once the device has finished: SABAKI_OK and the answer. Before that SABAKI_NOT_YET. Never waits. */
sabaki_status sabaki_poll(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The same question to the CPU, now: where no answer came, or none can be waited for. */
sabaki_status sabaki_answer_now(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The answer's motion, `seconds` after the question, until the slot's next one. Arrays are as long as the graph has
 * joints or spheres. */
sabaki_status sabaki_sample_joints(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_joint *joints,
                                   size_t count);
sabaki_status sabaki_sample_spheres(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_sphere *spheres,
                                    size_t count);
/* Where the character is then: for the next question. */
sabaki_status sabaki_sample_place(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_place *place);

#ifdef __cplusplus
}
#endif

#endif
