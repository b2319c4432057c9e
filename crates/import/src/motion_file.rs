//! Reads the motions of one file, whatever its format, in metres and with +Y up.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipError, Facing, JointId, Leg, Limbs, Pose, Skeleton, body_root};
use serde::{Deserialize, Serialize};

use crate::asf::AsfFile;
use crate::channels::ChannelFile;
use crate::clip_set::{Loaded, load_all};
use crate::error::shortened;
use crate::figure::{Rooted, for_some_frames, mapped, settle_bones, settle_places, settle_sides};
use crate::file::{clip_name, read_bytes};
use crate::gltf::{GltfAnimation, GltfFile, ReadPurpose, SkinnedMesh};
use crate::units::{Stance, sampled};
use crate::{EventEntry, FileError, LengthUnit, ReadError, Scale, ScaleSource, bvh, stature};

/// Maximum duration of a clip, in seconds: ten hours. Longer clips come from wrong frame times and
/// would exhaust memory.
pub const LONGEST_CLIP: f64 = 36_000.0;

/// Maximum number of frames times joints of a motion file; of a glTF file, of all its animations together, and of their keys. It limits memory, because a
/// few bytes of a file can stand for many frames of many joints.
pub const MOST_ENTRIES: u64 = 1 << 26;

/// Range of [`ReadOptions::scale`], in metres per unit: from a millionth of a millimetre to a thousand kilometres.
pub const SCALES: RangeInclusive<f64> = 1e-9..=1e6;

/// Range of an AMC file's frame rate, in frames per second.
pub(crate) const AMC_RATES: RangeInclusive<f64> = 1e-3..=1e6;

/// Options for reading files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Scale of the files, in metres per unit. Default `None`: BVH files are scaled by the
    /// figure's stature, one scale for all files of one skeleton; glTF files by 1.
    pub scale: Option<f64>,
    /// Axis that points up in the files. Default `None`: files of one skeleton are turned if their figure stands along another axis than +Y in
    /// nearly all poses and at rest, which is a warning.
    pub up: Option<Up>,
    /// Frame rate of AMC files, in frames per second. Default `None`: the file's `:SAMPLES-PER-SECOND`, or
    /// [`USUAL_RATE`](crate::asf::USUAL_RATE).
    pub amc_rate: Option<f64>,
    /// Leaves out files that cannot be read, and files whose skeleton differs from that of the largest group of files, instead of
    /// refusing a set of clips. Default `false`.
    pub keep_going: bool,
    /// Puts motions of other skeletons on that of the largest group of files, by the joints' names, instead of refusing them. A warning
    /// says what this costs. Default `false`.
    pub retarget: bool,
}

/// A motion from a file, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedClip {
    /// Skeleton of the figure, in metres. Its root is the joint where legs and trunk meet ([`body_root`]). The motion of the file's joints above
    /// it is part of the root's ([`Skeleton::whole`]).
    pub skeleton: Skeleton,
    /// Motion, named after the file without its folder.
    pub clip: Clip,
    /// Scale of the file.
    pub scale: Scale,
    /// Axis that is up in the file.
    pub up: Up,
    /// Events in the file itself. Only glTF files can contain them, in their `extras`.
    pub events: Vec<EventEntry>,
    /// Names that several joints have in the file. The first joint keeps the name, the others have a number behind it.
    pub repeated_names: Vec<String>,
    /// Doubtful contents of the file, one line each.
    pub notes: Vec<String>,
}

/// Reads the only motion of a file, in metres. The extension determines the format: glTF (`.glb`,
/// `.gltf`), AMC (`.amc`), otherwise BVH.
///
/// # Errors
/// The first error, with the file and the position in it. A file with several motions is an error.
pub fn read_clip(path: &Path, options: &ReadOptions) -> Result<LoadedClip, ReadError> {
    let mut motions = read_motions(path, options)?;
    match motions.pop() {
        Some(only) if motions.is_empty() => Ok(only),
        last => {
            let all = motions.iter().chain(&last);
            let names: Vec<String> = all.map(|motion| motion.clip.name().to_owned()).collect();
            let error = FileError::part("it holds several motions", shortened(&names));
            Err(ReadError::in_file(path)(error))
        }
    }
}

/// Reads all motions of a file, in metres: one of a BVH or AMC file, one for each animation of a
/// glTF file.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_motions(path: &Path, options: &ReadOptions) -> Result<Vec<LoadedClip>, ReadError> {
    check_options(options)?;
    let loaded = load_all(&[path.to_owned()], options).into_iter();
    let settled = |(_, loaded): Loaded| {
        let (mut motion, _) = loaded?;
        let clip = std::slice::from_mut(&mut motion.clip);
        settle_bones(&mut motion.skeleton, clip).map_err(ReadError::in_file(path))?;
        let (_, note) = settle_sides(&mut motion.skeleton, clip);
        motion.notes.extend(note);
        let stood = settle_places(&motion.skeleton, clip).map_err(ReadError::in_file(path))?;
        motion.notes.extend(stood);
        let stature = doubtful_stature(&motion.skeleton, &motion.clip);
        motion.notes.extend(stature);
        motion.notes.extend(turned(motion.up, options));
        Ok(motion)
    };
    loaded.map(settled).collect()
}

/// Checks that scale and frame rate are within their ranges.
pub(super) fn check_options(options: &ReadOptions) -> Result<(), ReadError> {
    match (options.scale, options.amc_rate) {
        (Some(scale), _) if !SCALES.contains(&scale) => Err(ReadError::Scale(scale)),
        (_, Some(rate)) if !AMC_RATES.contains(&rate) => Err(ReadError::Rate(rate)),
        _ => Ok(()),
    }
}

/// A parsed motion file, in its own unit.
pub(super) enum MotionFile {
    Channels(ChannelFile),
    Gltf(Box<GltfFile>),
}

/// Whether a path has one of the extensions, ignoring case.
fn ends_with(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default();
    endings
        .iter()
        .any(|known| ending.eq_ignore_ascii_case(known))
}

/// Whether a path has the extension of a glTF file, or of an FBX file, which is read as glTF if the feature `fbx` is enabled.
#[must_use]
pub fn is_gltf(path: &Path) -> bool {
    ends_with(path, &["glb", "gltf"]) || is_fbx(path)
}

fn is_fbx(path: &Path) -> bool {
    cfg!(feature = "fbx") && ends_with(path, &["fbx"])
}

/// The bytes of a glTF file, or of what is read of an FBX file as glTF.
fn gltf_bytes(path: &Path, purpose: ReadPurpose) -> Result<Vec<u8>, ReadError> {
    let bytes = read_bytes(path)?;
    #[cfg(feature = "fbx")]
    if is_fbx(path) {
        return crate::fbx::to_glb(&bytes, purpose).map_err(ReadError::in_file(path));
    }
    #[cfg(not(feature = "fbx"))]
    let _ = purpose;
    Ok(bytes)
}

/// Whether a file's name ends as those of motion files do. Of a folder, these files are read.
#[must_use]
pub fn is_motion_file(path: &Path) -> bool {
    ends_with(path, &["bvh", "amc"]) || is_gltf(path)
}

/// Reads a BVH file in its own unit.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_bvh(path: &Path) -> Result<ChannelFile, ReadError> {
    bvh::parse(&read_bytes(path)?).map_err(ReadError::in_file(path))
}

/// Reads a glTF file in its own unit. External buffers are read from its folder.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_gltf(path: &Path) -> Result<GltfFile, ReadError> {
    GltfFile::parse(&gltf_bytes(path, ReadPurpose::Motion)?, beside(path))
        .map_err(ReadError::in_file(path))
}

/// Reads files from the folder of a file.
fn beside(path: &Path) -> impl FnMut(&Path) -> Result<Vec<u8>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    move |file| read_bytes(&folder.join(file)).map_err(|error| error.to_string())
}

/// Reads the skinned mesh of a glTF file in its own unit. External files are read from its folder.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_mesh(path: &Path) -> Result<SkinnedMesh, ReadError> {
    MeshFile::read(path).map(|(_, mesh)| mesh)
}

/// A glTF file with the files beside it that its mesh needs, to be kept elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshFile {
    /// Name of the file.
    pub name: String,
    bytes: Vec<u8>,
    beside: Vec<(PathBuf, Vec<u8>)>,
}

impl MeshFile {
    /// Reads a file, and its skinned mesh.
    ///
    /// # Errors
    /// The first error, with the file and the position in it.
    pub fn read(path: &Path) -> Result<(Self, SkinnedMesh), ReadError> {
        let mut file = Self {
            name: clip_name(path),
            bytes: gltf_bytes(path, ReadPurpose::Mesh)?,
            beside: Vec::new(),
        };
        let mut load = beside(path);
        let mesh = SkinnedMesh::parse(&file.bytes, |name| {
            let bytes = load(name)?;
            file.beside.push((name.to_owned(), bytes.clone()));
            Ok(bytes)
        });
        let mesh = mesh.map_err(ReadError::in_file(path))?;
        Ok((file, mesh))
    }

    /// The skinned mesh.
    ///
    /// # Errors
    /// The first error, with the file's name and the position in it.
    pub fn mesh(&self) -> Result<SkinnedMesh, ReadError> {
        let mesh = SkinnedMesh::parse(&self.bytes, |name| {
            let mut beside = self.beside.iter();
            let found = beside.find(|(of, _)| of == name);
            found
                .map(|(_, bytes)| bytes.clone())
                .ok_or_else(|| "it was not kept".to_owned())
        });
        mesh.map_err(ReadError::in_file(Path::new(&self.name)))
    }
}

/// Path of an AMC file's skeleton: the ASF file of the same name, of the part of the name before
/// the first `_` (`02_01.amc` has `02.asf`), or the only ASF file of the folder.
fn skeleton_of(path: &Path) -> Result<PathBuf, ReadError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let subject = stem.split('_').next().unwrap_or(&stem);
    let mut names = vec![format!("{stem}.asf"), format!("{subject}.asf")];
    names.dedup();
    let mut beside = names.iter().map(|name| path.with_file_name(name));
    if let Some(found) = beside.find(|file| file.is_file()) {
        return Ok(found);
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new(".")))
        .into_iter()
        .flatten();
    let files = entries.flatten().map(|entry| entry.path());
    let mut all = files.filter(|file| ends_with(file, &["asf"]) && file.is_file());
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only),
        _ => Err(ReadError::in_file(path)(FileError::NoSkeleton(names))),
    }
}

/// A note on an axis that is up and that nobody said.
pub(super) fn turned(up: Up, options: &ReadOptions) -> Option<String> {
    let name = up.name();
    let is_found = options.up.is_none() && up != Up::Y;
    is_found.then(|| format!("the figure stands along {name}, which is taken for up: say the axis (--up) if that is wrong"))
}

/// Whether no figure has this height in metres: it is smaller than a hand-sized creature, or higher than a house.
fn is_no_figure(metres: f64) -> bool {
    metres > 0.0 && !(0.1..=20.0).contains(&metres)
}

/// A note on a figure that is far from any person's height, as with a wrong scale.
pub(super) fn doubtful_stature(skeleton: &Skeleton, clip: &Clip) -> Option<String> {
    let mut pose = Pose::default();
    clip.pose(0, &mut pose);
    let metres = stature(skeleton, &pose);
    is_no_figure(metres).then(|| {
        format!(
            "the figure is {metres:.2} m high: say the metres per unit (--scale) if that is wrong"
        )
    })
}

impl MotionFile {
    /// Reads a file whose extension determines its format. Files with other extensions are read as
    /// BVH.
    pub(super) fn read(path: &Path, options: &ReadOptions) -> Result<Self, ReadError> {
        if is_gltf(path) {
            return Ok(Self::Gltf(Box::new(read_gltf(path)?)));
        }
        if ends_with(path, &["amc"]) {
            let skeleton = skeleton_of(path)?;
            let asf = AsfFile::parse(&read_bytes(&skeleton)?);
            let asf = asf.map_err(ReadError::in_file(&skeleton))?;
            let amc = asf.motion(&read_bytes(path)?);
            let mut amc = amc.map_err(ReadError::in_file(path))?;
            amc.frame_rate = options.amc_rate.unwrap_or(amc.frame_rate);
            return Ok(Self::Channels(amc));
        }
        Ok(Self::Channels(read_bvh(path)?))
    }

    /// How the figure stands in the file.
    pub(super) fn stance(&self) -> Stance {
        let Some(skeleton) = self.skeleton() else {
            return Stance::default();
        };
        let poses = match self {
            Self::Channels(file) => {
                sampled(file.frames(), |frame, pose| file.pose(frame, 1.0, pose))
            }
            Self::Gltf(file) => {
                let clips = file.animations.iter().map(|animation| &animation.clip);
                let of_clip =
                    |clip: &Clip| sampled(clip.frames(), |frame, pose| clip.pose(frame, pose));
                clips.flat_map(of_clip).collect()
            }
        };
        let mut rest = Pose::at_rest(&skeleton, Vec3::ZERO);
        if let Self::Gltf(file) = self {
            rest.rotations.clone_from(&file.rest);
        }
        Stance::of(&skeleton, &rest, &poses)
    }

    /// Whether the format tells the unit.
    pub(super) fn is_in_metres(&self) -> bool {
        matches!(self, Self::Gltf(_))
    }

    pub(super) fn scale(&self, stance: &Stance, options: &ReadOptions) -> Scale {
        let given = |metres_per_unit, found| Scale {
            metres_per_unit,
            found,
        };
        match options.scale {
            Some(scale) => given(scale, ScaleSource::Given),
            None if self.is_in_metres() && !is_no_figure(stance.stature) => {
                given(LengthUnit::Metre.metres(), ScaleSource::Format)
            }
            None => Scale::of_stature(stance.stature),
        }
    }

    /// Skeleton, in the file's unit.
    pub(super) fn skeleton(&self) -> Option<Skeleton> {
        match self {
            Self::Channels(file) => file.skeleton(1.0).ok(),
            Self::Gltf(file) => Some(file.skeleton.clone()),
        }
    }

    /// All motions of the file, in metres. A single motion is named after the file, one of several
    /// after the file and itself: `fox.glb:Walk`.
    pub(super) fn to_metres(
        &self,
        path: &Path,
        scale: Scale,
        up: Up,
    ) -> Result<Vec<LoadedClip>, ReadError> {
        let name = clip_name(path);
        let metres = scale.metres_per_unit;
        let loaded = |seconds: f64, motion: &dyn Fn() -> Result<(Skeleton, Clip), FileError>| {
            if seconds > LONGEST_CLIP {
                return Err(FileError::Invalid(format!(
                    "the motion lasts {seconds} s; {LONGEST_CLIP} s is the most"
                )));
            }
            let (mut skeleton, mut clip) = motion()?;
            let turn = up.turn();
            if up != Up::Y && self.is_in_metres() {
                // The joints keep their frames, to which a mesh is bound.
                let (joints, mut desc) = (skeleton.len(), clip.desc());
                let places = desc.translations.iter_mut().step_by(joints);
                places
                    .chain(&mut desc.roots)
                    .for_each(|place| *place = turn * *place);
                let rotations = desc.rotations.iter_mut().step_by(joints);
                rotations.for_each(|own| *own = (turn * *own).normalize());
                clip = Clip::new(&skeleton, desc)?;
            } else if up != Up::Y {
                // The axes of every joint are changed, so that the rest pose is upright too.
                let rotation = |own: Quat| (turn * own * turn.conjugate()).normalize();
                (skeleton, clip) = mapped(&skeleton, clip.desc(), |place| turn * place, rotation)?;
            }
            if let Some(rooted) = Rooted::of(&skeleton).map_err(ClipError::from)? {
                (skeleton, clip) = rooted.clip(&skeleton, &clip)?;
            }
            let (notes, repeated_names) = match self {
                Self::Channels(file) => (&file.notes, &file.repeated_names),
                Self::Gltf(file) => (&file.notes, &file.repeated_names),
            };
            let mut notes = notes.clone();
            notes.extend(repeated_names.iter().map(|name| {
                format!("several joints are called \"{name}\": the later ones are read as \"{name}_2\" and so on")
            }));
            if self.is_in_metres()
                && matches!(scale.found, ScaleSource::Unit(_) | ScaleSource::Stature)
            {
                notes.push(format!("no figure is as large in the format's metres: 1 unit is taken for {metres} m (--scale)"));
            }
            let file = skeleton.file_joints().into_iter();
            let beside = file.flat_map(|file| file.beside().map(str::to_owned));
            let beside: Vec<String> = beside.collect();
            if !beside.is_empty() {
                let beside = shortened(&beside);
                notes.push(format!("joints beside the body do not move: {beside}"));
            }
            Ok(LoadedClip {
                notes,
                skeleton,
                clip,
                scale,
                up,
                events: Vec::new(),
                repeated_names: repeated_names.clone(),
            })
        };
        let motions = match self {
            Self::Channels(file) => {
                let seconds = (file.frames() - 1) as f64 / file.frame_rate;
                loaded(seconds, &|| file.motion(&name, metres)).map(|only| vec![only])
            }
            Self::Gltf(file) => {
                let load = |animation: &GltfAnimation| {
                    let name = match file.animations[..] {
                        [_] => name.clone(),
                        _ => format!("{name}:{}", animation.name),
                    };
                    let motion = || Ok(file.motion(animation, &name, metres)?);
                    let mut loaded = loaded(animation.clip.duration(), &motion)?;
                    loaded.events.clone_from(&animation.events);
                    Ok(loaded)
                };
                file.animations.iter().map(load).collect()
            }
        };
        motions.map_err(ReadError::in_file(path))
    }
}

/// Axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +X.
    X,
    /// +Y, as in sabaki.
    #[default]
    Y,
    /// +Z.
    Z,
    /// -X.
    NegativeX,
    /// -Y.
    NegativeY,
    /// -Z.
    NegativeZ,
}

impl FromStr for Up {
    type Err = &'static str;
    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let is_named = |&(_, name, _): &(Self, &str, Vec3)| {
            name.trim_start_matches('+').eq_ignore_ascii_case(word)
        };
        let found = Self::ALL.into_iter().find(is_named);
        let up = found.map(|(up, ..)| up);
        up.ok_or("up is x, y or z, or -x, -y or -z")
    }
}

impl Up {
    /// All axes, with their names and directions.
    const ALL: [(Self, &str, Vec3); 6] = [
        (Self::X, "+X", Vec3::X),
        (Self::Y, "+Y", Vec3::Y),
        (Self::Z, "+Z", Vec3::Z),
        (Self::NegativeX, "-X", Vec3::NEG_X),
        (Self::NegativeY, "-Y", Vec3::NEG_Y),
        (Self::NegativeZ, "-Z", Vec3::NEG_Z),
    ];

    /// Rotation from the file's axes to +Y up.
    fn turn(self) -> Quat {
        match self {
            Self::NegativeY => Quat::from_rotation_z(std::f32::consts::PI),
            up => Quat::from_rotation_arc(Self::ALL[up as usize].2, Vec3::Y),
        }
    }

    /// The axis that is nearest to a direction.
    pub(crate) fn nearest(direction: Vec3) -> Self {
        let along = |(.., axis): &(Self, &str, Vec3)| direction.dot(*axis);
        let nearest = Self::ALL
            .into_iter()
            .max_by(|a, b| along(a).total_cmp(&along(b)));
        nearest.map_or(Self::Y, |(up, ..)| up)
    }

    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }
}

/// Warnings about clips that are readable but suspicious, one line each.
#[must_use]
pub fn clip_warnings(skeleton: &Skeleton, clips: &[Clip]) -> Vec<String> {
    let of_clips = stance(skeleton, clips)
        .into_iter()
        .chain(clips.iter().map(jump));
    let of_set = std::iter::once(sides(skeleton));
    of_set.chain(of_clips).flatten().collect()
}

/// Warns if the root leaves its way between two frames by more than a body can.
fn jump(clip: &Clip) -> Option<String> {
    /// Least distance from the place that constant velocity leads to, in metres, and acceleration, in metres per second squared.
    const OFF: f32 = 0.3;
    const MOST: f64 = 30.0;
    let most = OFF.max((MOST / clip.frame_rate().powi(2)) as f32);
    let off = |frame: &usize| {
        let [a, b, c] = [frame - 1, *frame, frame + 1].map(|frame| clip.root(frame));
        (a - 2.0 * b + c).length() > most
    };
    let frame = (1..clip.frames().saturating_sub(1)).find(off)?;
    let (metres, at) = (clip.root(frame).distance(clip.root(frame + 1)), frame + 1);
    let seconds = at as f64 / clip.frame_rate();
    Some(format!(
        "{}: the body jumps by {metres:.2} m to frame {at} ({seconds:.2} s): cut or mend the clip there",
        clip.name()
    ))
}

/// Warns if the names of a skeleton with limbs do not tell left from right.
fn sides(skeleton: &Skeleton) -> Option<String> {
    /// Minimum number of limb ends: two feet, a head and a hand.
    const ENDS: usize = 4;
    let ends = skeleton
        .ids()
        .filter(|&id| skeleton.children(id).next().is_none())
        .count();
    let doubtful = ends >= ENDS && !Facing::of(skeleton).is_of_hips();
    doubtful.then(|| {
        "no joint names tell left from right (as LeftLeg, l_leg, leg.L or Bip01 L Leg do): the character is taken to face along its \
         root's Z axis, and its trunk and limbs to be as thick as its neck"
            .to_owned()
    })
}

/// Warns if the hips of the figure are not above its feet along Y, and if it goes on four legs, over all clips.
fn stance(skeleton: &Skeleton, clips: &[Clip]) -> [Option<String>; 2] {
    /// Number of frames of all clips.
    const SAMPLES: usize = 512;
    /// Height of hands over feet, as a share of that of the hips, below which both stand, and share of the frames in which they do.
    const STANDS: (f32, f32) = (0.3, 0.9);
    let limbs = Limbs::of(skeleton);
    let legs = Leg::all(skeleton).len();
    if legs > 2 {
        let note =
            format!("the figure has {legs} legs: limits and evasions are those of a body on two");
        return [None, Some(note)];
    }
    if limbs.hands.is_empty() || limbs.feet.is_empty() {
        return [None, None];
    }
    let hips = body_root(skeleton);
    let (mut up, mut low, mut frames) = (Vec3::ZERO, 0, 0);
    for_some_frames(skeleton, clips, SAMPLES, |_, joints| {
        let place = |id: JointId| joints[id.index()].translation;
        let middle =
            |ids: &[JointId]| ids.iter().map(|&id| place(id)).sum::<Vec3>() / ids.len() as f32;
        let [hips, hands] = [place(hips), middle(&limbs.hands)].map(|p| p - middle(&limbs.feet));
        up += hips;
        low += usize::from(hips.y > 0.0 && hands.y < STANDS.0 * hips.y);
        frames += 1;
    });
    let nearest = Up::nearest(up);
    let is_turned = up.length() > 0.0 && nearest != Up::Y;
    let is_low = low as f32 > STANDS.1 * frames as f32;
    let name = nearest.name();
    let hands = || {
        limbs
            .hands
            .iter()
            .map(|&id| skeleton.joint(id).name.clone())
    };
    [
        is_turned.then(|| format!("the figure seems to stand along {name}, but +Y is taken for up: say which way is up (--up), or turn the files before use")),
        is_low.then(|| format!(
            "the figure goes on four legs: {} are taken for hands, which may slide on the ground, and limits and evasions are those of a body on two",
            shortened(&hands().collect::<Vec<_>>())
        )),
    ]
}
