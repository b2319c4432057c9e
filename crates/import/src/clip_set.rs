use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use crate::error::shortened;
use crate::file::clip_name;
use crate::motion_file::{MotionFile, check_options, is_motion_file};
use crate::retarget::{Obstacle, Retargeted};
use crate::{
    ClipEvents, EventsFile, LengthUnit, LoadedClip, ReadError, ReadOptions, Scale, ScaleSource,
    clip_warnings,
};
use sabaki::anim::{Clip, Event, Skeleton};
use sabaki::math::in_parallel;

/// Clips of one skeleton, with their events.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipSet {
    /// Skeleton of the first clip. The other clips have the same joints.
    pub skeleton: Skeleton,
    /// Clips in the order of the paths. Files of a folder are sorted by name.
    pub clips: Vec<Clip>,
    /// Events, sorted by clip and start.
    pub events: Vec<Event>,
    /// Scale of each clip.
    pub scales: Vec<Scale>,
    /// Names that several joints of the first file have. Such a name identifies no joint.
    pub repeated_names: Vec<String>,
    /// Warnings for the user, one line each, for example about different bone lengths, clips of one
    /// frame, different scales, or doubtful contents of the files.
    pub warnings: Vec<String>,
    /// Files that were left out, with the reason, in the order of the files. Empty unless [`ReadOptions::keep_going`] is set.
    pub left_out: Vec<String>,
}

/// Reads clips and their events, on all CPU cores. A path is a BVH, AMC or glTF file, or a folder
/// with `*.bvh`, `*.amc`, `*.glb` and `*.gltf` files. All animations of a glTF file are read.
///
/// The events of a clip come from the events file. If that does not name the clip, they come from
/// the clip's own file, which can contain events if it is a glTF file. Of a file that is retargeted, the joints of its events have the
/// names of its own skeleton.
///
/// All files must have the same joints as the first. With [`ReadOptions::keep_going`] the largest group of files with the same joints is
/// read, and the others are left out, as are files with errors. With [`ReadOptions::retarget`] the others are put on that group's skeleton,
/// as far as the joints' names agree. Bone lengths may differ, because captures of
/// one person differ by calibration; differences of more than 1% are a warning. The offsets of the
/// first file are used for all clips.
///
/// # Errors
/// The error of a file, with the position in it; [`ReadError::Files`] if several files have errors. With [`ReadOptions::keep_going`]
/// only sets without a usable file, clips of one name and errors of the events file are errors.
pub fn read_clips(
    paths: &[PathBuf],
    events: Option<&Path>,
    options: &ReadOptions,
) -> Result<ClipSet, ReadError> {
    check_options(options)?;
    let (files, passed_over) = expanded(paths)?;
    check_names(&files)?;
    let (loaded, mut failed) = load_all(&files, options);
    let used = match options.keep_going || options.retarget {
        true => largest_group(&loaded),
        false => loaded.first().map(|first| &first.motion.skeleton),
    };
    let used = used.cloned();
    let is_used = |one: &Loaded<'_>| {
        used.as_ref()
            .is_some_and(|used| used.differences(&one.motion.skeleton).is_empty())
    };
    let first_path = loaded
        .iter()
        .find(|one| is_used(one))
        .map(|first| first.path);
    let loaded = match (&used, first_path) {
        (Some(used), Some(first)) if options.retarget => {
            let (kept, others) = retarget_others(loaded, used, first);
            failed.extend(others);
            kept
        }
        (Some(used), Some(first)) => {
            let (loaded, others): (Vec<_>, Vec<_>) = loaded.into_iter().partition(is_used);
            failed.extend(others.iter().map(|other| other.differs(used, first)));
            loaded
        }
        _ => loaded,
    };
    let labels = events.map_or_else(|| Ok(EventsFile::default()), EventsFile::read);
    let (loaded, others) = resolve_own(loaded, labels.as_ref().ok());
    failed.extend(others);
    failed.sort_by_key(|failed| failed.file);
    failed.dedup_by_key(|failed| failed.file);
    let names: Vec<String> = failed
        .iter()
        .map(|failed| clip_name(&files[failed.file]))
        .collect();
    let mut errors: Vec<ReadError> = failed.into_iter().map(|failed| failed.error).collect();
    let goes_on = options.keep_going && !loaded.is_empty();
    if !goes_on && !errors.is_empty() {
        return Err(match errors.len() {
            1 => errors.remove(0),
            _ => ReadError::Files {
                files: files.len(),
                errors,
            },
        });
    }
    let mut labels = labels?;
    let mut loaded = loaded.into_iter().peekable();
    let Some(Loaded {
        path: first_path,
        motion: first,
        ..
    }) = loaded.peek()
    else {
        return Err(ReadError::NoPaths);
    };
    let mut set = ClipSet {
        skeleton: first.skeleton.clone(),
        clips: Vec::new(),
        events: Vec::new(),
        scales: Vec::new(),
        repeated_names: first.repeated_names.clone(),
        warnings: Vec::new(),
        left_out: errors.iter().map(ToString::to_string).collect(),
    };
    if let Some(first) = passed_over.first() {
        set.warnings.push(format!(
            "files of macOS beside others are passed over: {}, the first is {}",
            passed_over.len(),
            first.display()
        ));
    }
    let first_path = *first_path;
    for one in loaded {
        set.warn_of_bones(one.path, &one.motion.skeleton);
        set.note(&one.motion.clip, one.motion.notes);
        let clip = set.clips.len();
        set.events
            .extend(one.events.into_iter().map(|event| Event { clip, ..event }));
        set.add(one.motion.clip, one.motion.scale);
    }
    labels.forget(&names, &set.clips);
    let resolved = labels
        .check_names(&set.repeated_names)
        .and_then(|()| labels.resolve(&set.clips, &set.skeleton));
    set.events
        .extend(resolved.map_err(ReadError::in_file(events.unwrap_or(first_path)))?);
    set.events
        .sort_by(|a, b| a.clip.cmp(&b.clip).then(a.start.total_cmp(&b.start)));
    set.warnings
        .extend(clip_warnings(&set.skeleton, &set.clips));
    Ok(set)
}

impl ClipSet {
    fn note(&mut self, clip: &Clip, notes: Vec<String>) {
        let named = notes.iter().map(|note| format!("{}: {note}", clip.name()));
        self.warnings.extend(named);
    }

    fn add(&mut self, clip: Clip, scale: Scale) {
        if clip.frames() == 1 {
            self.warnings
                .push(format!("{}: a single frame is no motion", clip.name()));
        }
        // Formats that name their unit need not have that of the other files.
        let is_found = |scale: &Scale| scale.found != ScaleSource::Format;
        if let Some(first) = self.scales.iter().position(is_found)
            && is_found(&scale)
            && self.scales[first].metres_per_unit != scale.metres_per_unit
        {
            self.warnings.push(format!(
                "{}: read at {} metres per unit, {} at {}",
                clip.name(),
                scale.metres_per_unit,
                self.clips[first].name(),
                self.scales[first].metres_per_unit
            ));
        }
        self.clips.push(clip);
        self.scales.push(scale);
    }

    fn warn_of_bones(&mut self, path: &Path, other: &Skeleton) {
        /// Maximum difference that comes from numbers with few digits, in metres.
        const DIGITS: f32 = 1e-4;
        let differing = differing_bones(&self.skeleton, other, DIGITS);
        if !differing.is_empty() {
            self.warnings.push(format!(
                "{}: bones differ by more than 1% from the first clip's: {}",
                path.display(),
                shortened(&differing)
            ));
        }
    }
}

/// Expands folders to the motion files in them, in the order of their names. Other paths are kept as they are. Of folders, files whose names
/// begin with `._` are passed over: archives of macOS hold one for each file.
///
/// # Errors
/// The first folder that cannot be read or that has no motion file.
pub fn motion_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, ReadError> {
    expanded(paths).map(|(files, _)| files)
}

/// The motion files, and those that are passed over.
fn expanded(paths: &[PathBuf]) -> Result<(Vec<PathBuf>, Vec<PathBuf>), ReadError> {
    let (mut files, mut passed_over) = (Vec::new(), Vec::new());
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let io = |source| ReadError::Io {
            path: path.clone(),
            source,
        };
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(io)? {
            let file = entry.map_err(io)?.path();
            if is_motion_file(&file) && file.is_file() {
                match clip_name(&file).starts_with("._") {
                    true => passed_over.push(file),
                    false => inside.push(file),
                }
            }
        }
        if inside.is_empty() {
            return Err(ReadError::NoClips { path: path.clone() });
        }
        inside.sort();
        files.append(&mut inside);
    }
    Ok((files, passed_over))
}

fn check_names(files: &[PathBuf]) -> Result<(), ReadError> {
    let mut seen = HashMap::new();
    for path in files {
        if let Some(first) = seen.insert(clip_name(path), path) {
            return Err(ReadError::DuplicateClip {
                path: path.clone(),
                first: first.clone(),
            });
        }
    }
    Ok(())
}

/// A motion of a file.
struct Loaded<'a> {
    path: &'a PathBuf,
    /// Index of the file.
    file: usize,
    motion: LoadedClip,
    /// Events of the file itself that are used. Their clip is not set.
    events: Vec<Event>,
}

/// A file that cannot be used.
struct Failed {
    /// Index of the file.
    file: usize,
    error: ReadError,
}

impl Loaded<'_> {
    fn differs(&self, used: &Skeleton, first: &Path) -> Failed {
        let error = ReadError::SkeletonDiffers {
            path: self.path.clone(),
            first: first.to_owned(),
            joints: used.differences(&self.motion.skeleton),
        };
        Failed {
            file: self.file,
            error,
        }
    }
}

/// Puts the motions of other skeletons on the used one, which is that of the file `first`. Those whose names do not agree have failed.
fn retarget_others<'a>(
    loaded: Vec<Loaded<'a>>,
    used: &Skeleton,
    first: &Path,
) -> (Vec<Loaded<'a>>, Vec<Failed>) {
    let retargeted = in_parallel(0, loaded.len(), |index| {
        let motion = &loaded[index].motion;
        let is_other = !used.differences(&motion.skeleton).is_empty();
        is_other.then(|| motion.retargeted(used))
    });
    let (mut kept, mut failed) = (Vec::new(), Vec::new());
    for (mut one, retargeted) in loaded.into_iter().zip(retargeted) {
        let error = match retargeted {
            None => {
                kept.push(one);
                continue;
            }
            Some(Ok(Retargeted { clip, note, events })) => {
                one.motion.skeleton = used.clone();
                one.motion.clip = clip;
                one.motion.events = events;
                one.motion.notes.push(note);
                kept.push(one);
                continue;
            }
            Some(Err(Obstacle::Missing(missing))) => ReadError::NotRetargeted {
                path: one.path.clone(),
                first: first.to_owned(),
                missing,
            },
            Some(Err(Obstacle::Clip(error))) => ReadError::Retargeted {
                path: one.path.clone(),
                error,
            },
        };
        failed.push(Failed {
            file: one.file,
            error,
        });
    }
    (kept, failed)
}

/// Resolves the events in the files themselves, of the clips that the events file does not name. Files with invalid events have failed, with
/// all their motions.
fn resolve_own<'a>(
    mut loaded: Vec<Loaded<'a>>,
    labels: Option<&EventsFile>,
) -> (Vec<Loaded<'a>>, Vec<Failed>) {
    let mut failed = Vec::new();
    for one in &mut loaded {
        let file = one.motion.clip.name().to_owned();
        let events = std::mem::take(&mut one.motion.events);
        if events.is_empty() || labels.is_some_and(|labels| labels.names(&file)) {
            continue;
        }
        let own = EventsFile {
            clips: vec![ClipEvents { file, events }],
        };
        let clip = std::slice::from_ref(&one.motion.clip);
        let resolved = own
            .check_names(&one.motion.repeated_names)
            .and_then(|()| own.resolve(clip, &one.motion.skeleton));
        match resolved {
            Ok(events) => one.events = events,
            Err(error) => failed.push(Failed {
                file: one.file,
                error: ReadError::in_file(one.path)(error),
            }),
        }
    }
    let files: HashSet<usize> = failed.iter().map(|failed| failed.file).collect();
    loaded.retain(|one| !files.contains(&one.file));
    (loaded, failed)
}

/// The skeleton that most files have; of equally frequent ones the first.
fn largest_group<'a>(loaded: &'a [Loaded<'_>]) -> Option<&'a Skeleton> {
    let mut groups: Vec<(&Skeleton, HashSet<usize>)> = Vec::new();
    for one in loaded {
        let skeleton = &one.motion.skeleton;
        let mut known = groups.iter_mut();
        match known.find(|(of_group, _)| of_group.differences(skeleton).is_empty()) {
            Some((_, files)) => _ = files.insert(one.file),
            None => groups.push((skeleton, HashSet::from([one.file]))),
        }
    }
    // `max_by_key` returns the last maximum.
    let largest = groups
        .into_iter()
        .rev()
        .max_by_key(|(_, files)| files.len());
    largest.map(|(skeleton, _)| skeleton)
}

/// Loads all motions. Returns them and the files with errors, both in the order of the files.
fn load_all<'a>(files: &'a [PathBuf], options: &ReadOptions) -> (Vec<Loaded<'a>>, Vec<Failed>) {
    let mut failed = Vec::new();
    let mut parsed = Vec::new();
    let parse = |file: usize| MotionFile::read(&files[file]);
    for (file, result) in in_parallel(0, files.len(), parse).into_iter().enumerate() {
        match result {
            Ok(motion_file) => {
                let scale = motion_file.scale(options);
                parsed.push((file, (motion_file, scale)));
            }
            Err(error) => failed.push(Failed { file, error }),
        }
    }
    let (places, parsed): (Vec<usize>, Vec<_>) = parsed.into_iter().unzip();
    let scales = scales_of_set(&parsed);
    let to_metres = |index: usize| {
        let path = &files[places[index]];
        parsed[index].0.to_metres(path, scales[index], options)
    };
    let mut loaded = Vec::new();
    let motions = in_parallel(0, parsed.len(), to_metres);
    for (&file, motions) in places.iter().zip(motions) {
        let path = &files[file];
        match motions {
            Ok(motions) => {
                loaded.extend(motions.into_iter().map(|motion| Loaded {
                    path,
                    file,
                    motion,
                    events: Vec::new(),
                }));
            }
            Err(error) => failed.push(Failed { file, error }),
        }
    }
    (loaded, failed)
}

/// Determines the scale of each file from the scales of all files.
///
/// A scale is estimated from a file's first pose, which can be misleading. Files whose bones have
/// the same lengths as the first file's, in the units of each, therefore share one scale. Scales
/// that only normalise the figure's height depend entirely on the first pose, so a set has at most
/// one of them.
fn scales_of_set(parsed: &[(MotionFile, Scale)]) -> Vec<Scale> {
    let first = parsed.first().and_then(|(file, _)| file.skeleton());
    let like_first = |file: &MotionFile| {
        let own = file.skeleton();
        first.as_ref().zip(own).is_some_and(|(first, own)| {
            first.len() == own.len() && differing_bones(first, &own, 0.0).is_empty()
        })
    };
    let alike: Vec<bool> = parsed.iter().map(|(file, _)| like_first(file)).collect();
    let scales = || parsed.iter().map(|&(_, scale)| scale);
    let of_alike = most_found_unit(
        scales()
            .zip(&alike)
            .filter_map(|(scale, alike)| alike.then_some(scale)),
    );
    let fitted = scales().find(|scale| scale.found == ScaleSource::Stature);
    scales()
        .zip(&alike)
        .map(|(scale, &alike)| match (scale.found, of_alike, fitted) {
            (ScaleSource::Given | ScaleSource::Format, ..) => scale,
            (_, Some(shared), _) if alike => shared,
            (ScaleSource::Stature, _, Some(fitted)) => fitted,
            _ => scale,
        })
        .collect()
}

/// The most frequent unit. Ties are decided for the smaller unit, because a first pose can reduce
/// the height but not increase it.
fn most_found_unit(scales: impl Iterator<Item = Scale>) -> Option<Scale> {
    let found: Vec<LengthUnit> = scales
        .filter_map(|scale| match scale.found {
            ScaleSource::Unit(unit) => Some(unit),
            _ => None,
        })
        .collect();
    let count = |unit: &LengthUnit| found.iter().filter(|other| *other == unit).count();
    // From the largest unit to the smallest; the last of equal counts wins.
    let unit = LengthUnit::ALL.into_iter().max_by_key(count)?;
    (count(&unit) > 0).then(|| Scale {
        metres_per_unit: unit.metres(),
        found: ScaleSource::Unit(unit),
    })
}

/// Names of the joints whose offsets differ by more than 1% and by more than `digits`. The root is
/// ignored, because the motion determines its position.
fn differing_bones(a: &Skeleton, b: &Skeleton, digits: f32) -> Vec<String> {
    const TOLERANCE: f32 = 0.01;
    let longest = a.joints().iter().skip(1).map(|joint| joint.offset.length());
    let digits = digits.max(1e-4 * longest.fold(0.0, f32::max));
    let pairs = a.joints().iter().zip(b.joints()).skip(1);
    pairs
        .filter(|(a, b)| {
            let most = TOLERANCE * a.offset.length().max(b.offset.length()) + digits;
            a.offset.distance(b.offset) > most
        })
        .map(|(a, _)| a.name.clone())
        .collect()
}
