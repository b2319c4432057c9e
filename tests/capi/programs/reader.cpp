// A program in C++ that reads a baked graph from memory: the header within another language and its own idioms.
#include "sabaki.h"

#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>

namespace {

struct Close {
    void operator()(sabaki_graph *graph) const { sabaki_graph_close(graph); }
};
using Graph = std::unique_ptr<sabaki_graph, Close>;

Graph open(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    sabaki_graph *graph = nullptr;
    if (sabaki_graph_load(bytes.data(), bytes.size(), &graph) != SABAKI_OK) {
        throw std::runtime_error(sabaki_last_error());
    }
    return Graph(graph);
}

} // namespace

int main(int count, char **arguments) {
    if (count != 3) {
        return 2;
    }
    const Graph graph = open(arguments[1]);
    std::cout << sabaki_graph_joints(graph.get()) << " joints, the last is "
              << sabaki_graph_joint_name(graph.get(), sabaki_graph_joints(graph.get()) - 1) << '\n';
    try {
        open(arguments[2]);
    } catch (const std::runtime_error &error) {
        std::cout << "refused: " << error.what() << '\n';
        return 0;
    }
    return 1;
}
