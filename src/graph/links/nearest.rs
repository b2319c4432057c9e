//! The closest links of many events.

use std::collections::BTreeMap;

use super::candidates::{Candidate, Candidates};
use super::clip_windows::{ClipWindows, KnownStart};
use super::join_record::Joins;
use super::margin::{EventMargin, Side};
use super::parts::RangeSearch;
use crate::math::in_parallel;

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
        let known = in_parallel(threads, margins.len(), |index| {
            let known = joins.known(candidates, margins[index].as_ref()?, most);
            Some(KnownStart {
                clips: if known.is_some() { &others } else { &all },
                links: known.unwrap_or_default(),
            })
        });
        for (&length, windows) in &self.lengths {
            let own = margins.iter().zip(&known);
            let own =
                own.filter(|(margin, _)| margin.as_ref().is_some_and(|it| it.window == length));
            let clips = own.filter_map(|(_, known)| Some(known.as_ref()?.clips));
            let clips = clips.max_by_key(|clips| clips.len()).unwrap_or(&[]);
            in_parallel(threads, clips.len(), |index| {
                windows.prepare(clips[index]);
            });
        }
        let found = in_parallel(threads, margins.len(), |index| {
            match (&margins[index], &known[index]) {
                (Some(margin), Some(start)) => {
                    let search = RangeSearch {
                        candidates,
                        margin,
                        allowed: Some(wanted.allowed),
                    };
                    self.lengths[&margin.window].links(search, most, start)
                }
                _ => Vec::new(),
            }
        });
        for (margin, found) in margins.iter().zip(&found) {
            if let Some(margin) = margin {
                self.joins.add(margin, most, found);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::{Clip, ClipDesc, EventKind, Joint, JointId, JointKind, Skeleton};
    use crate::graph::distance::Windows;
    use crate::graph::feet::Aligner;
    use crate::graph::links::KnownLinks;
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
        known: KnownLinks,
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
                known: KnownLinks::default(),
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
                known: &self.known,
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
                    let search = RangeSearch {
                        candidates: &candidates,
                        margin: &margin,
                        allowed: Some(&allowed),
                    };
                    let parts = search.between(clip, &windows);
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
