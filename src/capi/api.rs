//! The version, and the table of all functions, for programs that load the library at run time.

use super::given;
use super::{crowd, culler, device, game, game_state, graph, log, status};

/// Version as a number: `SABAKI_VERSION_NUMBER`.
const VERSION: u32 = {
    const fn number(text: &str) -> u32 {
        let (bytes, mut value, mut index) = (text.as_bytes(), 0, 0);
        while index < bytes.len() {
            value = value * 10 + (bytes[index] - b'0') as u32;
            index += 1;
        }
        value
    }
    let major = number(env!("CARGO_PKG_VERSION_MAJOR"));
    let minor = number(env!("CARGO_PKG_VERSION_MINOR"));
    major * 1_000_000 + minor * 1000 + number(env!("CARGO_PKG_VERSION_PATCH"))
};

/// A function of any type.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Function(*const ());

// SAFETY: functions may be shared by threads.
unsafe impl Sync for Function {}

/// `sabaki_api`: its size, then the functions in the order of the header.
static FUNCTIONS: &[Function] = &[
    Function(sabaki_version as *const ()),
    Function(status::sabaki_last_error as *const ()),
    Function(log::sabaki_set_log as *const ()),
    Function(graph::sabaki_graph_open as *const ()),
    Function(graph::sabaki_graph_load as *const ()),
    Function(graph::sabaki_graph_close as *const ()),
    Function(graph::sabaki_graph_joints as *const ()),
    Function(graph::sabaki_graph_spheres as *const ()),
    Function(graph::sabaki_graph_edges as *const ()),
    Function(graph::sabaki_graph_joint_name as *const ()),
    Function(graph::sabaki_graph_joint_parent as *const ()),
    Function(graph::sabaki_graph_joint_offset as *const ()),
    Function(device::sabaki_check as *const ()),
    Function(culler::sabaki_culler_create as *const ()),
    Function(culler::sabaki_culler_destroy as *const ()),
    Function(culler::sabaki_release_staging as *const ()),
    Function(culler::sabaki_record as *const ()),
    Function(culler::sabaki_poll as *const ()),
    Function(culler::sabaki_answer_now as *const ()),
    Function(culler::sabaki_sample_joints as *const ()),
    Function(culler::sabaki_sample_spheres as *const ()),
    Function(culler::sabaki_sample_place as *const ()),
    Function(game::sabaki_game_settings_default as *const ()),
    Function(game::sabaki_game_create as *const ()),
    Function(game::sabaki_game_destroy as *const ()),
    Function(game::sabaki_game_now as *const ()),
    Function(game::sabaki_spawn as *const ()),
    Function(game::sabaki_despawn as *const ()),
    Function(game::sabaki_steer as *const ()),
    Function(game::sabaki_move_by as *const ()),
    Function(game::sabaki_set_height as *const ()),
    Function(game::sabaki_threaten as *const ()),
    Function(game::sabaki_update_threat as *const ()),
    Function(game::sabaki_remove_threat as *const ()),
    Function(game::sabaki_step as *const ()),
    Function(game::sabaki_events as *const ()),
    Function(game::sabaki_pose as *const ()),
    Function(game::sabaki_body as *const ()),
    Function(game_state::sabaki_local_pose_of as *const ()),
    Function(game_state::sabaki_release as *const ()),
    Function(game_state::sabaki_resume as *const ()),
    Function(game_state::sabaki_save as *const ()),
    Function(game_state::sabaki_load as *const ()),
    Function(crowd::sabaki_crowd_settings_default as *const ()),
    Function(crowd::sabaki_use_crowd as *const ()),
    Function(crowd::sabaki_crowd_bytes as *const ()),
    Function(crowd::sabaki_pose_all as *const ()),
    Function(crowd::sabaki_pose_slice_of as *const ()),
    Function(crowd::sabaki_level_joint as *const ()),
    Function(game::sabaki_add_kind as *const ()),
    Function(game::sabaki_kind_of as *const ()),
    Function(game::sabaki_spawn_kind as *const ()),
    Function(game_state::sabaki_save_character as *const ()),
    Function(game_state::sabaki_load_character as *const ()),
    Function(crowd::sabaki_kind_crowd_bytes as *const ()),
    Function(crowd::sabaki_pose_kind as *const ()),
    Function(crowd::sabaki_kind_level_joint as *const ()),
    Function(graph::sabaki_graph_set_space as *const ()),
    Function(graph::sabaki_space_matrix as *const ()),
    Function(game_state::sabaki_set_additive as *const ()),
    Function(culler::sabaki_record_batch as *const ()),
];

exported! {
    unsafe extern "C" fn sabaki_version() -> u32 {
        VERSION
    }

    unsafe extern "C" fn sabaki_get_api(api: *mut u8) {
        // SAFETY: the caller's table begins with its size.
        let size = given(unsafe { api.cast::<u32>().as_mut() }, "api")?;
        let room = (*size as usize).saturating_sub(2 * size_of::<u32>()) / size_of::<Function>();
        let filled = room.min(FUNCTIONS.len());
        *size = (2 * size_of::<u32>() + filled * size_of::<Function>()) as u32;
        // SAFETY: the caller's table has room for so many functions behind the two words.
        unsafe {
            let to = api.add(2 * size_of::<u32>()).cast();
            std::ptr::copy_nonoverlapping(FUNCTIONS.as_ptr(), to, filled);
        }
    }
}
