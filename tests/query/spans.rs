//! Promise: each stage of a query, of a game's step and of a crowd's frame is a span of `tracing`, entered and left in order.

use std::sync::Arc;

use sabaki::anim::JointTransform;
use sabaki::character::{CharacterSettings, Characters, Threat};
use sabaki::math::Rigid2;
use sabaki::query::{Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::spans::Spans;
use sabaki_fixtures::throw::{ThrowSettings, throw};
use sabaki_fixtures::with;

#[test]
fn the_stages_of_a_query_and_of_a_step_are_spans() {
    let (baked, settings) = (embedded(), QuerySettings::default());
    let spans = Spans::default();
    tracing::subscriber::with_default(spans.clone(), || {
        let query = Query::new(baked, &settings);
        // So late that some attacks are only avoided by a warp.
        let late = with(|s: &mut ThrowSettings| (s.lead, s.speed) = ((0.0, 0.05), (12.0, 15.0)));
        for index in 0..60 {
            let throw = throw(baked, &late, 5, index).unwrap();
            // A span that another test enters for the first time meanwhile may be taken for one that nobody hears.
            tracing::callsite::rebuild_interest_cache();
            answer_throw(&query, &throw, sabaki::query::Evaluation::Lazy);
        }
        let settings = with(|s: &mut CharacterSettings| s.threads = 1);
        let mut game = Characters::new(Arc::new(baked.clone()), settings).unwrap();
        let id = game.spawn(Rigid2::IDENTITY).unwrap();
        let mut events = Vec::new();
        game.step(0.01, &[], &mut events);
        let mut joints = vec![JointTransform::IDENTITY; baked.graph().skeleton().len()];
        game.pose(id, &mut joints).unwrap();
        let from = glam::Vec3::new(0.3, 0.1, 3.0);
        let place = joints[0].translation + from;
        game.threaten(Threat::ball(game.now() + 0.5, place, -from * 2.0, 0.1))
            .unwrap();
        game.step(0.01, &[], &mut events);
    });
    assert_eq!(spans.open(), 0);
    let heard = spans.take();
    let wanted = [
        "query: gather",
        "query: draw the attack's maps",
        "query: cull on the CPU",
        "query: test and choose",
        "query: warp",
        "characters: step",
        "character: plan",
    ];
    for name in wanted {
        let is_heard = heard.iter().any(|(other, _)| *other == name);
        assert!(is_heard, "{name}: {heard:?}");
    }
}
