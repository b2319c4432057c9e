//! Promise: levels change with distance as the settings say, and their bands follow each other.

use sabaki_fixtures::lod::{random_levels, rules, screen_error, setting_of};
use sabaki_fixtures::with;
use sabaki_motion::lod::{LevelId, Measure, Rule, SwitchSettings, Switching, View};

#[test]
fn the_papers_distances_are_linear_in_energy() {
    for seed in 0..30 {
        let (_, _, levels) = random_levels(seed);
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest: 50.0 },
            hysteresis: 0.0,
            blend_step: None,
            ..SwitchSettings::default()
        };
        let switching = Switching::new(&levels, &settings).unwrap();
        let last = levels.levels.len() - 1;
        let greatest = levels.levels.iter().map(|l| l.energy).fold(0.0, f32::max);
        let mut energy = 0.0f32;
        for (index, level) in levels.levels.iter().enumerate().skip(1) {
            energy = energy.max(level.energy);
            let share = energy / greatest.max(f32::MIN_POSITIVE);
            let band = switching.bands()[index - 1];
            assert_eq!(band.end, 50.0 * share);
            assert_eq!((band.start, band.full), (band.end, band.end));
            let at = switching.choose(band.end, None);
            assert!(at.level.index() >= index && at.blend == 0.0);
            if band.end > 0.0 {
                assert!(switching.choose(band.end * 0.9999, None).level.index() < index);
            }
        }
        for distance in [50.0, 51.0, 1e9, f32::INFINITY] {
            let choice = switching.choose(distance, Some(LevelId(0)));
            assert_eq!((choice.level.index(), choice.blend), (last, 0.0));
        }
        if greatest > 0.0 {
            assert_eq!(switching.choose(-1.0, None).level, LevelId(0));
            assert_eq!(switching.choose(f32::NAN, None).level, LevelId(0));
        }
    }
}

#[test]
fn the_mean_error_asks_for_no_more_than_the_greatest() {
    for seed in 0..20 {
        let (_, _, levels) = random_levels(seed);
        let pixels = 2.0;
        let [mean, greatest] = [Measure::Mean, Measure::Greatest].map(|measure| {
            let settings = SwitchSettings {
                rule: Rule::ScreenError { pixels, measure },
                blend_step: None,
                ..SwitchSettings::default()
            };
            Switching::new(&levels, &settings).unwrap()
        });
        let mut worst = 0.0f32;
        for (index, level) in levels.levels.iter().enumerate().skip(1) {
            worst = worst.max(level.error.mean);
            let (mean, greatest) = (mean.bands()[index - 1], greatest.bands()[index - 1]);
            assert!(mean.end <= greatest.end);
            // Less is lost in the rounding of distances.
            if worst > 1e-4 {
                let view = View::default();
                let error = view.pixels(worst, mean.start - levels.reach);
                assert!(error <= 2.0 * 1.001, "{error}");
            }
        }
    }
}

#[test]
fn the_screen_is_that_of_a_pinhole() {
    let view = View::default();
    // 1080 lines for 2 tan 30° metres at one metre.
    let expected = 1080.0 / (2.0 / 3f32.sqrt());
    assert!((view.pixels_at_one_metre() - expected).abs() < 1e-2);
    assert!((view.pixels(1.7, view.distance(1.7, 20.0)) - 20.0).abs() < 1e-3);
}

#[test]
fn bands_follow_each_other_and_leave_room() {
    for seed in 0..40 {
        let (_, _, levels) = random_levels(seed);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            assert_eq!(switching.bands().len(), levels.levels.len() - 1);
            let mut before = 0.0;
            for (band, level) in switching.bands().iter().zip(&levels.levels[1..]) {
                assert!(before <= band.start && band.start <= band.full && band.full <= band.end);
                before = band.end;
                if level.error.step > 1e-6 {
                    let width = band.full - band.start;
                    let (view, distance) = (settings.view, band.start - levels.reach);
                    let near = view.pixels(level.error.step, distance);
                    // A camera that passes the whole band in one frame moves the point once.
                    let step = near * ((5.0 / 60.0) / width).min(1.0);
                    assert!(step <= 0.5 * 1.002, "{step} pixels in {band:?}");
                }
            }
        }
    }
}

#[test]
fn the_blend_is_continuous_and_hysteresis_keeps_the_level() {
    for seed in 0..20 {
        let (_, _, levels) = random_levels(seed);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            for (index, band) in switching.bands().iter().enumerate() {
                if band.full >= band.end {
                    continue;
                }
                let between = 0.5 * (band.full + band.end);
                let finer = switching.choose(between, Some(LevelId(index as u16)));
                let coarser = switching.choose(between, Some(LevelId(index as u16 + 1)));
                assert_eq!((finer.level.index(), finer.blend), (index, 1.0));
                assert_eq!((coarser.level.index(), coarser.blend), (index + 1, 0.0));
            }
            // Whatever the level was, the same is seen.
            for step in 0..5000 {
                let distance = (switching.furthest() + 1.0) * step as f32 / 5000.0;
                let seen = |before| {
                    let choice = switching.choose(distance, before);
                    f32::from(choice.level.0) + choice.blend
                };
                for before in 0..levels.levels.len() as u16 {
                    assert_eq!(seen(Some(LevelId(before))), seen(None), "{distance} m");
                }
            }
        }
    }
}

#[test]
fn without_hysteresis_a_level_starts_exactly_where_its_band_ends() {
    for seed in 0..10 {
        let (_, _, levels) = random_levels(seed);
        for step in 1..400 {
            let size = 0.37 * step as f32;
            for rule in [Rule::Energy { furthest: size }, screen_error(0.1 * size)] {
                let settings = with(|s: &mut SwitchSettings| (s.rule, s.hysteresis) = (rule, 0.0));
                let switching = Switching::new(&levels, &settings).unwrap();
                let mut last = 0.0;
                for (index, band) in switching.bands().iter().enumerate() {
                    assert!(last <= band.start && band.start <= band.full, "{band:?}");
                    assert!(band.full <= band.end, "{band:?}");
                    last = band.end;
                    for before in [0, index, index + 1] {
                        let choice = switching.choose(band.end, Some(LevelId(before as u16)));
                        assert!(choice.level.index() > index, "{rule:?} {band:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn settings_that_make_no_sense_are_errors() {
    let (_, _, levels) = random_levels(1);
    let fails = |change: &dyn Fn(&mut SwitchSettings)| {
        let mut settings = SwitchSettings::default();
        change(&mut settings);
        setting_of(Switching::new(&levels, &settings).unwrap_err())
    };
    for wrong in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(fails(&|s| s.view.fov = wrong), "fov");
        assert_eq!(fails(&|s| s.view.height = wrong), "height");
        assert_eq!(
            fails(&|s| s.rule = Rule::Energy { furthest: wrong }),
            "furthest"
        );
        assert_eq!(fails(&|s| s.rule = screen_error(wrong)), "pixels");
        assert_eq!(fails(&|s| s.blend_step = Some(wrong)), "blend_step");
        assert_eq!(fails(&|s| s.camera_speed = wrong), "camera_speed");
        assert_eq!(fails(&|s| s.frame_rate = wrong), "frame_rate");
    }
    for wrong in [-0.1, 1.0, f32::NAN] {
        assert_eq!(fails(&|s| s.hysteresis = wrong), "hysteresis");
    }
}
