/* What `same.c` needs, as an older header has it: the structs end earlier. No field of it ever moves. */
#ifndef SABAKI_H
#define SABAKI_H

#include <stddef.h>
#include <stdint.h>

typedef int32_t sabaki_status;
enum { SABAKI_OK = 0 };
enum { SABAKI_WALK = 1, SABAKI_DISC = 4, SABAKI_MISSED = 5, SABAKI_HIT = 6 };
typedef struct sabaki_graph sabaki_graph;
typedef struct sabaki_game sabaki_game;
typedef uint64_t sabaki_character;
typedef struct sabaki_sphere { float center[3]; float radius; } sabaki_sphere;
typedef struct sabaki_joint { float position[3]; float rotation[4]; } sabaki_joint;
typedef struct sabaki_game_settings { uint32_t size; uint32_t threads, delay, plans_per_step; float horizon; } sabaki_game_settings;
typedef struct sabaki_goal { uint32_t size; uint32_t kind; float x, z; } sabaki_goal;
typedef struct sabaki_threat {
    uint32_t size, has_target;
    double time;
    float position[3], velocity[3], gravity, seconds;
    uint32_t sphere_count;
    const sabaki_sphere *spheres;
} sabaki_threat;
typedef struct sabaki_obstacle { uint32_t size, kind; float a[3], b[3], radius, heading; } sabaki_obstacle;
typedef struct sabaki_event { uint32_t size, kind; sabaki_character character; double time; } sabaki_event;

const char *sabaki_last_error(void);
sabaki_status sabaki_graph_open(const char *path, sabaki_graph **graph);
void sabaki_graph_close(sabaki_graph *graph);
sabaki_status sabaki_game_settings_default(sabaki_game_settings *settings);
sabaki_status sabaki_game_create(const sabaki_graph *graph, const sabaki_game_settings *settings, sabaki_game **game);
void sabaki_game_destroy(sabaki_game *game);
sabaki_status sabaki_spawn(sabaki_game *game, float x, float z, float heading, sabaki_character *character);
sabaki_status sabaki_steer(sabaki_game *game, sabaki_character character, const sabaki_goal *goal);
sabaki_status sabaki_threaten(sabaki_game *game, const sabaki_threat *threat, uint64_t *id);
sabaki_status sabaki_step(sabaki_game *game, float dt, const sabaki_obstacle *obstacles, size_t obstacle_count);
size_t sabaki_events(const sabaki_game *game, sabaki_event *events, size_t capacity);
sabaki_status sabaki_pose(sabaki_game *game, sabaki_character character, sabaki_joint *joints, size_t count);

#endif
