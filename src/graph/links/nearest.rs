//! The closest links of many events, without most of the distances: lower bounds show which windows are farther apart than the links
//! that were found before.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::OnceLock;

use super::candidates::{Candidate, Candidates};
use super::join_record::Joins;
use super::margin::{EventMargin, Side};
use super::parts::ClipParts;
use crate::graph::distance::{Compared, DiagonalRows, Diagonals, Windows};
use crate::graph::search::{NearWindows, WindowCell};
use crate::math::{Isa, in_parallel};

/// Windows of clips of one length, and their bounds, each made when it is first searched.
struct ClipWindows<'a> {
    length: usize,
    /// Windows of all clips, if the graph has them of this length.
    own: Option<&'a [Windows]>,
    made: Vec<OnceLock<Windows>>,
    near: NearWindows,
}

/// Memory of a search.
#[derive(Default)]
struct Scratch {
    diagonals: Diagonals,
    near: Vec<WindowCell>,
    rows: Vec<u32>,
    /// Near pairs and their squared distances.
    squares: Vec<(WindowCell, f32)>,
}

/// Windows of all clips, by their length.
pub(super) struct NearestLinks<'a> {
    lengths: BTreeMap<usize, ClipWindows<'a>>,
    pub(super) joins: Joins,
}

/// Events on one side of which links are searched.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Indices of the events.
    pub(super) events: &'a [usize],
    pub(super) side: Side,
    /// Moments that may be linked.
    pub(super) allowed: &'a [bool],
    /// Number of links of each event.
    pub(super) most: usize,
}

impl<'a> NearestLinks<'a> {
    /// Links of an earlier bake may be known.
    pub(super) fn new(joins: Joins) -> Self {
        Self {
            lengths: BTreeMap::new(),
            joins,
        }
    }

    /// Finds the links of each event whose windows are closest, closest first, before they are refined. In each clip there is at most one
    /// of each event for each `spread` frames.
    pub(super) fn find(
        &mut self,
        candidates: &Candidates<'a>,
        wanted: Wanted<'_>,
    ) -> Vec<Vec<Candidate>> {
        let margins: Vec<Option<EventMargin>> = { wanted.events.iter() }
            .map(|&event| candidates.margin(event, wanted.side))
            .collect();
        for margin in margins.iter().flatten() {
            let of_length = || ClipWindows::new(candidates, margin.window);
            self.lengths.entry(margin.window).or_insert_with(of_length);
        }
        let threads = candidates.source.settings.threads;
        let (joins, most) = (&self.joins, wanted.most);
        let all: Vec<usize> = (0..joins.is_same.len()).collect();
        let others: Vec<usize> = { all.iter().copied() }
            .filter(|&clip| !joins.is_same[clip])
            .collect();
        // What is known, and the clips that are searched.
        let known = in_parallel(threads, margins.len(), |index| {
            let known = joins.known(candidates, (margins[index].as_ref()?, most));
            Some(match known {
                Some(known) => (known, others.as_slice()),
                None => (Vec::new(), all.as_slice()),
            })
        });
        for (&length, windows) in &self.lengths {
            let own = margins.iter().zip(&known);
            let own =
                own.filter(|(margin, _)| margin.as_ref().is_some_and(|it| it.window == length));
            let clips = own.filter_map(|(_, known)| Some(known.as_ref()?.1));
            let clips = clips.max_by_key(|clips| clips.len()).unwrap_or(&[]);
            in_parallel(threads, clips.len(), |index| {
                let own = windows.windows(candidates, clips[index]);
                windows.near.prepare(clips[index], own);
            });
        }
        let found = in_parallel(threads, margins.len(), |index| {
            match (&margins[index], &known[index]) {
                (Some(margin), Some((known, clips))) => {
                    let start = (known.clone(), *clips);
                    self.lengths[&margin.window].links(candidates, (margin, &wanted), start)
                }
                _ => Vec::new(),
            }
        });
        for (margin, found) in margins.iter().zip(&found) {
            if let Some(margin) = margin {
                self.joins.add(candidates, (margin, most), found);
            }
        }
        found
    }
}

impl<'a> ClipWindows<'a> {
    /// The closest links of one range: those that are known, and those to some clips.
    fn links(
        &self,
        candidates: &Candidates<'_>,
        (margin, wanted): (&EventMargin, &Wanted<'_>),
        (mut found, clips): (Vec<Candidate>, &[usize]),
    ) -> Vec<Candidate> {
        let limit_of = |found: &[Candidate]| match found.last() {
            Some(last) if found.len() == wanted.most => last.cost,
            _ => candidates.lengths.loosest,
        };
        let mut limit = limit_of(&found);
        if clips.is_empty() {
            return found;
        }
        let range = self.near.range(&margin.windows);
        let rows = margin.windows.count();
        let mut scratch = Scratch::default();
        scratch.diagonals.load(&margin.windows, 0..rows);
        for &clip in clips {
            scratch.near.clear();
            let windows = self.windows(candidates, clip);
            let near = &mut scratch.near;
            self.near.find((&range, rows), (clip, windows, limit), near);
            if scratch.near.is_empty() {
                continue;
            }
            let compared = Compared {
                a: &margin.windows,
                b: windows,
                isa: Isa::best(),
            };
            scratch.measure(compared);
            let mut parts = ClipParts::new(candidates, (margin, clip), Some(wanted.allowed));
            for &(cell, square) in &scratch.squares {
                parts.take((cell.row as usize, cell.column as usize), square);
            }
            let near = parts.best.into_iter().flatten();
            found.extend(near.filter(|candidate| candidate.cost <= limit));
            found.sort_by(|a, b| order(a, b, wanted.side));
            found.truncate(wanted.most);
            limit = limit_of(&found);
        }
        found
    }

    fn new(candidates: &Candidates<'a>, length: usize) -> Self {
        /// Number of clips that the bounds are chosen for.
        const SAMPLES: usize = 64;
        let source = &candidates.source;
        let clips = source.aligner.clouds.len();
        let lengths = &candidates.lengths;
        let own = (length == lengths.window).then_some(source.windows);
        let made: Vec<OnceLock<Windows>> = (0..clips).map(|_| OnceLock::new()).collect();
        let step = clips.div_ceil(SAMPLES).max(1);
        let samples: Vec<&Windows> = (0..clips)
            .step_by(step)
            .map(|clip| windows(candidates, (own, &made), (clip, length)))
            .collect();
        let least = lengths.threshold.min(lengths.loosest);
        Self {
            length,
            own,
            near: NearWindows::new(&samples, clips, least),
            made,
        }
    }

    fn windows<'s>(&'s self, candidates: &Candidates<'_>, clip: usize) -> &'s Windows {
        windows(candidates, (self.own, &self.made), (clip, self.length))
    }
}

/// The windows of a clip of a length.
fn windows<'w>(
    candidates: &Candidates<'_>,
    (own, made): (Option<&'w [Windows]>, &'w [OnceLock<Windows>]),
    (clip, length): (usize, usize),
) -> &'w Windows {
    match own {
        Some(own) => &own[clip],
        None => {
            made[clip].get_or_init(|| Windows::new(&candidates.source.aligner.clouds[clip], length))
        }
    }
}

/// The order of links: by cost, and those of one cost by the clip and the frame of their far end.
fn order(a: &Candidate, b: &Candidate, side: Side) -> Ordering {
    let far = |candidate: &Candidate| {
        let link = &candidate.link;
        match side {
            Side::Before => (link.source_clip, link.source_frame),
            Side::After => (link.target_clip, link.target_frame),
        }
    };
    a.cost.total_cmp(&b.cost).then_with(|| far(a).cmp(&far(b)))
}

impl Scratch {
    /// Computes the squared distances of the near pairs, in the order of a distance map.
    fn measure(&mut self, compared: Compared<'_>) {
        let Self {
            diagonals,
            near,
            rows,
            squares,
        } = self;
        squares.clear();
        let shift = |cell: &WindowCell| cell.column as isize - cell.row as isize;
        near.sort_unstable_by_key(|cell| (shift(cell), cell.row));
        for cells in near.chunk_by(|a, b| shift(a) == shift(b)) {
            let shift = shift(&cells[0]);
            rows.clear();
            rows.extend(cells.iter().map(|cell| cell.row));
            diagonals.for_each(compared, DiagonalRows { rows, shift }, |row, square| {
                let cell = WindowCell {
                    row: row as u32,
                    column: (row as isize + shift) as u32,
                };
                squares.push((cell, square));
            });
        }
        squares.sort_unstable_by_key(|(cell, _)| *cell);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::{Clip, ClipDesc, EventKind, Joint, JointId, JointKind, Skeleton};
    use crate::graph::feet::Aligner;
    use crate::graph::links::lengths::Lengths;
    use crate::graph::links::source::LinkSource;
    use crate::graph::record::GraphRecord;
    use crate::graph::{ClipId, ClipSource, GraphEvent, GraphSettings, LinkSettings, PointCloud};
    use glam::{Quat, Vec3};

    const CLIPS: u32 = 5;
    const FRAMES: u32 = 150;

    fn skeleton() -> Skeleton {
        let joint = |index: u16| Joint {
            name: format!("joint {index}"),
            parent: index.checked_sub(1).map(JointId),
            offset: Vec3::new(0.0, 0.4, 0.1),
            kind: JointKind::Moving,
        };
        Skeleton::new((0..4).map(joint).collect()).unwrap()
    }

    fn clip(skeleton: &Skeleton, seed: u32) -> Clip {
        let phase = |joint: u32, frame: u32| {
            let pace = 0.05 + 0.02 * ((seed + joint) % 3) as f32;
            pace * frame as f32 + seed as f32
        };
        let rotation = |joint: u32, frame: u32| {
            Quat::from_rotation_x(0.5 * phase(joint, frame).sin())
                * Quat::from_rotation_z(0.4 * phase(joint + 1, frame).cos())
        };
        let desc = ClipDesc {
            name: format!("clip {seed}"),
            frame_rate: 30.0,
            roots: (0..FRAMES)
                .map(|frame| Vec3::new(0.01 * frame as f32, 1.0, 0.0))
                .collect(),
            rotations: (0..FRAMES)
                .flat_map(|frame| (0..4).map(move |joint| rotation(joint, frame)))
                .collect(),
            translations: Vec::new(),
        };
        Clip::new(skeleton, desc).unwrap()
    }

    /// Events that leave room for windows of full length, and for shorter ones.
    fn events() -> Vec<GraphEvent> {
        let event = |(clip, [first, last]): (u32, [u32; 2])| GraphEvent {
            clip: ClipId(clip),
            kind: EventKind::Evasion,
            first,
            last,
            joints: Vec::new(),
        };
        [
            (0, [40, 60]),
            (1, [30, 50]),
            (1, [57, 70]),
            (3, [80, 100]),
            (3, [106, 120]),
        ]
        .map(event)
        .to_vec()
    }

    /// What links are searched in.
    struct Scene {
        skeleton: Skeleton,
        clips: Vec<Clip>,
        clouds: Vec<PointCloud>,
        windows: Vec<Windows>,
        events: Vec<GraphEvent>,
        settings: GraphSettings,
    }

    impl Scene {
        fn new() -> Self {
            let skeleton = skeleton();
            let clips: Vec<Clip> = (0..CLIPS).map(|seed| clip(&skeleton, seed)).collect();
            let clouds: Vec<PointCloud> = { clips.iter() }
                .map(|clip| PointCloud::new(&skeleton, clip, &[1.0; 4]))
                .collect();
            let settings = GraphSettings::default();
            let window = Lengths::new(&settings, &LinkSettings::default()).window;
            let windows = clouds.iter().map(|cloud| Windows::new(cloud, window));
            Self {
                windows: windows.collect(),
                events: events(),
                skeleton,
                clips,
                clouds,
                settings,
            }
        }

        fn candidates(&self) -> Candidates<'_> {
            let source = LinkSource {
                clips: &self.clips,
                aligner: Aligner {
                    clouds: &self.clouds,
                    feet: None,
                },
                windows: &self.windows,
                events: &self.events,
                settings: &self.settings,
            };
            Candidates::new(
                source,
                Lengths::new(&self.settings, &LinkSettings::default()),
            )
        }
    }

    #[test]
    fn bounds_leave_out_no_link() {
        let scene = Scene::new();
        let candidates = scene.candidates();
        let all: Vec<usize> = (0..scene.events.len()).collect();
        let allowed: Vec<bool> = (0..CLIPS * FRAMES).map(|moment| moment % 7 != 3).collect();
        let mut lengths = std::collections::BTreeSet::new();
        for side in [Side::Before, Side::After] {
            let margins = all.iter().map(|&event| candidates.margin(event, side));
            let mut naive = |margin: EventMargin| {
                let mut expected: Vec<Candidate> = Vec::new();
                for (clip, cloud) in scene.clouds.iter().enumerate() {
                    let windows = Windows::new(cloud, margin.window);
                    let parts = candidates.between(&margin, (clip, &windows), Some(&allowed));
                    expected.extend(parts.into_iter().flatten());
                }
                expected.sort_by(|a, b| a.cost.total_cmp(&b.cost));
                lengths.insert(margin.window);
                expected
            };
            let expected: Vec<Vec<Candidate>> = margins
                .map(|margin| margin.map_or(Vec::new(), &mut naive))
                .collect();
            assert!(expected.iter().any(|links| links.len() > 20));
            for most in [1, 3, 16, usize::MAX] {
                let mut nearest = NearestLinks::new(Joins::default());
                nearest.joins.begin(&candidates, &allowed);
                let wanted = Wanted {
                    events: &all,
                    side,
                    allowed: &allowed,
                    most,
                };
                let found = nearest.find(&candidates, wanted);
                let key = |it: &Candidate| (it.link, it.event, it.cost.to_bits());
                for (found, expected) in found.iter().zip(&expected) {
                    let expected = expected.iter().take(most).map(key);
                    assert!(found.iter().map(key).eq(expected), "{most}");
                }
            }
        }
        assert!(lengths.len() > 1, "no range is short: {lengths:?}");
    }

    #[test]
    fn links_of_an_earlier_search_are_taken_over() {
        let scene = Scene::new();
        let candidates = scene.candidates();
        let input = ClipSource {
            skeleton: &scene.skeleton,
            clips: &scene.clips,
            events: &[],
        };
        let same = GraphRecord::new(input, &scene.settings);
        let same = same.clips_of(&same);
        let all: Vec<usize> = (0..scene.events.len()).collect();
        let find = |joins: Joins, allowed: &[bool], most: usize| {
            let mut nearest = NearestLinks::new(joins);
            nearest.joins.begin(&candidates, allowed);
            let same = nearest.joins.is_same.iter().filter(|same| **same).count();
            let found = [Side::Before, Side::After].map(|side| {
                let wanted = Wanted {
                    events: &all,
                    side,
                    allowed,
                    most,
                };
                let found = nearest.find(&candidates, wanted);
                let key = |it: &Candidate| (it.link, it.event, it.cost.to_bits());
                found.iter().flatten().map(key).collect::<Vec<_>>()
            });
            (found, nearest.joins.record, same)
        };
        let allowed = |moment: u32, changed: u32| match moment / FRAMES == changed {
            true => moment % 5 != 1,
            false => moment % 7 != 3,
        };
        let allowed = |changed: u32| -> Vec<bool> {
            (0..CLIPS * FRAMES)
                .map(|moment| allowed(moment, changed))
                .collect()
        };
        for most in [1, 3, 16, 1000] {
            let (_, record, _) = find(Joins::default(), &allowed(CLIPS), most);
            for changed in 0..=CLIPS {
                let (expected, _, none) = find(Joins::default(), &allowed(changed), most);
                let onto = Joins::onto(&same, &record);
                let (found, _, kept) = find(onto, &allowed(changed), most);
                assert!(found == expected, "{most} links, clip {changed} changes");
                let others = CLIPS as usize - usize::from(changed < CLIPS);
                assert_eq!([none, kept], [0, others]);
            }
        }
    }
}
