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

/* Parents and bone lengths of the rest pose. */
static uint32_t parents[256];
static float lengths[256];
static uint32_t body_count;

static void rest_pose(const sabaki_graph *graph, uint32_t joints) {
    uint32_t i;
    float offset[3];
    body_count = sabaki_graph_spheres(graph);
    if (joints > 256 || body_count > 256) fail("a large graph");
    for (i = 0; i < joints; i++) {
        parents[i] = sabaki_graph_joint_parent(graph, i);
        check(sabaki_graph_joint_offset(graph, i, offset), "sabaki_graph_joint_offset");
        lengths[i] = sqrtf(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
        if (i == 0 ? parents[0] != UINT32_MAX : parents[i] >= i) fail("a parent");
    }
    if (sabaki_graph_joint_parent(graph, joints) != UINT32_MAX) fail("the parent of no joint");
    refused(sabaki_graph_joint_offset(graph, joints, offset), "there is no joint");
}

static float apart(const float *a, const float *b) {
    return sqrtf((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* A character's joints, its body, and the same among all, near the camera and far away. */
static void pose_as_one_and_as_all(sabaki_game *game, sabaki_character me, uint32_t joints) {
    sabaki_joint pose[256];
    sabaki_sphere body[256];
    uint32_t i, j;
    check(sabaki_pose(game, me, pose, joints), "sabaki_pose");
    check(sabaki_body(game, me, body, body_count), "sabaki_body");
    for (i = 0; i < body_count; i++) {
        for (j = 0; apart(body[i].center, pose[j].position) > 0.5f; j++) {
            if (j + 1 == joints) fail("a sphere without a joint");
        }
    }
    sabaki_crowd_settings settings = {0};
    settings.size = sizeof settings;
    check(sabaki_crowd_settings_default(&settings), "sabaki_crowd_settings_default");
    settings.near = 5;
    settings.furthest = 30;
    if (sabaki_crowd_bytes(game, 2) != 0) fail("a crowd before its levels");
    check(sabaki_use_crowd(game, &settings), "sabaki_use_crowd");
    const size_t bytes = sabaki_crowd_bytes(game, 2);
    float *memory = malloc(bytes + 128), *out = (float *)(((uintptr_t)memory + 64) & ~(uintptr_t)63);
    const float near[3] = {pose[0].position[0], 1, pose[0].position[2] + 1}, far[3] = {0, 1, 60};
    refused(sabaki_pose_all(game, near, out + 1, bytes), "multiple of 64");
    refused(sabaki_pose_all(game, near, out, 64), "");
    sabaki_pose_slice slice = {0};
    slice.size = sizeof slice;
    check(sabaki_pose_all(game, near, out, bytes), "sabaki_pose_all");
    check(sabaki_pose_slice_of(game, me, &slice), "sabaki_pose_slice_of");
    if (slice.level != 0 || slice.joints < 12 || slice.joint_stride != 12 || slice.number_stride != 1) fail("a slice");
    for (i = 0; i < slice.joints; i++) {
        const uint32_t joint = sabaki_level_joint(game, 0, i);
        const float *matrix = out + slice.start + i * slice.joint_stride;
        const float place[3] = {matrix[3], matrix[7], matrix[11]};
        if (joint >= joints || apart(place, pose[joint].position) > 1e-3f) fail("a joint among all");
    }
    if (sabaki_level_joint(game, 0, slice.joints) != UINT32_MAX) fail("a joint beyond the last one");
    const uint32_t all = slice.joints;
    /* Once no blend is left, far away. */
    for (i = 0; i < 300 && slice.level == 0; i++) {
        check(sabaki_step(game, 1.0f / 60, 0, 0), "sabaki_step");
        check(sabaki_pose_all(game, far, out, bytes), "sabaki_pose_all");
        check(sabaki_pose_slice_of(game, me, &slice), "sabaki_pose_slice_of");
    }
    if (slice.detail < 1 || slice.level == 0 || slice.joints >= all) fail("a level of detail");
    free(memory);
}

/* A kind with other settings in the same game, its crowd, and one of its characters sent to another game. */
static void kinds(const char *path, sabaki_game *game, sabaki_game *other) {
    sabaki_graph *graph = 0;
    check(sabaki_graph_open(path, &graph), "sabaki_graph_open");
    sabaki_game_settings settings = {0};
    sabaki_crowd_settings crowd = {0};
    sabaki_character here, there;
    uint32_t kind = 0, same = 0;
    size_t size = 0;
    settings.size = sizeof settings;
    check(sabaki_game_settings_default(&settings), "sabaki_game_settings_default");
    settings.margin = 0.1f;
    check(sabaki_add_kind(game, graph, &settings, &kind), "sabaki_add_kind");
    check(sabaki_add_kind(other, graph, &settings, &same), "sabaki_add_kind");
    if (kind != 1 || same != 1) fail("the second kind");
    sabaki_graph_close(graph);
    check(sabaki_spawn_kind(game, kind, 20, 0, 1, &here), "sabaki_spawn_kind");
    check(sabaki_spawn_kind(other, kind, 0, 20, 0, &there), "sabaki_spawn_kind");
    refused(sabaki_spawn_kind(game, 70000, 0, 0, 0, &there), "no kind");
    if (sabaki_kind_of(game, here) != kind || sabaki_kind_of(game, UINT64_MAX) != UINT32_MAX) fail("the kind of a character");
    check(sabaki_save_character(game, here, 0, 0, &size), "sabaki_save_character");
    unsigned char *bytes = malloc(size);
    check(sabaki_save_character(game, here, bytes, size, &size), "sabaki_save_character");
    check(sabaki_load_character(other, there, bytes, size), "sabaki_load_character");
    refused(sabaki_load_character(other, there, bytes, size - 1), "damaged");
    float root[2][3], rotations[4];
    check(sabaki_local_pose_of(game, here, root[0], rotations, 0, 1), "sabaki_local_pose_of");
    check(sabaki_local_pose_of(other, there, root[1], rotations, 0, 1), "sabaki_local_pose_of");
    if (memcmp(root[0], root[1], sizeof root[0]) != 0) fail("a character in another game");
    crowd.size = sizeof crowd;
    check(sabaki_crowd_settings_default(&crowd), "sabaki_crowd_settings_default");
    crowd.kind = kind;
    check(sabaki_use_crowd(game, &crowd), "sabaki_use_crowd");
    size = sabaki_kind_crowd_bytes(game, kind, 8);
    if (size == 0 || sabaki_kind_crowd_bytes(game, 9, 8) != 0) fail("the size of a crowd");
    float *memory = malloc(size + 128), *out = (float *)(((uintptr_t)memory + 64) & ~(uintptr_t)63);
    const float eye[3] = {20, 1, 3};
    sabaki_pose_slice slice = {0};
    slice.size = sizeof slice;
    check(sabaki_pose_kind(game, kind, eye, out, size), "sabaki_pose_kind");
    check(sabaki_pose_slice_of(game, here, &slice), "sabaki_pose_slice_of");
    if (sabaki_kind_level_joint(game, kind, slice.level, 0) != 0) fail("the root of a level");
    if (fabsf(out[slice.start + 3] - root[0][0]) > 1e-3f) fail("a character of another kind among all");
    free(memory);
    free(bytes);
    check(sabaki_despawn(game, here), "sabaki_despawn");
}

/* A place in metres, +Y up, as Unreal has it. */
static void unreal(const float *from, float *to) {
    to[0] = 100 * from[2];
    to[1] = -100 * from[0];
    to[2] = 100 * from[1];
}

/* The same game in two spaces: what is thrown, what stands in the way, and where the joints are. */
static void spaces(const char *path) {
    static const sabaki_sphere balls[2] = {{{0, 0, 0}, 0.1f}, {{0, 0, 0}, 10}};
    sabaki_joint joints[2][256];
    sabaki_character me[2];
    sabaki_game *games[2] = {0, 0};
    sabaki_obstacle walls[2] = {{0}, {0}};
    sabaki_threat threats[2] = {{0}, {0}};
    sabaki_goal goal = {0};
    uint64_t id;
    uint32_t space, count = 0, joint_count = 5000, i, frame;
    walls[0].a[0] = 1.5f;
    walls[0].a[1] = 1;
    walls[0].a[2] = 3;
    walls[0].b[0] = 0.4f;
    walls[0].b[1] = 1;
    walls[0].b[2] = 0.2f;
    unreal(walls[0].a, walls[1].a);
    unreal(walls[0].b, walls[1].b);
    walls[1].b[1] = 40;
    walls[0].heading = 0.4f;
    walls[1].heading = -0.4f;
    threats[0].position[0] = -0.5f;
    threats[0].position[1] = 1.2f;
    threats[0].position[2] = 7;
    threats[0].velocity[2] = -6;
    threats[0].velocity[0] = 0.3f;
    for (space = 0; space < 2; space++) {
        sabaki_graph *graph = 0;
        check(sabaki_graph_open(path, &graph), "sabaki_graph_open");
        refused(sabaki_graph_set_space(graph, 4), "no space 4");
        check(sabaki_graph_set_space(graph, space == 0 ? SABAKI_Y_UP : SABAKI_UNREAL), "sabaki_graph_set_space");
        check(sabaki_game_create(graph, 0, &games[space]), "sabaki_game_create");
        count = sabaki_graph_joints(graph);
        sabaki_graph_close(graph);
        check(sabaki_spawn(games[space], space == 0 ? 0.5f : 0, space == 0 ? 0 : -50, space == 0 ? 0.3f : -0.3f, &me[space]), "sabaki_spawn");
        check(sabaki_set_height(games[space], me[space], space == 0 ? 0.2f : 20), "sabaki_set_height");
        goal.size = sizeof goal;
        goal.kind = SABAKI_GO_TO;
        goal.x = space == 0 ? 2 : 500;
        goal.z = space == 0 ? 5 : -200;
        goal.speed = space == 0 ? 1.3f : 130;
        check(sabaki_steer(games[space], me[space], &goal), "sabaki_steer");
        walls[space].size = sizeof walls[space];
        walls[space].kind = SABAKI_BLOCK;
        threats[space].size = sizeof threats[space];
        threats[space].seconds = 2;
        threats[space].gravity = space == 0 ? 0.5f : 50;
        threats[space].sphere_count = 1;
        threats[space].spheres = &balls[space];
        unreal(threats[0].position, threats[1].position);
        unreal(threats[0].velocity, threats[1].velocity);
        check(sabaki_threaten(games[space], &threats[space], &id), "sabaki_threaten");
    }
    for (frame = 0; frame < 120; frame++) {
        for (space = 0; space < 2; space++) {
            check(sabaki_step(games[space], 1.0f / 60, &walls[space], 1), "sabaki_step");
            check(sabaki_pose(games[space], me[space], joints[space], count), "sabaki_pose");
        }
        if (frame == 60) {
            /* A turn of 0.4 about the host's up, or ours. */
            static const uint32_t spine = 1;
            static const float turns[2][4] = {{0, 0.198669f, 0, 0.980067f}, {0, 0, -0.198669f, 0.980067f}};
            for (space = 0; space < 2; space++) {
                check(sabaki_set_additive(games[space], me[space], &spine, turns[space], 1), "sabaki_set_additive");
            }
            refused(sabaki_set_additive(games[0], me[0], &joint_count, turns[0], 1), "the number of the joint");
        }
        for (i = 0; i < count; i++) {
            float place[3];
            unreal(joints[0][i].position, place);
            if (apart(place, joints[1][i].position) > 5) fail("a joint in another space");
            /* The same turn, about an axis in the other space. */
            const float *q = joints[0][i].rotation, *r = joints[1][i].rotation;
            if (fabsf(-q[2] * r[0] + q[0] * r[1] - q[1] * r[2] + q[3] * r[3]) < 0.998f) fail("a turn in another space");
        }
    }
    if (joints[0][0].position[2] < 1) fail("a walk in two spaces");
    for (space = 0; space < 2; space++) sabaki_game_destroy(games[space]);
}

/* One character strikes another, until its first strike has ended. */
static void strike(sabaki_game *game, sabaki_character me, sabaki_character you) {
    sabaki_event events[16];
    sabaki_goal goal = {0};
    size_t count, i;
    int frame, strikes = 0;
    events[0].size = sizeof events[0];
    goal.size = sizeof goal;
    goal.kind = SABAKI_STRIKE;
    goal.has_target = 1;
    goal.target = you;
    goal.has_limb = 1;
    goal.limb = 65536;
    refused(sabaki_steer(game, me, &goal), "there is no joint 65536");
    goal.has_limb = 0;
    check(sabaki_steer(game, me, &goal), "sabaki_steer");
    goal.kind = SABAKI_IDLE;
    check(sabaki_steer(game, you, &goal), "sabaki_steer");
    for (frame = 0; frame < 3600; frame++) {
        check(sabaki_step(game, 1.0f / 60, 0, 0), "sabaki_step");
        count = sabaki_events(game, events, 16);
        for (i = 0; i < count && i < 16; i++) {
            strikes += events[i].kind == SABAKI_STRIKES && events[i].character == me;
            if (events[i].kind != SABAKI_STRIKE_ENDED || strikes == 0) continue;
            if (events[i].character != me || !events[i].is_whole) fail("a strike that nothing breaks off");
            return;
        }
    }
    fail("a strike");
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
    settings.size = 0;
    refused(sabaki_game_settings_default(&settings), "the size of settings is 0");
    settings.size = sizeof settings;
    check(sabaki_game_settings_default(&settings), "sabaki_game_settings_default");
    if (settings.plans_per_step != 24 || settings.plan_work != 4000 || settings.steer_turn != 3.5f || settings.searches_per_step != 8) fail("default settings");
    settings.threads = 2;
    settings.body_radius = 0.25f;
    sabaki_game *game = 0, *other = 0;
    settings.horizon = 61;
    refused(sabaki_game_create(graph, &settings, &game), "the horizon is 61; it must be 0 to 60");
    settings.horizon = 1.6f;
    check(sabaki_game_create(graph, &settings, &game), "sabaki_game_create");
    check(sabaki_game_create(graph, &settings, &other), "sabaki_game_create");
    uint32_t joints = sabaki_graph_joints(graph), i;
    rest_pose(graph, joints);
    sabaki_graph_close(graph);

    sabaki_character me = 0, you = 0;
    check(sabaki_spawn(game, 0, 0, 0, &me), "sabaki_spawn");
    check(sabaki_spawn(game, 3, 0, 1, &you), "sabaki_spawn");
    sabaki_goal walk = {0}, there = {0};
    walk.size = there.size = sizeof walk;
    walk.kind = SABAKI_WALK;
    walk.z = 1.2f;
    there.kind = SABAKI_GO_TO;
    there.x = 3;
    there.z = 4;
    there.speed = 1;
    check(sabaki_steer(game, me, &walk), "sabaki_steer");
    check(sabaki_steer(game, you, &there), "sabaki_steer");
    sabaki_sphere ball = {{0, 0, 0}, 0.1f};
    sabaki_threat threat = {sizeof threat, 1, 1.0, {0, 1.2f, 6}, {0, 0, -5}, 0, 3, 1, &ball, 0};
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
    solids[0].size = sizeof solids[0];
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
    events[0].size = sizeof events[0];
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
    for (i = 1; i < joints; i++) {
        if (fabsf(apart(mine[i].position, mine[parents[i]].position) - lengths[i]) > 1e-3f) fail("a bone of another length");
    }

    /* Out to something else that holds the pose, and back in. */
    float *rotations = calloc(4 * joints, sizeof *rotations);
    sabaki_local_pose pose = {sizeof pose, joints, {0, 0, 0}, rotations, 0};
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
        float way = same[1].position[i] - same[0].position[i];
        square += translations[3 + i] * translations[3 + i] - way * way;
    }
    if (fabsf(square) > 1e-3f) fail("a translation is lost on the way in");
    float moved = translations[3];
    check(sabaki_local_pose_of(game, me, pose.root, rotations, translations, joints), "sabaki_local_pose_of");
    if (fabsf(translations[3] - moved) > 1e-3f) fail("a translation is lost on the way out");

    pose_as_one_and_as_all(other, me, joints);
    strike(other, me, you);
    kinds(argument[1], game, other);
    spaces(argument[1]);
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
