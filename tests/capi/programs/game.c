/* A game in C: two characters walk, are threatened, saved, loaded, released and resumed; what is wrong is refused and logged.
 *
 *     game BAKED
 */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sabaki.h"

static int logged;

static void count(void *user, const char *message) {
    (void)message;
    logged += *(int *)user;
}

static void fail(const char *what) {
    fprintf(stderr, "%s: %s\n", what, sabaki_last_error());
    exit(1);
}

static void check(sabaki_status status, const char *what) {
    if (status != SABAKI_OK) fail(what);
}

static volatile int has_entered, is_inside;

static void slow(void *user, const char *message) {
    (void)user;
    (void)message;
    is_inside = has_entered = 1;
    usleep(200000);
    is_inside = 0;
}

static void *open_nothing(void *user) {
    sabaki_graph *graph = 0;
    sabaki_graph_open("/no/such/file", &graph);
    return user;
}

/* What replaces a log waits until the log is not in use. */
static void replace_log(void) {
    pthread_t thread;
    sabaki_set_log(slow, 0);
    if (pthread_create(&thread, 0, open_nothing, 0) != 0) fail("a thread");
    while (!has_entered) usleep(1000);
    sabaki_set_log(0, 0);
    if (is_inside) fail("a log that was replaced is running");
    pthread_join(thread, 0);
}

/* The end of a program is no reason to abort, nor to forget. */
static void fail_at_the_end(void) {
    sabaki_graph *graph = 0;
    if (sabaki_graph_load(0, 1, &graph) != SABAKI_ERROR) _exit(4);
    if (strcmp(sabaki_last_error(), "bytes is NULL") != 0) _exit(5);
}

static pthread_key_t at_the_end_of_a_thread;

static void fail_with_the_thread(void *user) {
    fail_at_the_end();
    *(int *)user = 1;
}

static void *fail_and_end(void *user) {
    if (pthread_setspecific(at_the_end_of_a_thread, user) != 0) fail("a key");
    return open_nothing(user);
}

static void fail_in_destructors(void) {
    pthread_t thread;
    int has_failed = 0;
    if (pthread_key_create(&at_the_end_of_a_thread, fail_with_the_thread) != 0) fail("a key");
    if (pthread_create(&thread, 0, fail_and_end, &has_failed) != 0) fail("a thread");
    pthread_join(thread, 0);
    if (!has_failed) fail("a destructor");
    atexit(fail_at_the_end);
}

/* Checks that a call failed, with words that have these in them. */
static void refused(sabaki_status status, const char *words) {
    if (status == SABAKI_ERROR && strstr(sabaki_last_error(), words)) return;
    fprintf(stderr, "not in the message: %s\n", words);
    fail("what was to be refused");
}

int main(int arguments, char **argument) {
    if (arguments != 2) return 2;
    fail_in_destructors();
    int one = 1;
    replace_log();
    sabaki_set_log(count, &one);
    sabaki_graph *graph = 0;
    check(sabaki_graph_open(argument[1], &graph), "sabaki_graph_open");
    sabaki_game_settings settings;
    sabaki_game_settings_default(&settings);
    settings.threads = 2;
    settings.body_radius = 0.25f;
    sabaki_game *game = 0, *other = 0;
    settings.horizon = 61;
    refused(sabaki_game_create(graph, &settings, &game), "the horizon is 61; it must be 0 to 60");
    settings.horizon = 1.6f;
    check(sabaki_game_create(graph, &settings, &game), "sabaki_game_create");
    check(sabaki_game_create(graph, &settings, &other), "sabaki_game_create");
    uint32_t joints = sabaki_graph_joints(graph), i;
    sabaki_graph_close(graph);

    sabaki_character me = 0, you = 0;
    check(sabaki_spawn(game, 0, 0, 0, &me), "sabaki_spawn");
    check(sabaki_spawn(game, 3, 0, 1, &you), "sabaki_spawn");
    sabaki_goal walk = {SABAKI_WALK, 0, 1.2f, 0, 0, 0}, there = {SABAKI_GO_TO, 3, 4, 0, 0, 1};
    check(sabaki_steer(game, me, &walk), "sabaki_steer");
    check(sabaki_steer(game, you, &there), "sabaki_steer");
    sabaki_sphere ball = {{0, 0, 0}, 0.1f};
    sabaki_threat threat = {1.0, {0, 1.2f, 6}, {0, 0, -5}, 0, 3, &ball, 1, 1, 0};
    threat.target = me;
    uint64_t id = 0;
    check(sabaki_threaten(game, &threat, &id), "sabaki_threaten");
    threat.position[0] = 6000;
    refused(sabaki_update_threat(game, id, &threat), "distance from the origin is 6000");
    threat.target = 77;
    threat.position[0] = 0;
    refused(sabaki_threaten(game, &threat, &id), "no character 77");
    threat.target = me;
    threat.position[0] = 0.05f;
    check(sabaki_update_threat(game, id, &threat), "sabaki_update_threat");
    const float corners[6] = {4, 5, 5, 5, 5, 6};
    sabaki_obstacle solids[3];
    memset(solids, 0, sizeof solids);
    solids[0].kind = SABAKI_HALF_SPACE;
    solids[0].a[2] = 8;
    solids[0].b[2] = -1;
    solids[1].kind = SABAKI_POLYGON;
    solids[1].corners = corners;
    solids[1].corner_count = 3;
    solids[2].kind = SABAKI_DISC;
    solids[2].a[0] = -2;
    solids[2].radius = 0.3f;
    solids[2].velocity[2] = 0.5f;

    sabaki_event events[8];
    int happened = 0;
    for (i = 0; i < 150; i++) {
        check(sabaki_step(game, 1.0f / 60, solids, 3), "sabaki_step");
        happened += (int)sabaki_events(game, events, 8);
    }
    if (happened == 0) fail("events");
    size_t size = 0;
    check(sabaki_save(game, 0, 0, &size), "sabaki_save");
    unsigned char *bytes = malloc(size);
    check(sabaki_save(game, bytes, size, &size), "sabaki_save");
    check(sabaki_load(other, bytes, size), "sabaki_load");
    sabaki_joint *mine = calloc(joints, sizeof *mine), *same = calloc(joints, sizeof *same);
    for (i = 0; i < 60; i++) {
        check(sabaki_step(game, 1.0f / 60, solids, 3), "sabaki_step");
        check(sabaki_step(other, 1.0f / 60, solids, 3), "sabaki_step");
    }
    check(sabaki_pose(game, me, mine, joints), "sabaki_pose");
    check(sabaki_pose(other, me, same, joints), "sabaki_pose");
    if (memcmp(mine, same, joints * sizeof *mine) != 0) fail("a loaded game differs");

    /* Out to something else that holds the pose, and back in. */
    float *rotations = calloc(4 * joints, sizeof *rotations);
    sabaki_local_pose pose = {{0, 0, 0}, rotations, 0, joints};
    check(sabaki_local_pose_of(game, me, pose.root, rotations, 0, joints), "sabaki_local_pose_of");
    check(sabaki_release(game, me), "sabaki_release");
    check(sabaki_resume(game, me, &pose, &pose, 1.0f / 60), "sabaki_resume");
    check(sabaki_pose(game, me, same, joints), "sabaki_pose");
    for (i = 0; i < joints; i++) {
        if (fabsf(same[i].position[1] - mine[i].position[1]) > 0.01f) fail("a joint jumps");
    }

    /* The same with a joint that has moved in its parent's frame. */
    float *translations = calloc(3 * joints, sizeof *translations), square = 0;
    check(sabaki_local_pose_of(game, me, pose.root, rotations, translations, joints), "sabaki_local_pose_of");
    translations[3] += 0.3f;
    pose.translations = translations;
    check(sabaki_release(game, me), "sabaki_release");
    check(sabaki_resume(game, me, &pose, &pose, 1.0f / 60), "sabaki_resume");
    check(sabaki_pose(game, me, same, joints), "sabaki_pose");
    for (i = 0; i < 3; i++) {
        float apart = same[1].position[i] - same[0].position[i];
        square += translations[3 + i] * translations[3 + i] - apart * apart;
    }
    if (fabsf(square) > 1e-3f) fail("a translation is lost on the way in");
    float moved = translations[3];
    check(sabaki_local_pose_of(game, me, pose.root, rotations, translations, joints), "sabaki_local_pose_of");
    if (fabsf(translations[3] - moved) > 1e-3f) fail("a translation is lost on the way out");

    logged = 0;
    solids[1].corner_count = 2;
    refused(sabaki_step(game, 0.1f, solids, 3), "obstacle 1: a polygon needs");
    if (sabaki_load(game, bytes, size - 1) != SABAKI_ERROR) fail("a damaged game");
    if (sabaki_remove_threat(game, 99) != SABAKI_ERROR) fail("a threat that is not there");
    check(sabaki_despawn(game, you), "sabaki_despawn");
    if (sabaki_steer(game, you, &walk) != SABAKI_ERROR) fail("a character that is gone");
    if (logged != 4) fail("the log");
    printf("walked %.2f m in %.2f s, %d events\n", mine[0].position[2], sabaki_game_now(game), happened);
    free(rotations);
    free(translations);
    free(bytes);
    free(mine);
    free(same);
    sabaki_game_destroy(game);
    sabaki_game_destroy(other);
    return 0;
}
