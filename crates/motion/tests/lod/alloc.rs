//! Promise: choosing levels, planning a budget and drawing a skin allocate nothing once they have seen others like it.

use sabaki_fixtures::memory as counting;

use counting::allocations;
use glam::Affine3A;
use sabaki_fixtures::lod::random_case;
use sabaki_fixtures::random::Random;
use sabaki_motion::lod::{
    Budget, Cost, LevelId, LevelSettings, Levels, Measure, Planner, Rule, SwitchSettings, Switching,
};

#[test]
fn a_frame_of_levels_allocates_nothing() {
    let (skeleton, clip) = random_case(&mut Random::new(4));
    let levels = Levels::build(&skeleton, &[clip], &LevelSettings::default()).unwrap();
    assert!(levels.levels.len() > 5);
    let distances: Vec<f32> = (0..500).map(|index| index as f32 * 0.3).collect();
    let identity = vec![Affine3A::IDENTITY; skeleton.len()];
    let mut matrices = identity.clone();
    let blends: Vec<_> = (0..levels.levels.len())
        .map(|level| levels.blend(LevelId(level as u16)))
        .collect();
    let binds: Vec<_> = levels
        .levels
        .iter()
        .map(|level| level.binds(&identity).unwrap())
        .collect();
    let (mut switching, mut planner) = (Switching::default(), Planner::default());
    let (mut palette, mut before) = (Vec::new(), vec![None; distances.len()]);
    let mut frame = |pixels: f32| {
        let start = allocations();
        let rule = Rule::ScreenError {
            pixels,
            measure: Measure::Greatest,
        };
        let settings = SwitchSettings {
            rule,
            ..SwitchSettings::default()
        };
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
            matrices.extend(
                identity
                    .iter()
                    .take(levels.levels[choice.level.index()].kept.len()),
            );
            if let Some(blend) = &blends[choice.level.index()] {
                blend.apply(choice.blend, &mut matrices);
            }
            levels.levels[choice.level.index()].palette(
                &matrices,
                &binds[choice.level.index()],
                &mut palette,
            );
        }
        allocations() - start
    };
    assert!(frame(1.0) > 0, "the counter counts");
    for pixels in [0.5, 1.0, 2.0] {
        assert_eq!(frame(pixels), 0);
    }
}
