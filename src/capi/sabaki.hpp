// sabaki for C++11: objects that free themselves, and exceptions in place of status codes, over sabaki.h.
//
//     sabaki::Graph graph = sabaki::Graph::open("fight.sabaki");
//     sabaki::Culler culler(graph, device, SABAKI_COMPUTE, 2);
//     culler.record(slot, commands, place, keys);
//     sabaki_answer answer;
//     if (culler.poll(slot, answer)) ...
//
// A Culler must be destroyed when the device has finished its commands, and before the device is destroyed.
#ifndef SABAKI_HPP
#define SABAKI_HPP

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sabaki.h"

namespace sabaki {

// A call that failed.
class Error : public std::runtime_error {
public:
    explicit Error(sabaki_status status) : std::runtime_error(sabaki_last_error()), status_(status) {}
    // Whether the device is lost: everything on it must be destroyed.
    bool is_device_lost() const { return status_ == SABAKI_DEVICE_LOST; }

private:
    sabaki_status status_;
};

inline void check(sabaki_status status) {
    if (status < 0) {
        throw Error(status);
    }
}

// What a device offers, or what its host has enabled: a line for each path and for each missing optional feature. Throws where
// no path runs.
inline std::string report(const sabaki_device &device) {
    char text[2048] = "";
    check(sabaki_check(&device, text, sizeof text));
    return text;
}

// A baked graph.
class Graph {
public:
    static Graph open(const std::string &path) {
        Graph graph;
        check(sabaki_graph_open(path.c_str(), &graph.handle_));
        return graph;
    }
    // From the bytes of a baked file, which are not needed afterwards.
    static Graph load(const void *bytes, std::size_t size) {
        Graph graph;
        check(sabaki_graph_load(bytes, size, &graph.handle_));
        return graph;
    }
    Graph(Graph &&other) noexcept : handle_(other.handle_) { other.handle_ = nullptr; }
    Graph &operator=(Graph &&other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    Graph(const Graph &) = delete;
    Graph &operator=(const Graph &) = delete;
    ~Graph() { sabaki_graph_close(handle_); }

    std::uint32_t joints() const { return sabaki_graph_joints(handle_); }
    std::uint32_t spheres() const { return sabaki_graph_spheres(handle_); }
    std::uint32_t edges() const { return sabaki_graph_edges(handle_); }
    std::string joint_name(std::uint32_t joint) const {
        const char *name = sabaki_graph_joint_name(handle_, joint);
        return name ? name : "";
    }
    const sabaki_graph *handle() const { return handle_; }

private:
    Graph() = default;
    sabaki_graph *handle_ = nullptr;
};

// Queries in flight on the host's device.
class Culler {
public:
    Culler(const Graph &graph, const sabaki_device &device, sabaki_path path, std::uint32_t slots)
        : joints_(graph.joints()), spheres_(graph.spheres()) {
        check(sabaki_culler_create(graph.handle(), &device, path, slots, &handle_));
    }
    Culler(Culler &&other) noexcept
        : handle_(other.handle_), joints_(other.joints_), spheres_(other.spheres_) {
        other.handle_ = nullptr;
    }
    Culler &operator=(Culler &&other) noexcept {
        std::swap(handle_, other.handle_);
        std::swap(joints_, other.joints_);
        std::swap(spheres_, other.spheres_);
        return *this;
    }
    Culler(const Culler &) = delete;
    Culler &operator=(const Culler &) = delete;
    ~Culler() { sabaki_culler_destroy(handle_); }

    // Starts a query; `commands` is a VkCommandBuffer that is being recorded.
    void record(std::uint32_t slot, void *commands, const sabaki_place &place, const std::vector<sabaki_key> &attack) {
        check(sabaki_record(handle_, slot, commands, &place, attack.data(), attack.size()));
    }
    // Whether the answer is there. Never waits.
    bool poll(std::uint32_t slot, sabaki_answer &answer) {
        const sabaki_status status = sabaki_poll(handle_, slot, &answer);
        check(status);
        return status == SABAKI_OK;
    }
    // The answer now, counted by the CPU.
    sabaki_answer answer_now(std::uint32_t slot) {
        sabaki_answer answer = {};
        check(sabaki_answer_now(handle_, slot, &answer));
        return answer;
    }
    // The body in the answer's motion, `seconds` after the query started.
    std::vector<sabaki_joint> joints(std::uint32_t slot, float seconds) {
        std::vector<sabaki_joint> joints(joints_);
        check(sabaki_sample_joints(handle_, slot, seconds, joints.data(), joints.size()));
        return joints;
    }
    std::vector<sabaki_sphere> spheres(std::uint32_t slot, float seconds) {
        std::vector<sabaki_sphere> spheres(spheres_);
        check(sabaki_sample_spheres(handle_, slot, seconds, spheres.data(), spheres.size()));
        return spheres;
    }
    sabaki_place place(std::uint32_t slot, float seconds) {
        sabaki_place place = {};
        check(sabaki_sample_place(handle_, slot, seconds, &place));
        return place;
    }

private:
    sabaki_culler *handle_ = nullptr;
    std::uint32_t joints_;
    std::uint32_t spheres_;
};

} // namespace sabaki

#endif
