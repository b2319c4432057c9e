//! Clips that stay in guard.

use glam::Vec3;

use super::choreography::Choreography;
use super::rhythm::Rhythm;
use super::skeleton::{LEFT, RIGHT};

/// Idling in guard.
pub(super) fn choreographies(choreographies: &mut Vec<Choreography>) {
    choreographies.push(idle_calm(Rhythm::varied(1).plain()));
    choreographies.push(idle_watchful(Rhythm::varied(2).swaying(0.022)));
    choreographies.push(idle_restless(Rhythm::varied(3)));
    let bounce = Rhythm::varied(4).bouncing(0.016, 1.9, 0.10);
    choreographies.push(bounce_in_guard("bounce", bounce));
    let quick = Rhythm::varied(5).bouncing(0.011, 2.5, 0.07).swaying(0.02);
    choreographies.push(bounce_in_guard("bounce_quick", quick));
    choreographies.push(switch_stance(Rhythm::varied(6)));
}

fn idle_calm(rhythm: Rhythm) -> Choreography {
    let mut s = Choreography::new("idle_calm", rhythm);
    s.guard(1.6);
    s.pose(0.8, |b| b.pelvis += Vec3::new(0.02, -0.01, 0.03));
    s.pose(1.2, |b| {
        b.pelvis += Vec3::new(-0.01, 0.0, -0.03);
        b.hands[LEFT].y -= 0.03;
    });
    s.guard(1.2).guard(1.2);
    s
}

/// Shifts the weight from foot to foot while the lead hand measures the distance.
fn idle_watchful(rhythm: Rhythm) -> Choreography {
    let mut s = Choreography::new("idle_watchful", rhythm);
    s.guard(0.8);
    s.pose(0.6, |b| {
        b.pelvis += Vec3::new(0.03, -0.015, 0.05);
        b.chest.y -= 0.08;
        b.hands[LEFT] += Vec3::new(0.0, 0.02, 0.09);
    });
    s.pose(0.7, |b| {
        b.pelvis += Vec3::new(-0.02, -0.005, -0.05);
        b.hands[LEFT] += Vec3::new(0.02, -0.05, 0.03);
        b.head.y -= 0.1;
    });
    s.guard(0.7);
    s.pose(0.5, |b| b.hands[LEFT] += Vec3::new(0.0, 0.0, 0.1));
    s.pose(0.4, |b| b.hands[LEFT] += Vec3::new(0.02, -0.02, 0.0));
    s.guard(0.6).guard(0.7);
    s
}

/// Rolls the shoulders, feints with the hands and moves a foot.
fn idle_restless(rhythm: Rhythm) -> Choreography {
    let mut s = Choreography::new("idle_restless", rhythm);
    s.guard(0.6);
    s.pose(0.25, |b| {
        b.chest += Vec3::new(0.05, -0.16, 0.06);
        b.hands[LEFT].z += 0.06;
    });
    s.pose(0.25, |b| {
        b.chest += Vec3::new(0.02, 0.14, -0.07);
        b.hands[RIGHT].z += 0.05;
    });
    s.guard(0.35);
    s.foot(RIGHT, 0.2, 0.22)
        .step_off(Vec3::new(-0.05, 0.0, -0.03));
    s.guard(0.7);
    s.pose(0.3, |b| b.pelvis.y -= 0.035);
    s.guard(0.35);
    s.step(RIGHT, 0.15, 0.22);
    s.guard(0.6);
    s.pose(0.22, |b| {
        b.chest.z += 0.12;
        b.head.z += 0.06;
    });
    s.pose(0.26, |b| {
        b.chest.z -= 0.12;
        b.head.z -= 0.06;
    });
    s.guard(0.4).guard(0.8);
    s
}

fn bounce_in_guard(name: &str, rhythm: Rhythm) -> Choreography {
    let mut s = Choreography::new(name, rhythm);
    s.guard(1.5);
    s.pose(0.8, |b| b.pelvis.z += 0.03);
    s.pose(0.9, |b| b.pelvis += Vec3::new(0.02, 0.0, -0.03));
    s.guard(0.8).guard(1.2);
    s
}

/// Changes the front foot, stays for a while, and changes back.
fn switch_stance(rhythm: Rhythm) -> Choreography {
    let mut s = Choreography::new("switch_stance", rhythm);
    s.guard(0.7);
    hop_over(&mut s);
    s.guard(1.0);
    s.pose(0.5, |b| b.pelvis += Vec3::new(-0.02, 0.0, 0.04));
    s.guard(0.6);
    hop_over(&mut s);
    s.guard(1.0);
    s
}

fn hop_over(s: &mut Choreography) {
    s.pose(0.16, |b| b.pelvis.y -= 0.05);
    s.switch();
    s.foot(LEFT, 0.0, 0.30)
        .leap(0.07)
        .foot(RIGHT, 0.03, 0.30)
        .leap(0.07);
    s.pose(0.17, |b| {
        b.pelvis.y += 0.025;
        b.hips.y *= 0.2;
        b.chest.y *= 0.2;
    });
    s.pose(0.18, |b| b.pelvis.y -= 0.04);
    s.guard(0.3);
}
