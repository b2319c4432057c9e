/* A game that is played by what an older header has as well. Prints where the character is.
 *
 *     same BAKED
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sabaki.h"

static void check(sabaki_status status, const char *what) {
    if (status == SABAKI_OK) return;
    fprintf(stderr, "%s: %s\n", what, sabaki_last_error());
    exit(1);
}

int main(int arguments, char **argument) {
    if (arguments != 2) return 2;
    sabaki_graph *graph = 0;
    sabaki_game *game = 0;
    sabaki_character me = 0;
    uint64_t id = 0;
    int i, hits = 0, misses = 0;
    check(sabaki_graph_open(argument[1], &graph), "sabaki_graph_open");
    sabaki_game_settings settings;
    memset(&settings, 0xff, sizeof settings);
    settings.size = sizeof settings;
    check(sabaki_game_settings_default(&settings), "sabaki_game_settings_default");
    settings.horizon = 1.5f;
    check(sabaki_game_create(graph, &settings, &game), "sabaki_game_create");
    check(sabaki_spawn(game, 0, 0, 0, &me), "sabaki_spawn");
    sabaki_goal walk;
    memset(&walk, 0, sizeof walk);
    walk.size = sizeof walk;
    walk.kind = SABAKI_WALK;
    walk.z = 1.2f;
    check(sabaki_steer(game, me, &walk), "sabaki_steer");
    const sabaki_sphere ball = {{0, 0, 0}, 0.1f};
    sabaki_threat threat;
    memset(&threat, 0, sizeof threat);
    threat.size = sizeof threat;
    threat.time = 1;
    threat.position[1] = 1.2f;
    threat.position[2] = 8;
    threat.velocity[2] = -5;
    threat.seconds = 3;
    threat.spheres = &ball;
    threat.sphere_count = 1;
    check(sabaki_threaten(game, &threat, &id), "sabaki_threaten");
    /* What an older header lacks lies, in its arrays, where a newer one's fields would be. */
    sabaki_obstacle solids[2];
    memset(solids, 0, sizeof solids);
    for (i = 0; i < 2; i++) {
        solids[i].size = sizeof solids[i];
        solids[i].kind = SABAKI_DISC;
        solids[i].radius = 0.4f;
        solids[i].a[0] = i ? -0.3f : 0.3f;
        solids[i].a[2] = 3;
    }
    for (i = 0; i < 240; i++) {
        sabaki_event events[8];
        size_t count, j;
        events[0].size = sizeof events[0];
        check(sabaki_step(game, 1.0f / 60, solids, 2), "sabaki_step");
        count = sabaki_events(game, events, 8);
        for (j = 0; j < count && j < 8; j++) {
            if (events[j].size != sizeof events[j] || events[j].character != me) return 3;
            hits += events[j].kind == SABAKI_HIT;
            misses += events[j].kind == SABAKI_MISSED;
        }
    }
    sabaki_joint root;
    check(sabaki_pose(game, me, &root, 1), "sabaki_pose");
    printf("at %.9g %.9g %.9g, %d hits, %d misses\n", root.position[0], root.position[1], root.position[2], hits, misses);
    sabaki_game_destroy(game);
    sabaki_graph_close(graph);
    return 0;
}
