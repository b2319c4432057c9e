// sabaki for C++11: objects that free themselves, and exceptions in place of status codes, over sabaki.h.
//
//     sabaki::Graph graph = sabaki::Graph::open("fight.sabaki");
//     sabaki::Culler culler(graph, device, SABAKI_COMPUTE, 2);
//     culler.record(slot, commands, place, keys);
//     auto answer = sabaki::sized<sabaki_answer>();
//     if (culler.poll(slot, answer)) ...
//
// A Culler must be destroyed when the device has finished its commands, and before the device is destroyed.
#ifndef SABAKI_HPP
#define SABAKI_HPP

#include <array>
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

// A struct that begins with its size, with zeros behind it.
template <typename T> T sized() {
    T value = {};
    value.size = sizeof value;
    return value;
}

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

    // The space of your engine. Set it before games and cullers are made.
    void set_space(sabaki_space space) { check(sabaki_graph_set_space(handle_, space)); }
    std::uint32_t joints() const { return sabaki_graph_joints(handle_); }
    std::uint32_t spheres() const { return sabaki_graph_spheres(handle_); }
    std::uint32_t edges() const { return sabaki_graph_edges(handle_); }
    std::string joint_name(std::uint32_t joint) const {
        const char *name = sabaki_graph_joint_name(handle_, joint);
        return name ? name : "";
    }
    // UINT32_MAX for the root.
    std::uint32_t joint_parent(std::uint32_t joint) const { return sabaki_graph_joint_parent(handle_, joint); }
    // In the parent's frame, in the rest pose.
    std::array<float, 3> joint_offset(std::uint32_t joint) const {
        std::array<float, 3> offset;
        check(sabaki_graph_joint_offset(handle_, joint, offset.data()));
        return offset;
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
    void record(void *commands, const std::vector<sabaki_query> &queries) {
        check(sabaki_record_batch(handle_, commands, queries.data(), queries.size()));
    }
    void record(std::uint32_t slot, void *commands, const sabaki_place &place, const std::vector<sabaki_key> &attack) {
        check(sabaki_record(handle_, slot, commands, &place, attack.data(), attack.size()));
    }
    // Frees the staging memory of the maps, once the device has answered a query and nothing else is in flight.
    void release_staging() { check(sabaki_release_staging(handle_)); }
    // Whether the answer is there. Never waits.
    bool poll(std::uint32_t slot, sabaki_answer &answer) {
        const sabaki_status status = sabaki_poll(handle_, slot, &answer);
        check(status);
        return status == SABAKI_OK;
    }
    // The answer now, counted by the CPU.
    sabaki_answer answer_now(std::uint32_t slot) {
        auto answer = sized<sabaki_answer>();
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

// A pose by its root and by the rotations (4 numbers each) and positions (3 numbers each) of the joints relative to their parents. Without
// positions the joints keep the skeleton's offsets.
struct LocalPose {
    float root[3];
    std::vector<float> rotations;
    std::vector<float> translations;
};

// Characters of a game.
class Game {
public:
    static sabaki_game_settings default_settings() {
        auto settings = sized<sabaki_game_settings>();
        check(sabaki_game_settings_default(&settings));
        return settings;
    }
    explicit Game(const Graph &graph) : kinds_{{graph.joints(), graph.spheres()}} {
        check(sabaki_game_create(graph.handle(), nullptr, &handle_));
    }
    Game(const Graph &graph, const sabaki_game_settings &settings) : kinds_{{graph.joints(), graph.spheres()}} {
        check(sabaki_game_create(graph.handle(), &settings, &handle_));
    }
    Game(Game &&other) noexcept : handle_(other.handle_), kinds_(std::move(other.kinds_)) { other.handle_ = nullptr; }
    Game &operator=(Game &&other) noexcept {
        std::swap(handle_, other.handle_);
        std::swap(kinds_, other.kinds_);
        return *this;
    }
    Game(const Game &) = delete;
    Game &operator=(const Game &) = delete;
    ~Game() { sabaki_game_destroy(handle_); }

    double now() const { return sabaki_game_now(handle_); }
    sabaki_character spawn(float x, float z, float heading) {
        sabaki_character character = 0;
        check(sabaki_spawn(handle_, x, z, heading, &character));
        return character;
    }
    // A kind of character: another graph, or the same one with other settings. The game was created with the kind 0.
    std::uint32_t add_kind(const Graph &graph, const sabaki_game_settings &settings) {
        std::uint32_t kind = 0;
        check(sabaki_add_kind(handle_, graph.handle(), &settings, &kind));
        kinds_.push_back({graph.joints(), graph.spheres()});
        return kind;
    }
    sabaki_character spawn_kind(std::uint32_t kind, float x, float z, float heading) {
        sabaki_character character = 0;
        check(sabaki_spawn_kind(handle_, kind, x, z, heading, &character));
        return character;
    }
    void despawn(sabaki_character character) { check(sabaki_despawn(handle_, character)); }
    void move_by(sabaki_character character, float x, float z, float heading) {
        check(sabaki_move_by(handle_, character, x, z, heading));
    }
    void set_height(sabaki_character character, float height) { check(sabaki_set_height(handle_, character, height)); }
    void steer(sabaki_character character, const sabaki_goal &goal) { check(sabaki_steer(handle_, character, &goal)); }
    std::uint64_t threaten(const sabaki_threat &threat) {
        std::uint64_t id = 0;
        check(sabaki_threaten(handle_, &threat, &id));
        return id;
    }
    void update(std::uint64_t id, const sabaki_threat &threat) { check(sabaki_update_threat(handle_, id, &threat)); }
    void remove(std::uint64_t id) { check(sabaki_remove_threat(handle_, id)); }
    // The events of the step. Valid until the next step.
    const std::vector<sabaki_event> &step(float dt, const std::vector<sabaki_obstacle> &obstacles) {
        check(sabaki_step(handle_, dt, obstacles.data(), obstacles.size()));
        events_.resize(sabaki_events(handle_, nullptr, 0), sized<sabaki_event>());
        sabaki_events(handle_, events_.data(), events_.size());
        return events_;
    }
    // The joints in the world, and the spheres of the body. An array that has their number already is not allocated again.
    void pose(sabaki_character character, std::vector<sabaki_joint> &joints) {
        joints.resize(sizes(character).joints);
        check(sabaki_pose(handle_, character, joints.data(), joints.size()));
    }
    void body(sabaki_character character, std::vector<sabaki_sphere> &spheres) {
        spheres.resize(sizes(character).spheres);
        check(sabaki_body(handle_, character, spheres.data(), spheres.size()));
    }
    // Levels of detail for pose_all(), which writes `size` bytes at most.
    static sabaki_crowd_settings default_crowd_settings() {
        auto settings = sized<sabaki_crowd_settings>();
        check(sabaki_crowd_settings_default(&settings));
        return settings;
    }
    void use_crowd(const sabaki_crowd_settings &settings) { check(sabaki_use_crowd(handle_, &settings)); }
    std::size_t crowd_bytes(std::size_t characters, std::uint32_t kind = 0) const {
        return sabaki_kind_crowd_bytes(handle_, kind, characters);
    }
    void pose_all(const float eye[3], void *out, std::size_t size, std::uint32_t kind = 0) {
        check(sabaki_pose_kind(handle_, kind, eye, out, size));
    }
    sabaki_pose_slice pose_slice(sabaki_character character) const {
        auto slice = sized<sabaki_pose_slice>();
        check(sabaki_pose_slice_of(handle_, character, &slice));
        return slice;
    }
    std::uint32_t level_joint(std::uint32_t level, std::uint32_t index, std::uint32_t kind = 0) const {
        return sabaki_kind_level_joint(handle_, kind, level, index);
    }
    LocalPose local_pose(sabaki_character character) const {
        const std::size_t count = sizes(character).joints;
        LocalPose pose = {{0, 0, 0}, std::vector<float>(4 * count), std::vector<float>(3 * count)};
        check(sabaki_local_pose_of(handle_, character, pose.root, pose.rotations.data(), pose.translations.data(), count));
        return pose;
    }
    // Rotations (xyzw) that are added to joints, four numbers each.
    void set_additive(sabaki_character character, const std::vector<std::uint32_t> &joints, const std::vector<float> &rotations) {
        if (rotations.size() != 4 * joints.size()) {
            throw std::invalid_argument("the rotations are not four numbers for each joint");
        }
        check(sabaki_set_additive(handle_, character, joints.data(), rotations.data(), joints.size()));
    }
    // Hands the body to something else, and takes it back from two poses that were seen `seconds` apart.
    void release(sabaki_character character) { check(sabaki_release(handle_, character)); }
    void resume(sabaki_character character, const LocalPose &before, const LocalPose &now, float seconds) {
        const sabaki_local_pose poses[2] = {view(before), view(now)};
        check(sabaki_resume(handle_, character, &poses[0], &poses[1], seconds));
    }
    std::vector<unsigned char> save() const {
        std::size_t size = 0;
        check(sabaki_save(handle_, nullptr, 0, &size));
        std::vector<unsigned char> bytes(size);
        check(sabaki_save(handle_, bytes.data(), bytes.size(), &size));
        return bytes;
    }
    void load(const std::vector<unsigned char> &bytes) { check(sabaki_load(handle_, bytes.data(), bytes.size())); }
    // The same of one character.
    std::vector<unsigned char> save(sabaki_character character) const {
        std::size_t size = 0;
        check(sabaki_save_character(handle_, character, nullptr, 0, &size));
        std::vector<unsigned char> bytes(size);
        check(sabaki_save_character(handle_, character, bytes.data(), bytes.size(), &size));
        return bytes;
    }
    void load(sabaki_character character, const std::vector<unsigned char> &bytes) {
        check(sabaki_load_character(handle_, character, bytes.data(), bytes.size()));
    }
    sabaki_game *handle() { return handle_; }

private:
    static sabaki_local_pose view(const LocalPose &pose) {
        const std::size_t count = pose.rotations.size() / 4;
        if (pose.rotations.size() != 4 * count) {
            throw std::invalid_argument("the rotations of a pose are not four numbers each");
        }
        if (!pose.translations.empty() && pose.translations.size() != 3 * count) {
            throw std::invalid_argument("rotations and translations of a pose differ in number");
        }
        const float *translations = pose.translations.empty() ? nullptr : pose.translations.data();
        return {sizeof(sabaki_local_pose), static_cast<std::uint32_t>(count), {pose.root[0], pose.root[1], pose.root[2]},
                pose.rotations.data(), translations};
    }
    // Of a kind: how many joints and spheres a character has.
    struct Sizes {
        std::uint32_t joints, spheres;
    };
    Sizes sizes(sabaki_character character) const {
        const std::uint32_t kind = sabaki_kind_of(handle_, character);
        return kind < kinds_.size() ? kinds_[kind] : kinds_[0];
    }
    sabaki_game *handle_ = nullptr;
    std::vector<Sizes> kinds_;
    std::vector<sabaki_event> events_;
};

} // namespace sabaki

#endif
