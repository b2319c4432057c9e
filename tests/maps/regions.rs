//! The CPU's maps equal their definitions, texel by texel.

use glam::Vec3;
use proptest::prelude::*;
use sabaki::anim::JointId;
use sabaki::maps::{
    BakeError, BakeSettings, Baker, BitMap, Body, BodySphere, Disc, Drawing, FixedTransform2,
    MapGrid, MapRect, MaskMap, Slab, raster,
};
use sabaki::math::Rigid2;
use sabaki_fixtures::cull::map_rect;
use sabaki_fixtures::small::small;
use sabaki_fixtures::with;

fn drawing() -> impl Strategy<Value = Drawing> {
    let disc =
        (-80i32..700, -80i32..500, 0f32..220.0).prop_map(|(x, z, radius)| Disc::new(x, z, radius));
    let frames = prop::collection::vec(prop::collection::vec(disc, 0..4), 0..6);
    ((1u32..40, 1u32..30), frames).prop_map(|((width, height), frames)| {
        let mut drawing = with(|s: &mut Drawing| s.rect = map_rect(-7, 3, width, height));
        for discs in frames {
            drawing.discs.extend(discs);
            drawing.frame_ends.push(drawing.discs.len() as u32);
        }
        drawing
    })
}

fn covered(drawing: &Drawing, frame: usize, u: i32, v: i32) -> bool {
    drawing.frame(frame).iter().any(|disc| disc.covers(u, v))
}

fn texels(rect: MapRect) -> impl Iterator<Item = (i32, i32)> {
    (0..rect.height as i32).flat_map(move |v| (0..rect.width as i32).map(move |u| (u, v)))
}

proptest! {
    #[test]
    fn body_is_where_every_frame_covers_and_evasion_where_only_the_first_surely_does(drawing in drawing()) {
        let maps = raster::every_frame(&drawing);
        let frames = drawing.frames();
        for (u, v) in texels(drawing.rect) {
            let always = frames > 0 && (0..frames).all(|frame| covered(&drawing, frame, u, v));
            let at_first = frames > 0 && covered(&drawing, 0, u, v);
            prop_assert_eq!(maps.body.get(u, v), always);
            prop_assert_eq!(maps.evasion.get(u, v), at_first && !always);
        }
        prop_assert!(maps.body.is_sound() && maps.evasion.is_sound());
    }

    #[test]
    fn attack_is_where_some_frame_covers(drawing in drawing()) {
        let map = raster::any_frame(&drawing);
        for (u, v) in texels(drawing.rect) {
            prop_assert_eq!(map.get(u, v), (0..drawing.frames()).any(|frame| covered(&drawing, frame, u, v)));
        }
        prop_assert_eq!(map.count() as usize, texels(drawing.rect).filter(|&(u, v)| map.get(u, v)).count());
    }

    /// A disc is the outline of the part of the sphere that lies in the slab: points of that part
    /// lie under it, and its rim is reached.
    #[test]
    fn a_disc_is_the_outline_of_the_sphere_in_the_slab(
        height in -0.5f32..2.0, radius in 0.02f32..0.5, slab in -2i32..7, steps in 1u32..40,
    ) {
        let grid = MapGrid::PAPER;
        let centre = Vec3::new(0.3, height, -0.2);
        let disc = grid.disc(centre, radius, Slab(slab));
        let (bottom, top) = (slab as f32 * 0.3, (slab + 1) as f32 * 0.3);
        let widest = (0..=steps * 100)
            .map(|i| bottom + (top - bottom) * i as f32 / (steps * 100) as f32)
            .map(|y| radius * radius - (y - height).powi(2))
            .fold(f32::NEG_INFINITY, f32::max);
        let sub_texel = grid.texel / 16.0;
        match disc {
            None => prop_assert!(widest <= 1e-6),
            Some(disc) => {
                let drawn = disc.radius as f32 * sub_texel;
                prop_assert!(drawn * drawn >= widest - 2.0 * radius * sub_texel);
                prop_assert!((drawn - sub_texel).max(0.0).powi(2) <= widest.max(0.0) + 0.02 * radius * radius);
                prop_assert!(grid.slabs(centre, radius).contains(&slab));
            }
        }
    }

    /// In fixed point a texel's centre lands where it lands in real numbers, but for those that
    /// land on a border.
    #[test]
    fn a_turned_texel_lands_where_it_should(
        heading in -3.2f32..3.2, x in -4.0f32..4.0, z in -4.0f32..4.0, (u, v) in (0i32..256, 0i32..256),
    ) {
        let grid = MapGrid { texel: 0.02, ..MapGrid::default() };
        let placement = Rigid2::new(heading, x, z);
        let attack = MapRect { u: -31, v: 57, width: 256, height: 256 };
        let turn = FixedTransform2::new(placement, attack, grid);
        let centre = Vec3::new(f32::midpoint(u as f32, (u + 1) as f32) + attack.u as f32, 0.0, f32::midpoint(v as f32, (v + 1) as f32) + attack.v as f32);
        let real = placement.point(centre * grid.texel) / grid.texel;
        let (to_u, to_v) = turn.texel(u, v);
        let near = |found: i32, real: f32| {
            let off = 0.05;
            (real - off).floor() as i32 <= found && found <= (real + off).floor() as i32
        };
        prop_assert!(near(to_u, real.x) && near(to_v, real.z), "{:?} instead of {}", (to_u, to_v), real);
    }
}

#[test]
fn a_map_that_lost_words_or_padding_is_not_sound() {
    let map = BitMap::new(map_rect(0, 0, 33, 2));
    let damaged = |words: &str| {
        let json = format!(r#"{{"rect":{{"u":0,"v":0,"width":33,"height":2}},"words":{words}}}"#);
        serde_json::from_str::<BitMap>(&json).unwrap()
    };
    assert!(map.is_sound() && damaged("[0,1,0,1]").is_sound());
    assert!(!damaged("[0,1,0]").is_sound());
    assert!(!damaged("[0,2,0,0]").is_sound());
}

#[test]
fn a_mask_map_of_other_slices_or_words_is_not_sound() {
    let damaged = |lanes: u32, masks: &str| {
        let rect = r#"{"u":0,"v":0,"width":2,"height":1}"#;
        let json = format!(r#"{{"rect":{rect},"lanes":{lanes},"masks":{masks}}}"#);
        serde_json::from_str::<MaskMap>(&json).unwrap()
    };
    assert!(damaged(1, "[1,8]").is_sound(4) && damaged(2, "[0,1,4294967295,7]").is_sound(35));
    assert!(!damaged(1, "[1,16]").is_sound(4) && !damaged(2, "[0,1,0,8]").is_sound(35));
    assert!(!damaged(1, "[1]").is_sound(4) && !damaged(1, "[1,1,1]").is_sound(4));
    assert!(!damaged(2, "[1,1,1,1]").is_sound(4) && !damaged(0, "[]").is_sound(4));
}

#[test]
fn a_body_that_is_none_or_reaches_too_high_is_refused() {
    let graph = || small().graph().clone();
    let refused = |body: Option<Body>, maps: MapGrid| {
        let settings = with(|s: &mut BakeSettings| (s.body, s.maps) = (body, maps));
        Baker::new(graph(), settings).unwrap_err()
    };
    let sphere = |joint, radius| BodySphere {
        joint: JointId(joint),
        offset: Vec3::ZERO,
        radius,
    };
    let no_bodies = [
        vec![],
        vec![sphere(999, 0.1)],
        vec![sphere(0, 0.0)],
        vec![sphere(0, f32::NAN)],
    ];
    for spheres in no_bodies {
        let body = Some(Body::new(spheres));
        assert_eq!(refused(body, MapGrid::default()), BakeError::Body);
    }
    let high = Body::new(vec![BodySphere {
        offset: Vec3::Y * 900.0,
        ..sphere(0, 0.1)
    }]);
    let thin = with(|s: &mut MapGrid| s.slab_height = 0.001);
    assert!(matches!(
        refused(Some(high), thin),
        BakeError::TooHigh {
            high: 800_000..,
            ..
        }
    ));
}
