// A program in C++ that reads a baked graph from memory, with the objects of sabaki.hpp.
#include "sabaki.hpp"

#include <cstdint>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

namespace {

sabaki::Graph load(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    return sabaki::Graph::load(bytes.data(), bytes.size());
}

} // namespace

int main(int count, char **arguments) {
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
