use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{FileError, shortened};
use crate::figure::{describe, settle_bones, settle_places, settle_sides};
use crate::file::clip_name;
use crate::motion_file::{MotionFile, check_options, doubtful_stature, is_motion_file, turned};
use crate::units::Stance;
use crate::{
    ClipEvents, EventsFile, LoadedClip, ReadError, ReadOptions, STATURE_FACTOR, Scale, ScaleSource,
    Up, clip_warnings,
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
    /// What was taken for root, hands and feet, in one line.
    pub figure: String,
    /// Warnings for the user, one line each, for example about different bone lengths, clips of one
    /// frame, different scales, or doubtful contents of the files.
    pub warnings: Vec<String>,
    /// Files that were left out, with the reason, in the order of the files. Empty unless [`ReadOptions::keep_going`] is set.
    pub left_out: Vec<String>,
}

/// Reads clips and their events, on all CPU cores. A path is a BVH, AMC, glTF or, with the feature `fbx`, FBX file, or a folder of such
/// files. All animations of a glTF or FBX file are read.
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
    let mut seen = HashMap::new();
    for path in &files {
        if let Some(first) = seen.insert(clip_name(path), path) {
            let error = FileError::DuplicateClip(first.clone());
            return Err(ReadError::in_file(path)(error));
        }
    }
    let (loaded, mut failed) = load_all(&files, options);
    let used = match options.keep_going || options.retarget {
        true => largest_group(&loaded),
        false => loaded.first().map(|first| &first.motion.skeleton),
    };
    let (loaded, others) = match used.cloned() {
        Some(used) => on_skeleton(loaded, &used, &files, options.retarget),
        None => (loaded, Vec::new()),
    };
    failed.extend(others);
    let labels = events.map_or_else(|| Ok(EventsFile::default()), EventsFile::read);
    let (loaded, others) = resolve_own(loaded, &files, labels.as_ref().ok());
    failed.extend(others);
    failed.sort_by_key(|&(file, _)| file);
    failed.dedup_by_key(|&mut (file, _)| file);
    let names = failed.iter().map(|&(file, _)| clip_name(&files[file]));
    let names: Vec<String> = names.collect();
    let mut errors: Vec<ReadError> = failed.into_iter().map(|(_, error)| error).collect();
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
    let Some(Loaded { file, motion, .. }) = loaded.first() else {
        return Err(ReadError::NoPaths);
    };
    let (first_path, up) = (&files[*file], motion.up);
    let mut set = ClipSet {
        skeleton: motion.skeleton.clone(),
        clips: Vec::new(),
        events: Vec::new(),
        scales: Vec::new(),
        repeated_names: motion.repeated_names.clone(),
        figure: String::new(),
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
    set.warnings.extend(turned(up, options));
    for one in loaded {
        // The file that shows best how a joint above the body carries the path.
        let shows = |skeleton: &Skeleton| {
            let carrier = skeleton.file_joints()?.carrier?;
            Some(u8::from(carrier.turns) + u8::from(carrier.rises))
        };
        if shows(&one.motion.skeleton) > shows(&set.skeleton)
            && let Some(file) = one.motion.skeleton.file_joints().cloned()
            && let Some(skeleton) = set.skeleton.clone().with_file(file)
        {
            set.skeleton = skeleton;
        }
        set.warn_of_bones(&files[one.file], &one.motion.skeleton);
        set.note(one.motion.clip.name(), one.motion.notes);
        let clip = set.clips.len();
        set.events
            .extend(one.events.into_iter().map(|event| Event { clip, ..event }));
        set.add(one.motion.clip, one.motion.scale);
    }
    settle_bones(&mut set.skeleton, &mut set.clips).map_err(ReadError::in_file(first_path))?;
    let (sides, note) = settle_sides(&mut set.skeleton, &set.clips);
    set.warnings.extend(note);
    set.figure = describe(&set.skeleton, sides);
    let stood =
        settle_places(&set.skeleton, &mut set.clips).map_err(ReadError::in_file(first_path))?;
    set.warnings.extend(stood);
    for index in 0..set.clips.len() {
        let name = set.clips[index].name().to_owned();
        set.note(&name, doubtful_stature(&set.skeleton, &set.clips[index]));
    }
    labels.forget(&names, &set.clips);
    let resolved = labels
        .check_names(&set.repeated_names)
        .and_then(|()| labels.resolve(&set.clips, &set.skeleton));
    set.events
        .extend(resolved.map_err(ReadError::in_file(events.unwrap_or(first_path)))?);
    set.events
        .sort_by(|a, b| a.clip.cmp(&b.clip).then(a.start.total_cmp(&b.start)));
    set.leave_out_rest()
        .map_err(ReadError::in_file(first_path))?;
    set.warnings
        .extend(clip_warnings(&set.skeleton, &set.clips));
    set.warnings = merged(set.warnings);
    Ok(set)
}

/// Warnings that say the same of several files, as one.
fn merged(warnings: Vec<String>) -> Vec<String> {
    let mut all: Vec<(String, Option<String>, usize)> = Vec::new();
    for warning in warnings {
        let own = warning.find(": ").map(|at| warning[at..].to_owned());
        let mut known = all.iter_mut();
        match known.find(|(_, said, _)| own.is_some() && *said == own) {
            Some((.., more)) => *more += 1,
            None => all.push((warning, own, 0)),
        }
    }
    let line = |(line, _, more): (String, _, usize)| match more {
        0 => line,
        _ => line.replacen(": ", &format!(" and {more} more: "), 1),
    };
    all.into_iter().map(line).collect()
}

impl ClipSet {
    fn note(&mut self, clip: &str, notes: impl IntoIterator<Item = String>) {
        let named = notes.into_iter().map(|note| format!("{clip}: {note}"));
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
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(ReadError::in_file(path))? {
            let file = entry.map_err(ReadError::in_file(path))?.path();
            if is_motion_file(&file) && file.is_file() {
                match clip_name(&file).starts_with("._") {
                    true => passed_over.push(file),
                    false => inside.push(file),
                }
            }
        }
        if inside.is_empty() {
            return Err(ReadError::in_file(path)(FileError::NoClips));
        }
        inside.sort();
        files.append(&mut inside);
    }
    Ok((files, passed_over))
}

/// A motion of a file.
struct Loaded {
    file: usize,
    motion: LoadedClip,
    /// Events of the file itself that are used. Their clip is not set.
    events: Vec<Event>,
}

/// Index of a file that cannot be used, and the reason.
type Failed = (usize, ReadError);

/// The motions of the used skeleton. Those of other skeletons are put on it, or have failed.
fn on_skeleton(
    loaded: Vec<Loaded>,
    used: &Skeleton,
    files: &[PathBuf],
    retarget: bool,
) -> (Vec<Loaded>, Vec<Failed>) {
    let differences = |one: &Loaded| used.differences(&one.motion.skeleton);
    let first = loaded.iter().find(|one| differences(one).is_empty());
    let first = first.map_or_else(PathBuf::new, |first| files[first.file].clone());
    let put = in_parallel(0, loaded.len(), |index| {
        let joints = differences(&loaded[index]);
        if joints.is_empty() {
            return Ok(None);
        }
        let first = first.clone();
        if !retarget {
            return Err(FileError::SkeletonDiffers { first, joints });
        }
        let mut motion = loaded[index].motion.clone();
        let clip = std::slice::from_mut(&mut motion.clip);
        settle_bones(&mut motion.skeleton, clip).map_err(FileError::Retargeted)?;
        motion.retargeted(used, first).map(Some)
    });
    let (mut kept, mut failed) = (Vec::new(), Vec::new());
    for (one, put) in loaded.into_iter().zip(put) {
        match put {
            Ok(None) => kept.push(one),
            Ok(Some(motion)) => kept.push(Loaded { motion, ..one }),
            Err(error) => failed.push((one.file, ReadError::in_file(&files[one.file])(error))),
        }
    }
    (kept, failed)
}

/// Resolves the events in the files themselves, of the clips that the events file does not name. Files with invalid events have failed, with
/// all their motions.
fn resolve_own(
    mut loaded: Vec<Loaded>,
    files: &[PathBuf],
    labels: Option<&EventsFile>,
) -> (Vec<Loaded>, Vec<Failed>) {
    let mut failed: Vec<Failed> = Vec::new();
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
        match resolved.map_err(ReadError::in_file(&files[one.file])) {
            Ok(events) => one.events = events,
            Err(error) => failed.push((one.file, error)),
        }
    }
    loaded.retain(|one| !failed.iter().any(|&(file, _)| file == one.file));
    (loaded, failed)
}

/// Groups values by their skeletons, in the order of the first of each group.
fn by_skeleton<'a>(
    values: impl Iterator<Item = (usize, &'a Skeleton)>,
) -> Vec<(&'a Skeleton, Vec<usize>)> {
    let mut groups: Vec<(&Skeleton, Vec<usize>)> = Vec::new();
    for (value, skeleton) in values {
        let mut known = groups.iter_mut();
        match known.find(|(of_group, _)| of_group.differences(skeleton).is_empty()) {
            Some((_, own)) => own.push(value),
            None => groups.push((skeleton, vec![value])),
        }
    }
    groups
}

/// The skeleton that most files have; of equally frequent ones the first.
fn largest_group(loaded: &[Loaded]) -> Option<&Skeleton> {
    let groups = by_skeleton(loaded.iter().map(|one| (one.file, &one.motion.skeleton)));
    let files = |files: &[usize]| files.chunk_by(|a, b| a == b).count();
    // `max_by_key` returns the last maximum.
    let largest = groups.into_iter().rev();
    let largest = largest.max_by_key(|(_, own)| files(own));
    largest.map(|(skeleton, _)| skeleton)
}

/// Loads all motions. Returns them and the files with errors, both in the order of the files.
fn load_all(files: &[PathBuf], options: &ReadOptions) -> (Vec<Loaded>, Vec<Failed>) {
    let mut failed = Vec::new();
    let mut parsed = Vec::new();
    let parse = |file: usize| {
        let read = MotionFile::read(&files[file])?;
        let stance = read.stance();
        Ok((read, stance))
    };
    for (file, result) in in_parallel(0, files.len(), parse).into_iter().enumerate() {
        match result {
            Ok((read, stance)) => parsed.push(Parsed { file, read, stance }),
            Err(error) => failed.push((file, error)),
        }
    }
    let spaces = spaces_of_set(&parsed, files, options);
    let to_metres = |index: usize| {
        let Parsed { file, read, .. } = &parsed[index];
        let (scale, up) = match &spaces[index] {
            Ok(space) => *space,
            Err(_) => return Ok(Vec::new()),
        };
        read.to_metres(&files[*file], scale, up, options)
    };
    let mut loaded = Vec::new();
    let motions = in_parallel(0, parsed.len(), to_metres);
    for ((Parsed { file, .. }, motions), space) in parsed.iter().zip(motions).zip(spaces) {
        let file = *file;
        match space.and(motions) {
            Ok(motions) => loaded.extend(motions.into_iter().map(|motion| Loaded {
                file,
                motion,
                events: Vec::new(),
            })),
            Err(error) => failed.push((file, error)),
        }
    }
    (loaded, failed)
}

/// A file that was parsed.
struct Parsed {
    file: usize,
    read: MotionFile,
    stance: Stance,
}

/// Determines unit and up axis of each file: the files of one skeleton share them, because a single file may show a figure that crouches or
/// lies. A file whose unit or axis contradicts the others of its skeleton is an error.
fn spaces_of_set(
    parsed: &[Parsed],
    files: &[PathBuf],
    options: &ReadOptions,
) -> Vec<Result<(Scale, Up), ReadError>> {
    let all = parsed.iter().enumerate();
    let groups = by_skeleton(all.filter_map(|(at, one)| Some((at, one.stance.skeleton.as_ref()?))));
    let alone = |one: &Parsed| {
        let (read, stance) = (&one.read, &one.stance);
        Ok((read.scale(stance, options), read.up(stance, options)))
    };
    let mut spaces: Vec<_> = parsed.iter().map(alone).collect();
    for (_, group) in groups {
        let in_metres = |&index: &usize| parsed[index].read.is_in_metres();
        let (in_metres, own): (Vec<usize>, Vec<usize>) = group.into_iter().partition(in_metres);
        if let Some((common, _)) = common_stance(parsed, &in_metres) {
            for index in in_metres {
                let Parsed { read, stance, .. } = &parsed[index];
                spaces[index] = Ok((read.scale(stance, options), read.up(&common, options)));
            }
        }
        let Some((common, first)) = common_stance(parsed, &own) else {
            continue;
        };
        for index in own {
            let Parsed { file, read, stance } = &parsed[index];
            let (scale, up) = (read.scale(&common, options), read.up(&common, options));
            let times = stance.reach / common.reach;
            let (own, bones) = (stance.axis(), (&stance.skeleton, &common.skeleton));
            let is_turned = || match bones {
                (Some(own), Some(common)) => !differing_bones(own, common, 0.0).is_empty(),
                _ => false,
            };
            let is_as_large = |times: f64| times.ln().abs() <= STATURE_FACTOR.ln();
            let first = files[parsed[first].file].clone();
            let space = match own {
                _ if times > 0.0 && options.scale.is_none() && !is_as_large(times) => {
                    Err(FileError::UnitDiffers { first, times })
                }
                Some(own) if options.up.is_none() && own != up && is_turned() => {
                    let (own, up) = (own.name(), up.name());
                    Err(FileError::UpDiffers { first, own, up })
                }
                _ => Ok((scale, up)),
            };
            spaces[index] = space.map_err(ReadError::in_file(&files[*file]));
        }
    }
    spaces
}

/// How the figure of several files of one skeleton stands, by the medians of the files, and the index of the file whose figure has the median
/// size.
fn common_stance(parsed: &[Parsed], files: &[usize]) -> Option<(Stance, usize)> {
    let stance = |&index: &usize| &parsed[index].stance;
    let mut statures: Vec<f64> = files.iter().map(|index| stance(index).stature).collect();
    statures.sort_by(f64::total_cmp);
    let mut by_size = files.to_vec();
    by_size.sort_by(|a, b| stance(a).reach.total_cmp(&stance(b).reach));
    let first = *by_size.get(by_size.len() / 2)?;
    let common = Stance {
        stature: statures[statures.len() / 2],
        up: files.iter().map(|index| stance(index).up).sum(),
        poses: files.iter().map(|index| stance(index).poses).sum(),
        ..parsed[first].stance.clone()
    };
    Some((common, first))
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
