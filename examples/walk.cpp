// A game in C++17: walk with W A S D in a room, dodge what is thrown. X stands still, Q quits.
//
//     cargo rustc --release --lib --no-default-features --features capi --crate-type staticlib
//     c++ -std=c++17 examples/walk.cpp -I src/capi target/release/libsabaki.a -lm -lpthread -ldl -o walk
//
// or with CMake, by find_package(sabaki): examples/CMakeLists.txt.
//     ./walk fight.sabaki
//
// Without a terminal the keys are read from the input, each for half a second: echo "wwdd  aa" | ./walk fight.sabaki
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <termios.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "sabaki.hpp"

namespace {

constexpr float frame = 1.0f / 60.0f, room = 4.0f;

// Keys from a terminal as they are pressed, or from a script.
class Keys {
public:
    Keys() : terminal_(isatty(0) && tcgetattr(0, &before_) == 0) {
        if (terminal_) {
            termios raw = before_;
            raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
            raw.c_cc[VMIN] = raw.c_cc[VTIME] = 0;
            tcsetattr(0, TCSANOW, &raw);
        }
    }
    ~Keys() {
        if (terminal_) tcsetattr(0, TCSANOW, &before_);
    }
    bool is_terminal() const { return terminal_; }
    // The key of a frame: 0 if none is new, nothing at the end.
    std::optional<char> next(int number) {
        char key = 0;
        if (!terminal_ && number % 30 != 0) return key;
        const bool got = read(0, &key, 1) == 1;
        if (key == 'q' || (!got && !terminal_)) return std::nullopt;
        return key;
    }

private:
    termios before_{};
    bool terminal_;
};

// Four walls and a pillar.
std::vector<sabaki_obstacle> walls() {
    constexpr uint32_t size = sizeof(sabaki_obstacle);
    std::vector<sabaki_obstacle> all;
    for (const auto &[x, z] : {std::pair{1.0f, 0.0f}, {-1.0f, 0.0f}, {0.0f, 1.0f}, {0.0f, -1.0f}}) {
        all.push_back({size, SABAKI_HALF_SPACE, {x * room, 0, z * room}, {-x, 0, -z}, 0, 0, {}, 0, 0, nullptr});
    }
    all.push_back({size, SABAKI_CAPSULE, {1.5f, 0, 2}, {1.5f, 2, 2}, 0.3f, 0, {}, 0, 0, nullptr});
    return all;
}

// A ball from one of the walls at where the body will be.
sabaki_threat thrown(const sabaki_joint &root, int number, double now, const sabaki_sphere &ball) {
    const float angle = 2.4f * static_cast<float>(number), seconds = 0.8f;
    auto threat = sabaki::sized<sabaki_threat>();
    threat.time = now + 0.5;
    threat.position[0] = room * std::sin(angle);
    threat.position[1] = 1.2f;
    threat.position[2] = room * std::cos(angle);
    for (int axis = 0; axis < 3; axis++) {
        threat.velocity[axis] = (root.position[axis] - threat.position[axis]) / seconds;
    }
    threat.seconds = 1.6f;
    threat.spheres = &ball;
    threat.sphere_count = 1;
    return threat;
}

// The room from above: # walls, O the pillar, @ the character.
void draw(const sabaki_joint &root, const std::string &line) {
    std::string picture = "\x1b[H";
    for (float z = room; z >= -room; z -= 0.5f) {
        for (float x = room; x >= -room; x -= 0.25f) {
            const bool edge = std::max(std::abs(x), std::abs(z)) >= room;
            const bool me = std::hypot(x - root.position[0], z - root.position[2]) < 0.25f;
            picture += me ? '@' : edge ? '#' : std::hypot(x - 1.5f, z - 2) < 0.35f ? 'O' : ' ';
        }
        picture += '\n';
    }
    std::printf("%s%s\x1b[K\n", picture.c_str(), line.c_str());
}

int play(const char *file) {
    const sabaki::Graph graph = sabaki::Graph::open(file);
    sabaki::Game game(graph);
    const sabaki_character me = game.spawn(0, 0, 0);
    const std::vector<sabaki_obstacle> obstacles = walls();
    const sabaki_sphere ball{{0, 0, 0}, 0.1f};
    auto goal = sabaki::sized<sabaki_goal>();
    std::vector<sabaki_joint> joints;
    game.pose(me, joints);
    Keys keys;
    std::string line = "W A S D walk, X stands, Q quits";
    float entered = 0;
    for (int number = 0;; number++) {
        const std::optional<char> key = keys.next(number);
        if (!key) break;
        const std::string ways = "wdsa";
        if (const size_t way = ways.find(*key); *key != 0 && way != std::string::npos) {
            const float heading = -1.5707963f * static_cast<float>(way);
            goal.kind = SABAKI_WALK;
            goal.x = 1.3f * std::sin(heading);
            goal.z = 1.3f * std::cos(heading);
        } else if (*key == 'x' || *key == ' ') {
            goal = sabaki::sized<sabaki_goal>();
        }
        game.steer(me, goal);
        if (number % 150 == 60) game.threaten(thrown(joints[0], number, game.now(), ball));
        for (const sabaki_event &event : game.step(frame, obstacles)) {
            char text[80] = "";
            if (event.kind == SABAKI_MISSED) std::snprintf(text, sizeof text, "%.1f s: missed by %.2f m", event.time, event.metres);
            if (event.kind == SABAKI_HIT) std::snprintf(text, sizeof text, "%.1f s: hit", event.time);
            if (*text) line = text;
            if (*text && !keys.is_terminal()) std::puts(text);
        }
        game.pose(me, joints);
        for (const sabaki_joint &joint : joints) {
            for (const int axis : {0, 2}) entered = std::max(entered, std::abs(joint.position[axis]) - room);
        }
        if (keys.is_terminal()) {
            draw(joints[0], line);
            std::this_thread::sleep_for(std::chrono::microseconds(16667));
        }
    }
    std::printf("entered the walls by %.3f m\n", entered);
    return 0;
}

} // namespace

int main(int count, char **arguments) {
    if (count != 2) return 2;
    try {
        return play(arguments[1]);
    } catch (const sabaki::Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
