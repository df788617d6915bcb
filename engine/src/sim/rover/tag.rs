//! What a UWB tag measures: biases, noise that lasts, glass in the way, gross errors, and a clock of its own.

use super::world::World;
use crate::sim::random::{Purpose, Random};

/// A range as the file has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// By the tag's clock, s.
    pub(super) t_s: f64,
    pub(super) anchor: usize,
    pub(super) range_m: f64,
}

/// What the tag measures on the whole way, and how far its clock is off, s.
pub(super) fn ranges(world: &World, begin_s: f64, seed: u64) -> (Vec<Range>, f64) {
    const HEARD_M: f64 = 45.0;
    const LASTS_S: f64 = 1.5;
    /// What a pane adds changes as the rover goes, for another part of the pulse comes first.
    const PANE_LASTS_S: f64 = 6.0;
    const PANE_VARIES: f64 = 0.3;
    let mut random = Random::new(seed, 0, Purpose::RoverTag);
    let offset_s = random.uniform(-0.1, 0.1);
    let white_m = random.uniform(0.03, 0.07);
    let quick_m = random.uniform(0.02, 0.05);
    let gross = random.uniform(0.005, 0.03);
    let every_s = random.uniform(0.06, 0.12);
    let glass: Vec<f64> = world.anchors.iter().map(|_| random.uniform(0.08, 0.35)).collect();
    let mut quick = vec![0.0; world.anchors.len()];
    let mut pane = vec![0.0; world.anchors.len()];
    let mut out = Vec::new();
    let mut t_s = 0.2;
    while !world.anchors.is_empty() && t_s < world.duration_s() {
        let dt = every_s * random.uniform(0.5, 1.5);
        t_s += dt;
        let fade = (-dt / LASTS_S).exp();
        for value in &mut quick {
            *value = *value * fade + quick_m * (1.0 - fade * fade).sqrt() * random.normal();
        }
        let fade = (-dt / PANE_LASTS_S).exp();
        for value in &mut pane {
            *value = *value * fade + PANE_VARIES * (1.0 - fade * fade).sqrt() * random.normal();
        }
        let anchor = (random.uniform(0.0, world.anchors.len() as f64) as usize).min(world.anchors.len() - 1);
        let tag_n = world.tag_n(t_s);
        let there = &world.anchors[anchor];
        let true_m = tag_n.iter().zip(&there.p_n).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        let draws = [random.normal(), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0)];
        if true_m > HEARD_M {
            continue;
        }
        let mut range_m = true_m + there.bias_m + quick[anchor] + white_m * draws[0];
        if world.through_glass(&tag_n, &there.p_n) {
            range_m += glass[anchor] * (1.0 + pane[anchor]).max(0.0);
        }
        if draws[1] < gross {
            range_m +=
                if draws[2] < 0.8 { -3.0 * (1.0 - draws[2] / 0.8).max(1e-6).ln() } else { 267.0 * draws[2] };
        }
        out.push(Range { t_s: begin_s + t_s + offset_s, anchor, range_m });
    }
    (out, offset_s)
}

impl World {
    /// Whether the straight line passes the front of the hall beside the open door.
    fn through_glass(&self, tag_n: &[f64; 3], anchor_n: &[f64; 3]) -> bool {
        const DOOR_HALF_M: f64 = 1.0;
        if !matches!(self.scene, super::Scene::Doorway | super::Scene::Hall) {
            return false;
        }
        let (a, b) = (self.in_door(tag_n), self.in_door(anchor_n));
        if a[0] * b[0] >= 0.0 {
            return false;
        }
        let share = a[0] / (a[0] - b[0]);
        (a[1] + share * (b[1] - a[1])).abs() > DOOR_HALF_M
    }
}
