// A program in C++ that reads a baked graph from memory, with the objects of sabaki.hpp.
#include "sabaki.hpp"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace {

sabaki::Graph load(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    return sabaki::Graph::load(bytes.data(), bytes.size());
}

} // namespace

// Fails when the program has ended.
struct Late {
    ~Late() {
        try {
            sabaki::Graph::load("", 0);
        } catch (const sabaki::Error &) {
            std::puts("too late");
        }
    }
};

static Late late;
thread_local Late late_of_thread;

int main(int count, char **arguments) {
    (void)&late_of_thread;
    if (count != 3) {
        return 2;
    }
    sabaki::Graph graph = load(arguments[1]);
    sabaki::Graph same = sabaki::Graph::open(arguments[1]);
    graph = std::move(same);
    std::cout << graph.joints() << " joints, the last is " << graph.joint_name(graph.joints() - 1) << '\n';
    if (!graph.joint_name(graph.joints()).empty()) {
        return 3;
    }
    sabaki::Game game(graph);
    const sabaki_character character = game.spawn(0, 0, 0);
    sabaki::LocalPose pose = game.local_pose(character);
    game.release(character);
    game.resume(character, pose, pose, 1.0f / 60);
    if (game.local_pose(character).translations.size() != 3 * graph.joints()) {
        return 6;
    }
    sabaki::LocalPose odd = pose;
    odd.rotations.pop_back();
    try {
        game.resume(character, odd, odd, 1.0f / 60);
        return 8;
    } catch (const std::invalid_argument &) {
    }
    pose.translations.pop_back();
    try {
        game.resume(character, pose, pose, 1.0f / 60);
        return 7;
    } catch (const std::invalid_argument &) {
    }
    try {
        // No device: refused, with nothing to free.
        sabaki::Culler(graph, sabaki_device(), SABAKI_COMPUTE, 1);
        return 4;
    } catch (const sabaki::Error &error) {
        if (error.is_device_lost()) {
            return 5;
        }
    }
    try {
        load(arguments[2]);
    } catch (const sabaki::Error &error) {
        std::cout << "refused: " << error.what() << '\n';
        return 0;
    }
    return 1;
}
