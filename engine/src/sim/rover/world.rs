//! A made site: where the base, the door and the anchors are, and the way that the rover takes. Truth comes first.

use super::Scene;
use crate::geo::Geodetic;
use crate::sim::random::{Purpose, Random};

/// Where the rover is, by what is around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Outdoor,
    Doorway,
    Indoor,
    Canopy,
}

impl Place {
    pub(super) fn word(self) -> &'static str {
        match self {
            Place::Outdoor => "outdoor",
            Place::Doorway => "doorway",
            Place::Indoor => "indoor",
            Place::Canopy => "canopy",
        }
    }
}

/// An anchor and what its ranges have too much, m.
#[derive(Clone, Debug)]
pub(super) struct Anchor {
    pub(super) name: String,
    pub(super) p_n: [f64; 3],
    pub(super) bias_m: f64,
}

/// The site and the way.
#[derive(Clone, Debug)]
pub(super) struct World {
    pub(super) scene: Scene,
    pub(super) base: Geodetic,
    /// From the base to the door, clockwise from north, rad; into the hall it goes on in this direction.
    pub(super) door_azimuth: f64,
    pub(super) door_distance_m: f64,
    pub(super) door_across_m: f64,
    /// How far before the door satellites begin to vanish, m.
    pub(super) doorway_m: f64,
    pub(super) anchors: Vec<Anchor>,
    /// UWB antenna less satellite antenna, m.
    pub(super) antenna_offset_m: [f64; 3],
    way: Vec<[f64; 3]>,
}

/// Steps of the way a second.
const STEPS: f64 = 50.0;

impl World {
    pub(super) fn draw(scene: Scene, seed: u64) -> World {
        let mut random = Random::new(seed, 0, Purpose::RoverWorld);
        let base = Geodetic {
            latitude_deg: random.uniform(22.0, 45.0),
            longitude_deg: random.uniform(90.0, 125.0),
            height_m: random.uniform(20.0, 400.0),
        };
        let door_azimuth = random.uniform(0.0, std::f64::consts::TAU);
        let mut world = World {
            scene,
            base,
            door_azimuth,
            door_distance_m: random.uniform(60.0, 100.0),
            door_across_m: random.uniform(-8.0, 8.0),
            doorway_m: random.uniform(7.0, 11.0),
            anchors: Vec::new(),
            antenna_offset_m: [0.0, 0.0, -random.uniform(0.1, 0.3)],
            way: Vec::new(),
        };
        let height = random.uniform(0.4, 1.6);
        world.hang_anchors(&mut random, height);
        world.go(&mut random, height);
        world
    }

    /// The frame of the door (into the hall, to its right, up) in e n u.
    fn in_n(&self, [into, right, up]: [f64; 3]) -> [f64; 3] {
        let (s, c) = self.door_azimuth.sin_cos();
        let along = self.door_distance_m + into;
        let across = self.door_across_m + right;
        [along * s + across * c, along * c - across * s, up]
    }

    /// The same backwards: how far into the hall, and how far to the right of the door, m.
    pub(super) fn in_door(&self, p_n: &[f64; 3]) -> [f64; 2] {
        let (s, c) = self.door_azimuth.sin_cos();
        [p_n[0] * s + p_n[1] * c - self.door_distance_m, p_n[0] * c - p_n[1] * s - self.door_across_m]
    }

    fn hang_anchors(&mut self, random: &mut Random, height: f64) {
        let places: &[[f64; 2]] = match self.scene {
            Scene::Open => return,
            Scene::Canopy => &[[-6.0, 6.0], [6.0, 5.0], [1.0, -9.0]],
            Scene::Doorway => &[[2.0, 7.0], [21.0, 1.0], [3.0, -8.0]],
            Scene::Hall => &[[2.0, 9.0], [24.0, 8.0], [22.0, -8.0], [1.0, -7.0]],
        };
        let common = random.uniform(0.12, 0.26);
        for (k, [into, right]) in places.iter().enumerate() {
            let place =
                [into + 1.5 * random.normal(), right + 1.0 * random.normal(), height + 0.3 * random.normal()];
            self.anchors.push(Anchor {
                name: format!("A{}", k + 1),
                p_n: self.in_n(place),
                bias_m: common + 0.06 * random.normal(),
            });
        }
    }

    /// Corners and rests, walked at one speed, rounded over two seconds, with the wobble of a trolley.
    fn go(&mut self, random: &mut Random, height: f64) {
        let mut way: Vec<[f64; 2]> = Vec::new();
        let rest = |way: &mut Vec<[f64; 2]>, at: [f64; 2], seconds: f64| {
            way.extend(std::iter::repeat_n(at, (seconds * STEPS) as usize));
        };
        let speed = random.uniform(0.7, 1.2);
        let corners: Vec<[f64; 2]> = match self.scene {
            Scene::Canopy => {
                let at = [random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)];
                rest(&mut way, at, 300.0);
                vec![at]
            }
            Scene::Open => {
                let at = |random: &mut Random| [random.uniform(-40.0, 10.0), random.uniform(-30.0, 30.0)];
                (0..7).map(|_| at(random)).collect()
            }
            Scene::Doorway | Scene::Hall => {
                let inside = |random: &mut Random| [random.uniform(6.0, 19.0), random.uniform(-6.0, 6.0)];
                let outside = |random: &mut Random| [random.uniform(-34.0, -24.0), random.uniform(-6.0, 6.0)];
                let (from, to) = (outside(random), outside(random));
                let hall = [inside(random), inside(random), inside(random), inside(random)];
                if self.scene == Scene::Hall {
                    [hall.to_vec(), vec![inside(random), inside(random), inside(random)]].concat()
                } else {
                    let mut corners = vec![from, [-12.0, 0.5], [0.0, 0.0], [4.0, 0.0]];
                    corners.extend(hall);
                    corners.extend([[4.0, 0.0], [0.0, 0.0], [-12.0, -0.5], to]);
                    corners
                }
            }
        };
        let pause = random.uniform(15.0, 25.0);
        rest(&mut way, corners[0], pause);
        for pair in corners.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let steps = (length / speed * STEPS).ceil().max(1.0);
            way.extend((1..=steps as usize).map(|k| {
                let share = k as f64 / steps;
                [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
            }));
            if random.uniform(0.0, 1.0) < 0.15 {
                rest(&mut way, b, random.uniform(2.0, 6.0));
            }
        }
        rest(&mut way, corners[corners.len() - 1], 10.0);
        let smooth = rounded(&way);
        let still = self.scene == Scene::Canopy;
        let phases: [f64; 4] = std::array::from_fn(|_| random.uniform(0.0, std::f64::consts::TAU));
        self.way = smooth
            .iter()
            .enumerate()
            .map(|(k, [into, right])| {
                let t = k as f64 / STEPS;
                let wobble = |frequency: f64, phase: f64| (frequency * t + phase).sin();
                let size = if still { 0.0 } else { 1.0 };
                let floor = if *into > 0.0 { 0.03 } else { 0.0 };
                self.in_n([
                    into + size * 0.006 * wobble(2.1, phases[0]),
                    right + size * 0.02 * wobble(0.7, phases[1]) + size * 0.01 * wobble(1.9, phases[2]),
                    height + floor + size * 0.006 * wobble(1.3, phases[3]),
                ])
            })
            .collect();
    }

    /// How long the way takes, s.
    pub(super) fn duration_s(&self) -> f64 {
        (self.way.len() - 1) as f64 / STEPS
    }

    /// The satellite antenna, m.
    pub(super) fn rover_n(&self, t_s: f64) -> [f64; 3] {
        let at = (t_s * STEPS).clamp(0.0, (self.way.len() - 1) as f64);
        let k = (at as usize).min(self.way.len() - 2);
        let share = at - k as f64;
        std::array::from_fn(|i| self.way[k][i] + share * (self.way[k + 1][i] - self.way[k][i]))
    }

    /// The UWB antenna, m.
    pub(super) fn tag_n(&self, t_s: f64) -> [f64; 3] {
        let p = self.rover_n(t_s);
        std::array::from_fn(|i| p[i] + self.antenna_offset_m[i])
    }

    pub(super) fn place(&self, t_s: f64) -> Place {
        if self.scene == Scene::Canopy {
            return Place::Canopy;
        }
        if self.scene == Scene::Open {
            return Place::Outdoor;
        }
        let into = self.in_door(&self.rover_n(t_s))[0];
        if into >= 0.0 {
            Place::Indoor
        } else if into > -self.doorway_m {
            Place::Doorway
        } else {
            Place::Outdoor
        }
    }
}

/// A moving mean over two seconds, twice: corners become turns and starts become gentle.
fn rounded(way: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let half = (0.5 * STEPS) as usize;
    let once = |way: &[[f64; 2]]| -> Vec<[f64; 2]> {
        let mut sums = vec![[0.0; 2]];
        for p in way {
            let last = sums[sums.len() - 1];
            sums.push([last[0] + p[0], last[1] + p[1]]);
        }
        (0..way.len())
            .map(|k| {
                let (from, to) = (k.saturating_sub(half), (k + half + 1).min(way.len()));
                let count = (to - from) as f64;
                std::array::from_fn(|i| (sums[to][i] - sums[from][i]) / count)
            })
            .collect()
    };
    once(&once(way))
}
