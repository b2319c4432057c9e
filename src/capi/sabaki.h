/* sabaki for C and C++: characters of a game that avoid what threatens them; single answers with your Vulkan device.
 *
 *     cargo rustc --release --lib --no-default-features --features capi --crate-type staticlib
 *     cc renderer.c -I src/capi target/release/libsabaki.a -lm -lpthread -ldl
 *
 * (--crate-type cdylib makes a shared library.) With CMake: src/capi/CMakeLists.txt builds and installs a package for
 * find_package(sabaki), whose target is sabaki::sabaki. This header needs no Vulkan header: VkInstance, VkPhysicalDevice,
 * VkDevice and VkCommandBuffer are pointers, and are passed as such. No Vulkan library is linked: functions are looked up with
 * the vkGetInstanceProcAddr that you pass.
 *
 * Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw. A heading of 0 faces +Z,
 * pi/2 faces +X. sabaki_graph_set_space() changes this to what your engine has.
 *
 * Structs whose first field is `size` can grow: set it to sizeof of yours, also before sabaki fills one; of an array, that of the first one
 * counts. A program that was built with an older header goes on with a newer library: what its structs lack takes its default, which is 0
 * where nothing else is said. A library that is older than the header refuses structs that it does not know.
 *
 * Threads: one thread at a time may use an object; any number of threads may share a graph. Nothing here submits, waits, or
 * destroys your objects. The documentation of the Rust module `sabaki::gpu`, section "Contract", says what the commands do to
 * your command buffer (stages, layouts, state).
 */
#ifndef SABAKI_H
#define SABAKI_H

#define SABAKI_VERSION "0.2.0"
#define SABAKI_VERSION_NUMBER 2000 /* major * 1000000 + minor * 1000 + patch */

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
    SABAKI_DEVICE_LOST = -2  /* a Vulkan call of sabaki returned VK_ERROR_DEVICE_LOST: destroy everything on the device */
};

/* SABAKI_VERSION_NUMBER of the library. */
uint32_t sabaki_version(void);

/* Message of the last failed call on this thread, at most 2047 bytes of it. Valid until the next call fails. Never NULL. It may be asked for
 * as long as the thread runs, also in destructors and in functions that atexit() calls. */
const char *sabaki_last_error(void);

/* Calls `log` with the message of each call that fails, from the thread of that call; NULL for none, the default. `user` is passed
 * on. Do not call sabaki from it. It may run on several threads at once. sabaki_set_log() returns when no call of the function before is
 * running; from then on, what its `user` points to may be freed. Functions that you pass to sabaki must not throw or longjmp out. */
typedef void (*sabaki_log)(void *user, const char *message);
void sabaki_set_log(sabaki_log log, void *user);

/* ---- Graphs: made by the command `sabaki bake`, opened when the program starts ---- */

typedef struct sabaki_graph sabaki_graph;

/* Opens a baked file. `*graph` is set on success only. */
sabaki_status sabaki_graph_open(const char *path, sabaki_graph **graph);
/* The same from the `size` bytes of a baked file in memory, which are not needed afterwards. */
sabaki_status sabaki_graph_load(const void *bytes, size_t size, sabaki_graph **graph);
/* The space of your engine. */
typedef enum sabaki_space {
    SABAKI_Y_UP = 0,  /* metres, +Y up, right-handed; a heading of 0 faces +Z. The default; Godot's, too */
    SABAKI_Z_UP = 1,  /* metres, +Z up, right-handed; a heading of 0 faces +Y */
    SABAKI_UNITY = 2, /* metres, +Y up, left-handed; a heading of 0 faces +Z and grows clockwise as seen from above */
    SABAKI_UNREAL = 3 /* centimetres, +Z up, left-handed; a heading of 0 faces +X and grows clockwise as seen from above */
} sabaki_space;

/* Says in which space positions, velocities, sizes and rotations are, of all that is made with the graph from then on; a game has that of the
 * graph that it is created with. Where +Z points up, `x` and `z` on the ground are X and Y. Settings, limits in this header, and what is
 * called metres stay in metres, and so do the matrices of sabaki_pose_all(). */
sabaki_status sabaki_graph_set_space(sabaki_graph *graph, uint32_t space);
/* The matrix M (4 columns of 4 numbers) from metres, +Y up, to a space: a matrix A of sabaki_pose_all() becomes M * A * inverse(M). */
sabaki_status sabaki_space_matrix(uint32_t space, float *matrix);
/* Closes a graph. Cullers keep what they need of it. NULL is allowed. */
void sabaki_graph_close(sabaki_graph *graph);
/* Numbers of joints, of spheres of the body, and of edges. */
uint32_t sabaki_graph_joints(const sabaki_graph *graph);
uint32_t sabaki_graph_spheres(const sabaki_graph *graph);
uint32_t sabaki_graph_edges(const sabaki_graph *graph);
/* Name of a joint; NULL beyond the last one. Valid as long as the graph. */
const char *sabaki_graph_joint_name(const sabaki_graph *graph, uint32_t joint);
/* Parent of a joint, which has a lower number; UINT32_MAX for the root, joint 0, and beyond the last one. */
uint32_t sabaki_graph_joint_parent(const sabaki_graph *graph, uint32_t joint);
/* Position of a joint in its parent's frame in the rest pose (3 numbers), in which no joint is turned. */
sabaki_status sabaki_graph_joint_offset(const sabaki_graph *graph, uint32_t joint, float *offset);

/* ---- Your device ---- */

/* Access to a block of memory. */
typedef enum sabaki_memory_usage {
    SABAKI_MEMORY_DEVICE = 0,  /* only the device reads and writes; if the block is mapped, the host writes the first contents */
    SABAKI_MEMORY_UPLOAD = 1,  /* the host writes and the device reads: the block must be mapped */
    SABAKI_MEMORY_READBACK = 2 /* the device writes and the host reads: the block must be mapped and should be cached */
} sabaki_memory_usage;

/* A request for memory. It is valid during the call. */
typedef struct sabaki_memory_desc {
    const char *name;           /* of the buffer or image */
    uint64_t size;              /* as in VkMemoryRequirements, bytes */
    uint64_t alignment;         /* as in VkMemoryRequirements, bytes */
    uint32_t memory_type_bits;  /* as in VkMemoryRequirements */
    uint32_t usage;             /* sabaki_memory_usage */
    uint64_t buffer;            /* VkBuffer, for VkMemoryDedicatedAllocateInfo; 0 for an image */
    uint64_t image;             /* VkImage of optimal tiling; 0 for a buffer */
    uint32_t prefers_dedicated; /* 1: the driver prefers an allocation for this resource alone, at offset 0 */
} sabaki_memory_desc;

/* A block of device memory. */
typedef struct sabaki_block {
    uint64_t memory;   /* VkDeviceMemory */
    uint64_t offset;   /* of the block in `memory`, bytes */
    uint64_t size;     /* at least the required one, bytes */
    void *mapped;      /* mapped address of the block; NULL if it is not mapped */
    uint32_t coherent; /* 1: host-coherent. 0: the block starts and ends at multiples of nonCoherentAtomSize, or with `memory` */
    uint64_t token;    /* yours: it is passed back to `release` */
} sabaki_block;

/* Your allocator of device memory. Only the calls that create and destroy cullers and sabaki_release_staging() use it, on their own
 * thread. */
typedef struct sabaki_allocator {
    uint32_t size;
    void *user; /* passed to both functions */
    /* Writes `*block`, and returns SABAKI_OK; SABAKI_ERROR if there is no memory. */
    sabaki_status (*allocate)(void *user, const sabaki_memory_desc *desc, sabaki_block *block);
    void (*release)(void *user, const sabaki_block *block);
} sabaki_allocator;

typedef struct sabaki_device {
    uint32_t size;
    uint32_t labels;              /* 1: VK_EXT_debug_utils is enabled: objects are named, and commands labelled, for debuggers */
    void *get_instance_proc_addr; /* PFN_vkGetInstanceProcAddr */
    void *instance;               /* VkInstance */
    void *physical_device;        /* VkPhysicalDevice */
    void *device;                 /* VkDevice; NULL only for sabaki_check() */
    uint32_t queue_family;        /* family of the one queue that runs the command buffers */
    uint32_t api_version;         /* VkApplicationInfo::apiVersion: VK_API_VERSION_1_1 or later */
    /* Enabled features: 1 or 0. The compute path needs none of them. */
    uint32_t precise_queries;        /* occlusionQueryPrecise */
    uint32_t dynamic_rendering;      /* dynamicRendering: the stencil path needs it */
    uint32_t synchronization2;       /* synchronization2 */
    uint32_t extended_dynamic_state; /* extendedDynamicState: the stencil path needs it below Vulkan 1.3 */
    /* Allocator of device memory; NULL for gpu-allocator. It is copied. */
    const sabaki_allocator *allocator;
    uint64_t pipeline_cache; /* VkPipelineCache that pipelines are created with; 0 for none */
    const void *allocation_callbacks; /* VkAllocationCallbacks for all objects, which is copied; NULL for none. Memory comes from `allocator` */
} sabaki_device;

/* Whether some path runs: SABAKI_OK, or SABAKI_ERROR with a message that names what is missing. If `device->device` is NULL, this
 * asks the physical device for everything that it offers; otherwise it looks at the enabled features and the queue family. If
 * `text` is not NULL, at most `size` bytes are written to it, including the terminating zero: a line for each path ("stencil:
 * runs" or "stencil: lacks ..."), then one for each optional feature that is missing, with its fallback, then one for each device extension
 * that must be enabled ("enable VK_..."). */
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
 * seconds, at most 600. Centers are in the world, at most 10 km from the origin; radii above 0, at most 100 m. The keys of one sphere
 * stand together, in the order of time; otherwise the attack is refused, as it is above 262144 keys. */
typedef struct sabaki_key {
    uint32_t sphere;
    float t;
    float center[3];
    float radius;
} sabaki_key;

typedef struct sabaki_answer {
    uint32_t size;
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

/* Creates pipelines and memory on your device, for `slots` queries in flight, at most 4096; 0 counts as 1. `*culler` is set on success
 * only; a failure leaves nothing behind. */
sabaki_status sabaki_culler_create(const sabaki_graph *graph, const sabaki_device *device, sabaki_path path,
                                   uint32_t slots, sabaki_culler **culler);

/* Frees everything. The device must have finished what was recorded. NULL is allowed. */
void sabaki_culler_destroy(sabaki_culler *culler);

/* Frees the staging memory of the maps, which is as large as they are; devices whose memory is mapped need none. Call it when a query has
 * been answered by the device, and no other recorded command buffer of the culler is in flight or will be submitted. Does nothing before the
 * first such answer. */
sabaki_status sabaki_release_staging(sabaki_culler *culler);

/* Starts a query for a motion that avoids an attack, and records the culling of its candidates into `commands`, a
 * VkCommandBuffer that is being recorded, outside of rendering and of occlusion queries. It is submitted once at most. All command
 * buffers of a culler go to one and the same queue of the family, in the order of recording. What was recorded into the slot before has
 * finished, or will never be submitted. What the device cannot do (a limit, no memory) is no error: nothing is recorded then, and
 * sabaki_poll() answers by the CPU. After SABAKI_DEVICE_LOST the query waits in the slot for sabaki_answer_now(). */
sabaki_status sabaki_record(sabaki_culler *culler, uint32_t slot, void *commands, const sabaki_place *place,
                            const sabaki_key *keys, size_t key_count);

/* A query of a batch. */
typedef struct sabaki_query {
    uint32_t size;
    uint32_t slot;
    const sabaki_place *place;
    const sabaki_key *keys;
    size_t key_count;
} sabaki_query;

/* Like sabaki_record(), for many queries at once, each in a slot of its own: no cull waits for another one, and one barrier serves all. If the
 * device cannot cull one of them, the CPU answers all of the batch. */
sabaki_status sabaki_record_batch(sabaki_culler *culler, void *commands, const sabaki_query *queries, size_t query_count);

/* The answer, if the device has finished: SABAKI_OK. Otherwise SABAKI_NOT_YET. Never waits. May be called at any time; Vulkan guarantees
 * the counts once you have seen the fence or timeline semaphore of the submission. Before that, it looks for a number that the device
 * writes after it has made the counts available to the host. */
sabaki_status sabaki_poll(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The answer now: the CPU counts instead of the device. For a lost device, or where waiting is not possible. Polling calls nothing that
 * tells of a lost device, so sabaki_poll() goes on saying SABAKI_NOT_YET: once your own vkQueueSubmit, fence or semaphore returns
 * VK_ERROR_DEVICE_LOST, call this for each open slot, and then destroy the culler. */
sabaki_status sabaki_answer_now(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);

/* The body in the answer's motion, `seconds` after the query started, at most 600; times before the start are clamped. Valid until
 * the slot's next query. `count` is the length of the array; the numbers of joints and spheres are those of the graph. */
sabaki_status sabaki_sample_joints(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_joint *joints,
                                   size_t count);
sabaki_status sabaki_sample_spheres(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_sphere *spheres,
                                    size_t count);
/* The place of the character at that time, for the next query. */
sabaki_status sabaki_sample_place(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_place *place);

/* ---- Characters in a game: steered, threatened at any moment, kept out of obstacles; no device is needed ---- */

typedef struct sabaki_game sabaki_game;

typedef struct sabaki_game_settings {
    uint32_t size;
    uint32_t threads;        /* threads of a step, at most 1024; 0 for one per core. Default 1. The result does not depend on it */
    uint32_t delay;          /* steps from a query to the takeover of its answer, at most 60. Default 0 */
    uint32_t plans_per_step; /* most characters that plan in one step, the most urgent first; 0 for no limit. Default 24 */
    float horizon;           /* a threat is answered when it may hit within this time, seconds, at most 60. Default 1.6 */
    float margin;            /* distance that plans keep from threats if they can, metres, at most 10. Default 0.03 */
    float body_radius;       /* characters avoid each other as discs of this radius, metres, at most 100; 0 for not at all, the default */
    float plan_milliseconds; /* time for plans in one step, at most 1000000, the most urgent first; 0 for no limit, the default */
    uint32_t plan_work;         /* of one plan as work, about a thousand for a millisecond, alike on every machine; 0 for no limit. Default 4000 */
    uint32_t searches_per_step; /* characters whose steering searches in one step, if as many have to. Default 8 */
    float obstacle_margin; /* distance that plans keep from obstacles if they can, metres, at most 10. Default 0.02 */
    float push;            /* speed at which a body is shifted out of obstacles, m/s, at most 1000. Default 6 */
    float retry;           /* time until it plans again for what it could not avoid, seconds, at most 60; doubled up to 4 times. Default 0.1 */
    /* Steering. */
    float steer_interval;      /* between two searches, seconds, at most 60. Default 0.15 */
    float steer_blend;         /* in which a jump blends, seconds, at most 10. Default 0.3 */
    float steer_gain;          /* least gain of a jump; 1 is about 8 cm of travel in 0.2 s. Default 1.5 */
    float steer_slowest;       /* playback rate, 0.1 to 10; strides get shorter below. Default 0.7 */
    float steer_fastest;       /* playback rate, from the slowest to 10. Default 1.25 */
    float steer_turn;          /* most turn that is added to a walk, rad/s, at most 100. Default 3.5 */
    float steer_standing_turn; /* the same where it stands. Default 0.8 */
    float steer_jump_turn;     /* most turn that a jump adds, radians, at most 10. Default 0.1 */
    float steer_clearance;     /* from obstacles to the root on the ground, metres, at most 100. Default 0.45 */
    float steer_foresight;     /* obstacles that are reached within this time are avoided, seconds, at most 60. Default 1.2 */
    float steer_repeat;        /* an idle character repeats no motion within this time, seconds, at most 3600. Default 60 */
} sabaki_game_settings;

/* Names a character. It is not used again after the character is gone; sabaki_load() brings back the names of then, of characters and of
 * threats. */
typedef uint64_t sabaki_character;

sabaki_status sabaki_game_settings_default(sabaki_game_settings *settings);
/* No characters yet; NULL for default settings. The game keeps what it needs of the graph. `*game` is set on success only. */
sabaki_status sabaki_game_create(const sabaki_graph *graph, const sabaki_game_settings *settings, sabaki_game **game);
/* Adds a kind of character: another graph, or the same one with other settings; the game was created with the kind 0. Characters of all
 * kinds share threats, obstacles and each step, and avoid each other. `threads` and the limits of a step are those of the kind 0. */
sabaki_status sabaki_add_kind(sabaki_game *game, const sabaki_graph *graph, const sabaki_game_settings *settings, uint32_t *kind);
/* NULL is allowed. */
void sabaki_game_destroy(sabaki_game *game);
/* The sum of all steps, seconds. */
double sabaki_game_now(const sabaki_game *game);

/* Adds a character that stands at (x, z), at most 5 km from the origin. */
sabaki_status sabaki_spawn(sabaki_game *game, float x, float z, float heading, sabaki_character *character);
/* The same, of another kind. */
sabaki_status sabaki_spawn_kind(sabaki_game *game, uint32_t kind, float x, float z, float heading, sabaki_character *character);
/* UINT32_MAX if there is no such character. */
uint32_t sabaki_kind_of(const sabaki_game *game, sabaki_character character);
sabaki_status sabaki_despawn(sabaki_game *game, sabaki_character character);

typedef enum sabaki_goal_kind {
    SABAKI_IDLE = 0,
    SABAKI_WALK = 1,  /* (x, z): velocity, at most 100 m/s; `heading` of the body if `has_heading`, otherwise the direction of travel */
    SABAKI_FACE = 2,  /* stands and turns to `heading` */
    SABAKI_GO_TO = 3, /* (x, z): the point, at most 5 km from the origin; `speed` on the way, at most 100 m/s */
    SABAKI_STOP = 4,
    SABAKI_STRIKE = 5 /* goes to where an attack of the clips reaches, and strikes, again and again: the trunk of the character `target` if
                       * `has_target`, otherwise the point (x, y, z). Only attacks with the joint `limb` if `has_limb` */
} sabaki_goal_kind;

typedef struct sabaki_goal {
    uint32_t size;
    uint32_t kind; /* sabaki_goal_kind */
    float x, z;
    float heading;
    uint32_t has_heading;
    float speed;
    float y;
    uint32_t has_target;
    uint32_t has_limb;
    uint32_t limb;
    sabaki_character target;
} sabaki_goal;

/* What a character does while nothing threatens it. */
sabaki_status sabaki_steer(sabaki_game *game, sabaki_character character, const sabaki_goal *goal);

/* Moves a character in the world, turned by `heading` about the origin and then by (x, z), for example with a platform or a character
 * controller. It goes on with what it plays from there. */
sabaki_status sabaki_move_by(sabaki_game *game, sabaki_character character, float x, float z, float heading);
/* Sets the height of the ground on which a character stands, 0 by default, for example on stairs. */
sabaki_status sabaki_set_height(sabaki_game *game, sabaki_character character, float height);

/* Spheres that move together, from `time` on, on the clock of sabaki_game_now(). A time in the future announces a threat. */
typedef struct sabaki_threat {
    uint32_t size;
    uint32_t has_target;          /* 1: only `target` has to avoid it, which must be there when the threat is added. 0: all */
    double time;                  /* at most an hour from now */
    float position[3];            /* then, at most 5 km from the origin */
    float velocity[3];            /* then, at most 1000 m/s */
    float gravity;                /* acceleration downwards, m/s^2, -100 to 100 */
    float seconds;                /* time for which it exists, at most 60 */
    uint32_t sphere_count;
    const sabaki_sphere *spheres; /* 1 to 64; centers relative to the position, at most 100 m away; radii above 0, at most 50 m */
    sabaki_character target;
} sabaki_threat;

sabaki_status sabaki_threaten(sabaki_game *game, const sabaki_threat *threat, uint64_t *id);
/* Replaces a threat, for example after a new observation. */
sabaki_status sabaki_update_threat(sabaki_game *game, uint64_t id, const sabaki_threat *threat);
sabaki_status sabaki_remove_threat(sabaki_game *game, uint64_t id);

typedef enum sabaki_obstacle_kind {
    SABAKI_HALF_SPACE = 0, /* everything behind the plane through `a`; `b` is its normal, out of the solid */
    SABAKI_BLOCK = 1,      /* upright box around `a`, half its sizes in `b`, turned by `heading` */
    SABAKI_CAPSULE = 2,    /* within `radius` of the line from `a` to `b` */
    SABAKI_POLYGON = 3,    /* convex, of unlimited height: `corner_count` (3 to 16) pairs x, z */
    SABAKI_DISC = 4        /* around (a[0], a[2]) within `radius`, of unlimited height */
} sabaki_obstacle_kind;

/* Points at most 10 km from the origin; sizes, radii and weights above 0. */
typedef struct sabaki_obstacle {
    uint32_t size;
    uint32_t kind; /* sabaki_obstacle_kind */
    float a[3], b[3];
    float radius, heading;
    float velocity[3]; /* at most 100 m/s */
    float weight; /* harm of entering it by a metre, against a hit a metre deep, at most 1000000; 0 for the default, 4 */
    uint32_t corner_count;
    const float *corners;
} sabaki_obstacle;

typedef enum sabaki_event_kind {
    SABAKI_PLANNED = 0,  /* a motion avoids all threats, by `metres`; `is_change`: it replaces a plan; `threat` comes first, and
                          * is nearest at `contact` */
    SABAKI_KEPT = 1,     /* the played motion avoids all threats, by `metres` */
    SABAKI_BEGAN = 2,    /* a planned motion began */
    SABAKI_CANNOT = 3,   /* no motion avoids the threats */
    SABAKI_CORNERED = 4, /* none avoids threats and obstacles: `metres` from the threats, `entered` (depth times weight) */
    SABAKI_MISSED = 5,   /* `threat` has passed, at `metres`; of one that was too far away all the time, nothing is said */
    SABAKI_HIT = 6,      /* `threat` touches `joint` at `point`, with `normal` from the body to the threat, `metres` deep (negative) */
    SABAKI_ENDED = 7,    /* a planned motion has ended, or was left: the character follows its goal again */
    SABAKI_SHOVED = 8,   /* an obstacle was put on the body, which is shoved out at the speed of a run */
    SABAKI_STUCK = 9,    /* the body is in an obstacle, `metres` deep (negative), and there is no free place around it */
    SABAKI_STRIKES = 10, /* the character strikes: its limb is `threat` to all others, and has reached furthest at `contact` */
    SABAKI_STRUCK = 11,  /* the limb `threat` of the character `by` touches `joint` at `point`, `metres` deep (negative), with `speed`
                          * relative to it */
    SABAKI_STRIKE_ENDED = 12 /* the strike has ended; `is_whole`: it was not broken off */
} sabaki_event_kind;

typedef struct sabaki_event {
    uint32_t size;
    uint32_t kind;   /* sabaki_event_kind */
    sabaki_character character;
    double time;
    uint64_t threat; /* UINT64_MAX for none */
    uint32_t is_change;
    uint32_t joint;  /* UINT32_MAX for none */
    float metres;
    float entered;
    double contact;  /* time of the game, as `time` */
    float point[3];
    float normal[3];
    sabaki_character by; /* UINT64_MAX for none */
    float speed;         /* in the space of the graph, as velocities */
    uint32_t is_whole;
    uint32_t edge;       /* of the graph, that plays the attack of a strike; UINT32_MAX for none */
} sabaki_event;

/* Advances time by `dt` seconds. More than 1 counts as 1; negative, infinite and NaN count as 0, so that a paused game continues
 * smoothly. Obstacles are given at their current positions; no character enters them. Pass every obstacle within 10 m of a
 * character, plus the distance that a moving one covers within the horizon. */
sabaki_status sabaki_step(sabaki_game *game, float dt, const sabaki_obstacle *obstacles, size_t obstacle_count);
/* Writes at most `capacity` events of the last step, of the size of the first one; returns how many there are, and 0 if that size is wrong. */
size_t sabaki_events(const sabaki_game *game, sabaki_event *events, size_t capacity);
/* The joints in the world; `count` is the length of the array. */
sabaki_status sabaki_pose(sabaki_game *game, sabaki_character character, sabaki_joint *joints, size_t count);
/* The spheres of the body in the world, which is what threats hit; `count` is the length of the array. */
sabaki_status sabaki_body(sabaki_game *game, sabaki_character character, sabaki_sphere *spheres, size_t count);
/* The root in the world (3 numbers), and of `count` joints the rotations (4 numbers each) and positions (3 numbers each) relative to the
 * parents. The root's position there is unused. `translations` may be NULL. */
sabaki_status sabaki_local_pose_of(const sabaki_game *game, sabaki_character character, float *root, float *rotations,
                                   float *translations, size_t count);

/* A pose by its root and the rotations (xyzw) and positions of all joints relative to their parents. */
typedef struct sabaki_local_pose {
    uint32_t size;
    uint32_t count; /* number of joints */
    float root[3];
    const float *rotations;
    const float *translations; /* NULL: the joints keep the skeleton's offsets */
} sabaki_local_pose;

/* Adds rotations (4 numbers each) to `count` joints of what a character plays, for example to aim or to react to a hit: each in the joint's
 * own frame. They replace those of the last call; poses, hits and plans have them. sabaki_resume() forgets them. */
sabaki_status sabaki_set_additive(sabaki_game *game, sabaki_character character, const uint32_t *joints, const float *rotations,
                                  size_t count);

/* Hands the body to another system, such as a ragdoll, and takes it back from its last two poses, `seconds` apart (0.0001 to 1):
 * roots at most 5 km from the origin, rotations of length 1. */
sabaki_status sabaki_release(sabaki_game *game, sabaki_character character);
sabaki_status sabaki_resume(sabaki_game *game, sabaki_character character, const sabaki_local_pose *before,
                            const sabaki_local_pose *now, float seconds);

/* Saves and loads all characters and threats, without graph and settings. `*size` is the needed size; nothing is written if
 * `capacity` is 0. A loaded game continues bit-identically. Damaged bytes, and bytes of another graph or another version of sabaki,
 * are refused. */
sabaki_status sabaki_save(const sabaki_game *game, void *bytes, size_t capacity, size_t *size);
sabaki_status sabaki_load(sabaki_game *game, const void *bytes, size_t size);
/* The same of one character, for example to send it to another machine that plays the same game: at the same time and with the same threats
 * it continues bit-identically. It is loaded into a character with the same graph. */
sabaki_status sabaki_save_character(const sabaki_game *game, sabaki_character character, void *bytes, size_t capacity, size_t *size);
sabaki_status sabaki_load_character(sabaki_game *game, sabaki_character character, const void *bytes, size_t size);

/* ---- All characters at once, on levels of detail: joint matrices in your buffer, which may be mapped from a device ---- */

typedef struct sabaki_crowd_settings {
    uint32_t size;
    uint32_t threads;      /* 0 for one per core. Default 1 */
    uint32_t is_in_blocks; /* 0: a row of matrices for each character. 1: number by number of 16 characters, the kernels' own order */
    uint32_t is_streamed;  /* 1: written past the caches, for large or mapped memory */
    float near;            /* within this distance of the camera every pose is exact, metres. Default 0 */
    float furthest;        /* distance of the coarsest level, metres. Default: where a person is 20 pixels of 1080 high */
    float blend_error;     /* error that may end a blend early, as a share of the distance. Default 0.002, which is 2 pixels of 1080 */
    uint32_t kind;         /* the kind of the characters. Default 0 */
} sabaki_crowd_settings;

sabaki_status sabaki_crowd_settings_default(sabaki_crowd_settings *settings);
/* Builds the levels from the graph's clips, which takes a moment, and prepares sabaki_pose_all(); NULL for default settings. */
sabaki_status sabaki_use_crowd(sabaki_game *game, const sabaki_crowd_settings *settings);
/* Size of a buffer for as many characters as have ever existed at once, bytes; 0 before sabaki_use_crowd(). */
size_t sabaki_crowd_bytes(const sabaki_game *game, size_t characters);
/* Writes the poses of all characters, as they are after the last step, for a camera at `eye` (3 numbers), to the `size` bytes at `out`, a
 * multiple of 64. A joint is a matrix of 3 rows and 4 columns, row by row, from its frame to the world. */
sabaki_status sabaki_pose_all(sabaki_game *game, const float *eye, void *out, size_t size);

/* The same for the characters of another kind, each kind in a buffer of its own. sabaki_pose_all() poses the kind 0. */
size_t sabaki_kind_crowd_bytes(const sabaki_game *game, uint32_t kind, size_t characters);
sabaki_status sabaki_pose_kind(sabaki_game *game, uint32_t kind, const float *eye, void *out, size_t size);

/* Where sabaki_pose_all() has written a character: number `n` of joint `j` is the float at start + j * joint_stride + n * number_stride. */
typedef struct sabaki_pose_slice {
    uint32_t size;
    uint32_t joints; /* those of the level */
    uint64_t start;
    uint32_t joint_stride, number_stride;
    uint32_t level;
    float detail;    /* level on which the character looks; the fraction blends to the next one */
} sabaki_pose_slice;

sabaki_status sabaki_pose_slice_of(const sabaki_game *game, sabaki_character character, sabaki_pose_slice *slice);
/* The joint of the graph that stands at `index` on a level; UINT32_MAX beyond the last one. */
uint32_t sabaki_level_joint(const sabaki_game *game, uint32_t level, uint32_t index);
/* The same of another kind. */
uint32_t sabaki_kind_level_joint(const sabaki_game *game, uint32_t kind, uint32_t level, uint32_t index);

/* ---- For a library that is loaded at run time: look up "sabaki_get_api" alone ---- */

/* The functions above without `sabaki_`. New ones come at the end. */
typedef struct sabaki_api {
    uint32_t size;
    uint32_t reserved;
    uint32_t (*version)(void);
    const char *(*last_error)(void);
    void (*set_log)(sabaki_log log, void *user);
    sabaki_status (*graph_open)(const char *path, sabaki_graph **graph);
    sabaki_status (*graph_load)(const void *bytes, size_t size, sabaki_graph **graph);
    void (*graph_close)(sabaki_graph *graph);
    uint32_t (*graph_joints)(const sabaki_graph *graph);
    uint32_t (*graph_spheres)(const sabaki_graph *graph);
    uint32_t (*graph_edges)(const sabaki_graph *graph);
    const char *(*graph_joint_name)(const sabaki_graph *graph, uint32_t joint);
    uint32_t (*graph_joint_parent)(const sabaki_graph *graph, uint32_t joint);
    sabaki_status (*graph_joint_offset)(const sabaki_graph *graph, uint32_t joint, float *offset);
    sabaki_status (*check)(const sabaki_device *device, char *text, size_t size);
    sabaki_status (*culler_create)(const sabaki_graph *graph, const sabaki_device *device, sabaki_path path, uint32_t slots,
        sabaki_culler **culler);
    void (*culler_destroy)(sabaki_culler *culler);
    sabaki_status (*release_staging)(sabaki_culler *culler);
    sabaki_status (*record)(sabaki_culler *culler, uint32_t slot, void *commands, const sabaki_place *place, const sabaki_key *keys,
        size_t key_count);
    sabaki_status (*poll)(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);
    sabaki_status (*answer_now)(sabaki_culler *culler, uint32_t slot, sabaki_answer *answer);
    sabaki_status (*sample_joints)(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_joint *joints, size_t count);
    sabaki_status (*sample_spheres)(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_sphere *spheres, size_t count);
    sabaki_status (*sample_place)(sabaki_culler *culler, uint32_t slot, float seconds, sabaki_place *place);
    sabaki_status (*game_settings_default)(sabaki_game_settings *settings);
    sabaki_status (*game_create)(const sabaki_graph *graph, const sabaki_game_settings *settings, sabaki_game **game);
    void (*game_destroy)(sabaki_game *game);
    double (*game_now)(const sabaki_game *game);
    sabaki_status (*spawn)(sabaki_game *game, float x, float z, float heading, sabaki_character *character);
    sabaki_status (*despawn)(sabaki_game *game, sabaki_character character);
    sabaki_status (*steer)(sabaki_game *game, sabaki_character character, const sabaki_goal *goal);
    sabaki_status (*move_by)(sabaki_game *game, sabaki_character character, float x, float z, float heading);
    sabaki_status (*set_height)(sabaki_game *game, sabaki_character character, float height);
    sabaki_status (*threaten)(sabaki_game *game, const sabaki_threat *threat, uint64_t *id);
    sabaki_status (*update_threat)(sabaki_game *game, uint64_t id, const sabaki_threat *threat);
    sabaki_status (*remove_threat)(sabaki_game *game, uint64_t id);
    sabaki_status (*step)(sabaki_game *game, float dt, const sabaki_obstacle *obstacles, size_t obstacle_count);
    size_t (*events)(const sabaki_game *game, sabaki_event *events, size_t capacity);
    sabaki_status (*pose)(sabaki_game *game, sabaki_character character, sabaki_joint *joints, size_t count);
    sabaki_status (*body)(sabaki_game *game, sabaki_character character, sabaki_sphere *spheres, size_t count);
    sabaki_status (*local_pose_of)(const sabaki_game *game, sabaki_character character, float *root, float *rotations,
        float *translations, size_t count);
    sabaki_status (*release)(sabaki_game *game, sabaki_character character);
    sabaki_status (*resume)(sabaki_game *game, sabaki_character character, const sabaki_local_pose *before, const sabaki_local_pose *now,
        float seconds);
    sabaki_status (*save)(const sabaki_game *game, void *bytes, size_t capacity, size_t *size);
    sabaki_status (*load)(sabaki_game *game, const void *bytes, size_t size);
    sabaki_status (*crowd_settings_default)(sabaki_crowd_settings *settings);
    sabaki_status (*use_crowd)(sabaki_game *game, const sabaki_crowd_settings *settings);
    size_t (*crowd_bytes)(const sabaki_game *game, size_t characters);
    sabaki_status (*pose_all)(sabaki_game *game, const float *eye, void *out, size_t size);
    sabaki_status (*pose_slice_of)(const sabaki_game *game, sabaki_character character, sabaki_pose_slice *slice);
    uint32_t (*level_joint)(const sabaki_game *game, uint32_t level, uint32_t index);
    sabaki_status (*add_kind)(sabaki_game *game, const sabaki_graph *graph, const sabaki_game_settings *settings, uint32_t *kind);
    uint32_t (*kind_of)(const sabaki_game *game, sabaki_character character);
    sabaki_status (*spawn_kind)(sabaki_game *game, uint32_t kind, float x, float z, float heading, sabaki_character *character);
    sabaki_status (*save_character)(const sabaki_game *game, sabaki_character character, void *bytes, size_t capacity, size_t *size);
    sabaki_status (*load_character)(sabaki_game *game, sabaki_character character, const void *bytes, size_t size);
    size_t (*kind_crowd_bytes)(const sabaki_game *game, uint32_t kind, size_t characters);
    sabaki_status (*pose_kind)(sabaki_game *game, uint32_t kind, const float *eye, void *out, size_t size);
    uint32_t (*kind_level_joint)(const sabaki_game *game, uint32_t kind, uint32_t level, uint32_t index);
    sabaki_status (*graph_set_space)(sabaki_graph *graph, uint32_t space);
    sabaki_status (*space_matrix)(uint32_t space, float *matrix);
    sabaki_status (*set_additive)(sabaki_game *game, sabaki_character character, const uint32_t *joints, const float *rotations,
        size_t count);
    sabaki_status (*record_batch)(sabaki_culler *culler, void *commands, const sabaki_query *queries, size_t query_count);
} sabaki_api;

/* Fills the table. If the library is older than the header, `api->size` becomes what it has filled, and what lies beyond stays as it is. */
sabaki_status sabaki_get_api(sabaki_api *api);

#ifdef __cplusplus
}
#endif

#endif
