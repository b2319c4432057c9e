//! Removes the channels of animations that have no node. The specification (3.11) has readers ignore them, and the extension
//! KHR_animation_pointer writes them, but the crate `gltf-json` rejects the file.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::{RawValue, to_raw_value};

type Object = BTreeMap<String, Box<RawValue>>;

/// The file without the channels that have no node; `None` if all have one, or if the text is invalid.
pub(super) fn without_nodeless(json: &[u8]) -> Option<Vec<u8>> {
    let mut root: Object = serde_json::from_slice(json).ok()?;
    let mut animations: Vec<Object> = serde_json::from_str(root.get("animations")?.get()).ok()?;
    let mut removed = 0;
    for animation in &mut animations {
        let Some(channels) = animation.get_mut("channels") else {
            continue;
        };
        let mut kept: Vec<Box<RawValue>> = serde_json::from_str(channels.get()).ok()?;
        let all = kept.len();
        kept.retain(|channel| has_node(channel));
        removed += all - kept.len();
        *channels = to_raw_value(&kept).ok()?;
    }
    if removed == 0 {
        return None;
    }
    root.insert("animations".to_owned(), to_raw_value(&animations).ok()?);
    serde_json::to_vec(&root).ok()
}

/// Whether a channel has a node. What is no channel is left for later checks.
fn has_node(channel: &RawValue) -> bool {
    #[derive(Deserialize)]
    struct Channel {
        target: Target,
    }
    #[derive(Deserialize)]
    struct Target {
        node: Option<IgnoredAny>,
    }
    let channel: Result<Channel, _> = serde_json::from_str(channel.get());
    channel.map_or(true, |channel| channel.target.node.is_some())
}
