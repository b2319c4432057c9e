use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{FileError, shortened};
use crate::figure::{describe, settle_bones, settle_places, settle_sides};
use crate::file::clip_name;
use crate::motion_file::{MotionFile, check_options, doubtful_stature, is_motion_file, turned};
use crate::retarget::not_retargeted;
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
            let problem = "a second clip of that name; the first is";
            let error = FileError::Invalid(format!("{problem} {}", first.display()));
            return Err(ReadError::in_file(path)(error));
        }
    }
    let mut loaded = load_all(&files, options);
    let used = match options.keep_going || options.retarget {
        true => largest_group(&loaded),
        false => motions(&loaded).next().map(|(_, motion)| &motion.skeleton),
    };
    if let Some(used) = used.cloned() {
        put_on_skeleton(&mut loaded, &used, &files, options.retarget);
    }
    let labels = events.map_or_else(|| Ok(EventsFile::default()), EventsFile::read);
    resolve_own(&mut loaded, &files, labels.as_ref().ok());
    // A file that failed has one error, however many motions it has.
    let (mut used, mut names, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for (file, one) in loaded {
        match one {
            Ok(motion) => used.push((file, motion)),
            Err(error) => {
                let name = clip_name(&files[file]);
                if names.last() != Some(&name) {
                    names.push(name);
                    errors.push(error);
                }
            }
        }
    }
    let goes_on = options.keep_going && !used.is_empty();
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
    let Some((file, (motion, _))) = used.first() else {
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
    for (file, (motion, events)) in used {
        // The file that shows best how a joint above the body carries the path.
        let shows = |skeleton: &Skeleton| {
            let carrier = skeleton.file_joints()?.carrier?;
            Some(u8::from(carrier.turns) + u8::from(carrier.rises))
        };
        if shows(&motion.skeleton) > shows(&set.skeleton)
            && let Some(file) = motion.skeleton.file_joints().cloned()
            && let Some(skeleton) = set.skeleton.clone().with_file(file)
        {
            set.skeleton = skeleton;
        }
        set.warn_of_bones(&files[file], &motion.skeleton);
        set.note(motion.clip.name(), motion.notes);
        let clip = set.clips.len();
        set.events
            .extend(events.into_iter().map(|event| Event { clip, ..event }));
        set.add(motion.clip, motion.scale);
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
            let error = FileError::invalid("no motion file (BVH, AMC, glTF, FBX) there");
            return Err(ReadError::in_file(path)(error));
        }
        inside.sort();
        files.append(&mut inside);
    }
    Ok((files, passed_over))
}

/// A motion by the index of its file, with the events of the file itself that are used, whose clip is not set; or the reason why the file, or
/// this motion of it, cannot be used. Those of a file follow each other.
pub(crate) type Loaded = (usize, Result<(LoadedClip, Vec<Event>), ReadError>);

/// The motions that can be used, with the index of their files.
fn motions(loaded: &[Loaded]) -> impl Iterator<Item = (usize, &LoadedClip)> {
    let all = loaded.iter();
    all.filter_map(|(file, one)| Some((*file, &one.as_ref().ok()?.0)))
}

/// Puts motions of other skeletons on the used one, or refuses them.
fn put_on_skeleton(loaded: &mut [Loaded], used: &Skeleton, files: &[PathBuf], retarget: bool) {
    let is_used = |(_, own): &(usize, &LoadedClip)| used.differences(&own.skeleton).is_empty();
    let first = motions(loaded).find(is_used);
    let first = first.map_or_else(PathBuf::new, |(file, _)| files[file].clone());
    let put = in_parallel(0, loaded.len(), |index| {
        let (motion, _) = loaded[index].1.as_ref().ok()?;
        let joints = used.differences(&motion.skeleton);
        if joints.is_empty() {
            return None;
        }
        let first = first.clone();
        if !retarget {
            return Some(Err(FileError::SkeletonDiffers { first, joints }));
        }
        let mut motion = motion.clone();
        let clip = std::slice::from_mut(&mut motion.clip);
        let settled = settle_bones(&mut motion.skeleton, clip).map_err(not_retargeted);
        Some(settled.and_then(|()| motion.retargeted(used, first)))
    });
    for ((file, one), put) in loaded.iter_mut().zip(put) {
        if let Some(put) = put {
            let put = put.map(|motion| (motion, Vec::new()));
            *one = put.map_err(ReadError::in_file(&files[*file]));
        }
    }
}

/// Resolves the events in the files themselves, of the clips that the events file does not name. Files with invalid events have failed, with
/// all their motions.
fn resolve_own(loaded: &mut Vec<Loaded>, files: &[PathBuf], labels: Option<&EventsFile>) {
    let mut failed = Vec::new();
    for (index, one) in loaded.iter_mut() {
        let Ok((motion, own)) = one else { continue };
        let file = motion.clip.name().to_owned();
        let events = std::mem::take(&mut motion.events);
        if events.is_empty() || labels.is_some_and(|labels| labels.names(&file)) {
            continue;
        }
        let clips = vec![ClipEvents { file, events }];
        let entries = EventsFile { clips };
        let clip = std::slice::from_ref(&motion.clip);
        let resolved = entries
            .check_names(&motion.repeated_names)
            .and_then(|()| entries.resolve(clip, &motion.skeleton));
        match resolved.map_err(ReadError::in_file(&files[*index])) {
            Ok(events) => *own = events,
            Err(error) => {
                failed.push(*index);
                *one = Err(error);
            }
        }
    }
    loaded.retain(|(file, one)| one.is_err() || !failed.contains(file));
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
    let groups = by_skeleton(motions(loaded).map(|(file, motion)| (file, &motion.skeleton)));
    let files = |files: &[usize]| files.chunk_by(|a, b| a == b).count();
    // `max_by_key` returns the last maximum.
    let largest = groups.into_iter().rev();
    let largest = largest.max_by_key(|(_, own)| files(own));
    largest.map(|(skeleton, _)| skeleton)
}

/// Loads all motions, in the order of the files.
pub(crate) fn load_all(files: &[PathBuf], options: &ReadOptions) -> Vec<Loaded> {
    let (mut loaded, mut parsed): (Vec<Loaded>, _) = (Vec::new(), Vec::new());
    let parse = |file: usize| {
        let read = MotionFile::read(&files[file], options)?;
        let stance = read.stance();
        Ok(Parsed { file, read, stance })
    };
    for (file, result) in in_parallel(0, files.len(), parse).into_iter().enumerate() {
        match result {
            Ok(one) => parsed.push(one),
            Err(error) => loaded.push((file, Err(error))),
        }
    }
    let spaces = spaces_of_set(&parsed, files, options);
    let motions = in_parallel(0, parsed.len(), |index| {
        let Parsed { file, read, .. } = &parsed[index];
        let (scale, up) = *spaces[index].as_ref().ok()?;
        Some(read.to_metres(&files[*file], scale, up))
    });
    for ((Parsed { file, .. }, motions), space) in parsed.iter().zip(motions).zip(spaces) {
        match space.and_then(|_| motions.unwrap_or_else(|| Ok(Vec::new()))) {
            Ok(motions) => {
                let motions = motions.into_iter();
                loaded.extend(motions.map(|motion| (*file, Ok((motion, Vec::new())))));
            }
            Err(error) => loaded.push((*file, Err(error))),
        }
    }
    loaded.sort_by_key(|&(file, _)| file);
    loaded
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
    let alone = |one: &Parsed| Ok((one.read.scale(&one.stance, options), one.stance.up(options)));
    let mut spaces: Vec<_> = parsed.iter().map(alone).collect();
    for (_, group) in groups {
        let in_metres = |&index: &usize| parsed[index].read.is_in_metres();
        let (in_metres, own): (Vec<usize>, Vec<usize>) = group.into_iter().partition(in_metres);
        if let Some((common, _)) = common_stance(parsed, &in_metres) {
            for index in in_metres {
                let Parsed { read, stance, .. } = &parsed[index];
                spaces[index] = Ok((read.scale(stance, options), common.up(options)));
            }
        }
        let Some((common, first)) = common_stance(parsed, &own) else {
            continue;
        };
        for index in own {
            let Parsed { file, read, stance } = &parsed[index];
            let (scale, up) = (read.scale(&common, options), common.up(options));
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
                    let first = first.display();
                    Err(FileError::Invalid(format!(
                        "its figure stands along {own}, but that of {first}, which has the same joints, along {up}: turn one of them, or bake them apart"
                    )))
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
