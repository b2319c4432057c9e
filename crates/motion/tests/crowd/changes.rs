//! Promise: every character is posed as it was last described, whatever changes and however often all are sorted; the single calls
//! may be mixed with whole frames.

use super::frame::{SECONDS, stage};
use sabaki_fixtures::crowd::{Stage, apart, crowd_of, settings};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;
use sabaki_motion::crowd::{Character, Crowd, CrowdError, Frame, Layout, MemberId, Output};
use sabaki_motion::lod::LevelId;
use sabaki_motion::math::{F32x16, Isa};

/// What a character was told, and when.
#[derive(Clone, Copy)]
struct Told {
    character: Character,
    since: f64,
    is_active: bool,
}

/// A crowd, and what its characters were told.
struct Changing {
    crowd: Crowd,
    told: Vec<Told>,
    random: Random,
}

impl Changing {
    fn index(&mut self) -> usize {
        self.random.below(self.told.len())
    }

    /// One character is described anew, moved, put on another level, taken out or added.
    fn change(&mut self, others: &[Character]) {
        let (index, other) = (self.index(), others[self.random.below(others.len())]);
        let id = MemberId(index as u32);
        let since = self.crowd.time();
        let told = &mut self.told[index];
        match self.random.below(6) {
            0 => {
                self.crowd.set(id, &other).unwrap();
                *told = Told {
                    character: other,
                    since,
                    is_active: true,
                };
            }
            1 => {
                self.crowd.place(id, &other.placement).unwrap();
                told.character.placement = other.placement;
            }
            2 => {
                let level = LevelId(self.random.below(4) as u16);
                self.crowd.set_level(id, level).unwrap();
                (told.character.level, told.character.blend) = (level, 0.0);
            }
            3 => {
                let Character { level, blend, .. } = other;
                self.crowd.set_detail(id, level, blend).unwrap();
                (told.character.level, told.character.blend) = (level, blend);
            }
            4 => {
                self.crowd.deactivate(id).unwrap();
                told.is_active = false;
            }
            _ => {
                self.crowd.add(&other).unwrap();
                self.told.push(Told {
                    character: other,
                    since,
                    is_active: true,
                });
            }
        }
    }

    /// Returns how many stand in groups of finer levels, and how many play two clips.
    fn check(&self, stage: &Stage, out: &[F32x16]) -> [usize; 2] {
        let mut seen = [0; 2];
        for (id, told) in (0..).map(MemberId).zip(&self.told) {
            let slice = match self.crowd.pose_slice(id) {
                Ok(slice) => slice,
                Err(error) => {
                    assert!(matches!(error, CrowdError::NoSuchCharacter { .. }));
                    assert!(!told.is_active, "{id:?} has no pose");
                    continue;
                }
            };
            assert!(told.is_active, "{id:?} was taken out");
            let detail = f32::from(told.character.level.0) + told.character.blend;
            assert!(f32::from(slice.level.0) <= detail, "{id:?}");
            seen[0] += usize::from(slice.level < told.character.level);
            seen[1] += usize::from(told.character.fade.is_some());
            let seconds = self.crowd.time() - told.since;
            let apart = apart(stage, &told.character, seconds, &slice, out);
            assert!(apart < 4e-4, "{id:?}: {apart} m");
        }
        seen
    }
}

#[test]
fn characters_change_while_all_are_sorted_again_and_again() {
    let (stage, _) = stage();
    let others = stage.characters(300, 6);
    for layout in [Layout::Blocks, Layout::Instances] {
        let output = with(|s: &mut Output| s.layout = layout);
        let characters = stage.characters(400, 5);
        let (crowd, _) = crowd_of(&stage, &characters, settings(output, Isa::best(), 2));
        let told = characters.iter().map(|&character| Told {
            character,
            since: 0.0,
            is_active: true,
        });
        let mut changing = Changing {
            crowd,
            told: told.collect(),
            random: Random::new(3),
        };
        let (mut sorted, mut changed) = (0, 0);
        let mut out = Vec::new();
        for frame in 0..900 {
            if frame % 5 == 0 {
                changing.change(&others);
                changed += 1;
            }
            let crowd = &mut changing.crowd;
            if frame % 3 == 0 {
                crowd.advance(SECONDS);
                out.resize(crowd.output_len(), F32x16::ZERO);
                crowd.pose(&mut out).unwrap();
            } else {
                out.resize(crowd.max_output_len(crowd.len()), F32x16::ZERO);
                let input = with(|s: &mut Frame| s.seconds = SECONDS);
                sorted += usize::from(crowd.frame(&input, &mut out).unwrap().sorted);
            }
            if frame % 7 == 0 {
                let seen = changing.check(&stage, &out);
                assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
            }
        }
        assert!(sorted > 1 && changed > 100, "{sorted} {changed}");
    }
}
