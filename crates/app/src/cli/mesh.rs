//! Meshes that characters are drawn with: `--mesh` and `--map`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::{Clip, JointTransform, Skeleton};
use sabaki_draw::scene::{
    BoundMesh, JointNames, Mesh, MeshJoint, MeshTexture, MeshVertex, Outfit, RiggedMesh,
    standing_pose,
};
use sabaki_import::gltf::{SkinVertex, SkinnedMesh};
use sabaki_import::without_mark;
use serde_json::{Value, json};

use super::Failure;
use super::bake::GraphArgs;
use super::output::usage;

/// Options of the mesh.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Mesh")]
pub(crate) struct MeshArgs {
    /// Skinned mesh of the characters (.glb, .gltf, .fbx), `body` for a human body made for the skeleton, or `capsules`. Default: the mesh that the graph's file keeps, otherwise `body`; capsules for a skeleton that is not a human's by its names.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Names of the graph's joints by names of the mesh's joints (JSON). Joints that are not in the file are bound by their names.
    #[arg(long, value_name = "FILE", requires = "mesh")]
    map: Option<PathBuf>,
}

/// Meshes of one or two characters: in the mesh's own colours, and bluish.
pub(crate) struct BoundOutfit {
    pub(crate) outfit: Arc<Outfit>,
    /// Report on the bound joints, as text.
    pub(crate) report: String,
    /// The report as JSON.
    pub(crate) document: Value,
}

/// Colour of the second character.
const BLUE: Vec3 = Vec3::new(0.35, 0.5, 1.0);

impl MeshArgs {
    /// Reads or makes the mesh of a graph's character and binds it to the skeleton. `None` for capsules.
    pub(crate) fn load(
        &self,
        graph: &GraphArgs,
        skeleton: &Skeleton,
        clips: &[Clip],
    ) -> Result<Option<BoundOutfit>, Failure> {
        let is_named = |path: &PathBuf| path.as_os_str() == BODY || path.as_os_str() == CAPSULES;
        if self.map.is_some() && self.mesh.as_ref().is_some_and(is_named) {
            let what = "--map is for the mesh of a file, not for body or capsules";
            return Err(usage(what));
        }
        let (path, mut read) = match &self.mesh {
            None => match graph.mesh()? {
                Some(file) => (PathBuf::from(&file.name), file.mesh()?),
                None => return Ok(BoundOutfit::human(skeleton, clips)),
            },
            Some(path) if path.as_os_str() == CAPSULES => return Ok(None),
            Some(path) if path.as_os_str() == BODY => {
                let what = "a body needs a skeleton whose joints' names tell two legs, two arms and a head";
                let human = BoundOutfit::human(skeleton, clips);
                return human.map(Some).ok_or_else(|| usage(what));
            }
            Some(path) => (path.clone(), sabaki_import::read_mesh(path)?),
        };
        let notes = std::mem::take(&mut read.notes);
        let rigged = rigged(read);
        let names = match &self.map {
            Some(map) => read_names(map)?,
            None => JointNames::new(),
        };
        if let Some(map) = &self.map {
            check_names(&names, &rigged, skeleton).map_err(|error| error.within(map))?;
        }
        let bound = rigged.bind(skeleton, &standing_pose(skeleton, clips), &names);
        let bound = bound.map_err(|error| usage(error).within(&path))?;
        Ok(Some(BoundOutfit::of(bound, &path, notes)))
    }
}

/// Name of the body made by code.
const BODY: &str = "body";
/// Name of the capsules that are drawn without a mesh.
const CAPSULES: &str = "capsules";

impl BoundOutfit {
    fn human(skeleton: &Skeleton, clips: &[Clip]) -> Option<Self> {
        Some(Self {
            outfit: Arc::new(Outfit::human(skeleton, clips)?),
            report: String::new(),
            document: json!({ "file": BODY }),
        })
    }

    /// The outfit, once the lines on what is bound are on stderr.
    #[cfg(feature = "window")]
    pub(crate) fn reported(self) -> Arc<Outfit> {
        eprint!("{}", self.report);
        self.outfit
    }

    fn of(bound: BoundMesh, path: &Path, notes: Vec<String>) -> Self {
        let mut report = format!(
            "{}: {} vertices, {} of {} joints bound{}\n",
            path.display(),
            bound.mesh.vertices.len(),
            bound.bones.len() - bound.unbound.len(),
            bound.bones.len(),
            if bound.is_exact {
                ""
            } else {
                " by their bones' directions"
            },
        );
        if !bound.unbound.is_empty() {
            let unbound = bound.unbound.join(", ");
            report.push_str(&format!("not bound: {unbound}\n"));
        }
        report.extend(notes.iter().map(|note| format!("note: {note}\n")));
        let document = json!({
            "notes": notes,
            "file": path.display().to_string(),
            "vertices": bound.mesh.vertices.len(),
            "joints": bound.bones.len(),
            "exact": bound.is_exact,
            "not_bound": bound.unbound,
        });
        let bluish = bound.mesh.clone().tinted(BLUE);
        Self {
            outfit: Arc::new(Outfit::new([bound.mesh, bluish], bound.bones)),
            report,
            document,
        }
    }
}

fn read_names(path: &Path) -> Result<JointNames, Failure> {
    let text = std::fs::read(path).map_err(|error| usage(error).within(path))?;
    serde_json::from_slice(without_mark(&text)).map_err(|error| usage(error).within(path))
}

/// A name that neither side has is a mistake.
fn check_names(
    names: &JointNames,
    rigged: &RiggedMesh,
    skeleton: &Skeleton,
) -> Result<(), Failure> {
    let of_mesh: Vec<&str> = rigged.joints.iter().map(|joint| &joint.name[..]).collect();
    let joints = skeleton.joints().iter();
    let of_graph: Vec<&str> = joints.map(|joint| &joint.name[..]).collect();
    for (own, other) in names {
        for (what, name, all) in [("mesh", own, &of_mesh), ("graph", other, &of_graph)] {
            if !all.contains(&name.as_str()) {
                let all = all.join(", ");
                return Err(usage(format!(
                    "the {what} has no joint {name:?} among {all}"
                )));
            }
        }
    }
    Ok(())
}

/// The mesh of a file in the form that is drawn.
fn rigged(file: SkinnedMesh) -> RiggedMesh {
    let whole = |share: f32| (share.clamp(0.0, 1.0) * 65_535.0).round() as u16;
    let vertex = |vertex: &SkinVertex| {
        let [red, green, blue, _] = vertex.colour;
        let textured = if vertex.uv.is_some() { 1.0 } else { 0.0 };
        MeshVertex {
            position: vertex.position.to_array(),
            normal: vertex.normal.to_array(),
            uv: vertex.uv.unwrap_or_default().to_array(),
            colour: [red, green, blue, textured].map(whole),
            bones: vertex.joints,
            weights: vertex.weights.map(whole),
        }
    };
    let texture = file.texture.map(|texture| MeshTexture {
        width: texture.width,
        height: texture.height,
        texels: texture.texels,
    });
    let joints = file.joints.into_iter().map(|joint| MeshJoint {
        name: joint.name,
        parent: joint.parent,
        bind: JointTransform {
            rotation: joint.rotation,
            translation: joint.position,
        },
    });
    let vertices = file.vertices.iter().map(vertex).collect();
    RiggedMesh {
        mesh: Mesh::new(vertices, file.triangles, texture),
        joints: joints.collect(),
    }
}
