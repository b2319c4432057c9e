//! Promise: choosing and blending levels and planning a budget allocate nothing once they have seen others like it.

use sabaki_fixtures::memory as counting;
use sabaki_fixtures::with;

use counting::allocations;
use glam::Affine3A;
use sabaki_fixtures::lod::{random_case, screen_error};
use sabaki_fixtures::random::Random;
use sabaki_motion::lod::{
    Budget, Cost, LevelId, LevelSettings, Levels, Measure, Planner, SwitchSettings, Switching,
};

#[test]
fn a_frame_of_levels_allocates_nothing() {
    let (skeleton, clip) = random_case(&mut Random::new(4));
    let levels = Levels::build(&skeleton, &[clip], &LevelSettings::default()).unwrap();
    assert!(levels.levels.len() > 5);
    let distances: Vec<f32> = (0..500).map(|index| index as f32 * 0.3).collect();
    let identity = vec![Affine3A::IDENTITY; skeleton.len()];
    let mut matrices = identity.clone();
    let blends = 0..levels.levels.len() as u16;
    let blends: Vec<_> = blends.map(|level| levels.blend(LevelId(level))).collect();
    let (mut switching, mut planner) = (Switching::default(), Planner::default());
    let mut before = vec![None; distances.len()];
    let mut frame = |pixels: f32| {
        let start = allocations();
        let settings = with(|s: &mut SwitchSettings| s.rule = screen_error(pixels));
        switching.update(&levels, &settings).unwrap();
        let budget = Budget {
            milliseconds: 0.2 / pixels,
            cost: Cost {
                character: 50.0,
                joint: 20.0,
                blend: 30.0,
            },
            switching: settings,
            measure: Measure::Mean,
        };
        planner.plan(&levels, &distances, &budget).unwrap();
        for (distance, before) in distances.iter().zip(&mut before) {
            let choice = planner.switching().choose(*distance, *before);
            *before = Some(choice.level);
            matrices.clear();
            let (index, level) = (choice.level.index(), &levels.levels[choice.level.index()]);
            matrices.extend(identity.iter().take(level.kept.len()));
            if let Some(blend) = &blends[index] {
                blend.apply(choice.blend, &mut matrices);
            }
        }
        allocations() - start
    };
    assert!(frame(1.0) > 0, "the counter counts");
    for pixels in [0.5, 1.0, 2.0] {
        assert_eq!(frame(pixels), 0);
    }
}
