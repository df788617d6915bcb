//! How the pole moves: its tip from stand to stand, its lean, and how it is turned.

use nalgebra::Vector3;

use super::super::jet::Jet;
use super::super::jet_rotation::JetRotation;
use super::super::motion::{Kinematics, Motion};
use super::super::random::{Purpose, Random};
use super::course::{Course, Stand};
use super::world::World;

/// A sine: amplitude, rad; rate, rad/s; phase, rad.
type Wave = [f64; 3];

/// The motion of the sensor on the pole.
#[derive(Clone, Debug)]
pub(super) struct PoleMotion {
    course: Course,
    /// From the sensor to the tip, in b, m.
    tip_b_m: Vector3<f64>,
    /// How far the tip rolls as the pole leans by one, m.
    roundness_m: f64,
    /// How far the sensor is bent aside, m: as the pole leans by a fifth, and by the push of a step.
    bend_m: [f64; 2],
    /// How high the tip is lifted, m.
    lift_m: f64,
    /// Held at the start, s, and leaned until then.
    opening_s: [f64; 2],
    /// Lean to the front at the end of each stand, and to the back at its start, rad.
    leans: Vec<[f64; 2]>,
    /// Angle of the x axis at each stand, rad from east to north.
    turns: Vec<f64>,
    /// The manoeuvre's about north and east, and what it turns by.
    manoeuvre: [Vec<Wave>; 3],
    manoeuvre_is_done: bool,
    tremble: [Vec<Wave>; 2],
    rings: Vec<Ring>,
}

/// How the pole rings when it strikes the ground: the sensor swings across it while the tip stands.
#[derive(Clone, Copy, Debug)]
struct Ring {
    /// From east to north, rad.
    direction_rad: f64,
    /// Velocity at the strike, m/s.
    speed_m_s: f64,
    rate_rad_s: f64,
    /// It decays by e in so long, s.
    decay_s: f64,
}

/// The blow itself lasts so long, s.
pub(super) const BLOW_S: f64 = 0.015;
/// A load comes and goes in this time, s.
const LOADED_S: f64 = 0.2;

impl PoleMotion {
    pub(super) fn new(course: Course, world: &World, seed: u64, leaned: bool) -> PoleMotion {
        let (pole, gait, opening) = (&world.pole, &world.gait, &world.opening);
        let [landing, lifting] = gait.leans;
        let mut random = Random::new(seed, Random::COMMON, Purpose::Gait);
        let leans = course
            .stands
            .iter()
            .map(|_| [random.uniform(landing[0], landing[1]), random.uniform(lifting[0], lifting[1])])
            .collect();
        let held_rad = random.uniform(0.0, std::f64::consts::TAU);
        let turns = course
            .stands
            .iter()
            .map(|stand| held_rad + stand.direction_rad + gait.turn_rad * random.normal())
            .collect();
        let mut waves = |count: usize, amplitude: f64, hz: [f64; 2]| -> Vec<Wave> {
            (0..count)
                .map(|_| {
                    let rate = std::f64::consts::TAU * random.uniform(hz[0], hz[1]);
                    [amplitude * random.uniform(0.6, 1.4), rate, random.uniform(0.0, std::f64::consts::TAU)]
                })
                .collect()
        };
        let (lean_rad, turn_rad) = (opening.lean_rad, opening.turn_rad);
        let [leans_hz, turns_hz] =
            [[0.08, 0.45], [0.02, 0.12]].map(|hz: [f64; 2]| hz.map(|hz| hz * opening.pace));
        let manoeuvre =
            [waves(3, lean_rad, leans_hz), waves(3, lean_rad, leans_hz), waves(2, turn_rad, turns_hz)];
        let tremble = [waves(3, gait.tremble_rad, [0.8, 4.0]), waves(3, gait.tremble_rad, [0.8, 4.0])];
        let [speed_m_s, hz, decay_s] = pole.ring;
        let mut random = Random::new(seed, 1, Purpose::Gait);
        let rings = course
            .stands
            .iter()
            .map(|stand| Ring {
                direction_rad: stand.direction_rad + 0.3 * random.normal(),
                speed_m_s: random.uniform(speed_m_s[0], speed_m_s[1]),
                rate_rad_s: std::f64::consts::TAU * random.uniform(hz[0], hz[1]),
                decay_s: random.uniform(decay_s[0], decay_s[1]),
            })
            .collect();
        PoleMotion {
            course,
            tip_b_m: pole.tip_m,
            roundness_m: pole.roundness_m,
            bend_m: pole.bend_m,
            lift_m: gait.lift_m,
            opening_s: [opening.held_s, opening.held_s + opening.lasts_s[0] - 1.0],
            leans,
            turns,
            manoeuvre,
            manoeuvre_is_done: leaned,
            tremble,
            rings,
        }
    }

    /// Whether the tip stands, and since when.
    pub(super) fn stands(&self, t_s: f64) -> Option<&Stand> {
        self.course.stands.iter().find(|stand| (stand.from_s..stand.to_s).contains(&t_s))
    }

    /// East and north of the unit vector up the pole.
    pub(super) fn lean(&self, t_s: f64) -> [f64; 2] {
        let up = self.attitude(t_s).matrix().column(2).into_owned();
        [up.x, up.y]
    }

    /// The tip's true place, m.
    pub(super) fn tip_m(&self, t_s: f64) -> Vector3<f64> {
        Vector3::from(self.tip(t_s, &self.attitude(t_s)).map(|jet| jet.value))
    }

    fn attitude(&self, t_s: f64) -> JetRotation {
        let stands = &self.course.stands;
        let next = stands.partition_point(|stand| stand.from_s <= t_s);
        let now = next.max(1) - 1;
        let (stand, leans) = (&stands[now], self.leans[now]);
        let along = |direction_rad: f64, lean: Jet| {
            let (sin, cos) = libm::sincos(direction_rad);
            [lean * cos, lean * sin]
        };
        let last = stands.len() - 1;
        let ([mut east, mut north], mut turn) = if t_s < stand.to_s || now == last {
            let progress = Jet::progress(t_s, stand.from_s, stand.to_s).ramp();
            let from = if now == 0 { 0.0 } else { -leans[0] };
            let to = if now == last { 0.0 } else { leans[1] };
            let lean = if now == 0 {
                Jet::progress(t_s, stand.to_s - 1.0, stand.to_s).ramp() * to
            } else if now == last {
                Jet::constant(from) + Jet::progress(t_s, stand.from_s, stand.from_s + 1.0).ramp() * -from
            } else {
                Jet::constant(from) + progress * (to - from)
            };
            (along(stand.direction_rad, lean), Jet::constant(self.turns[now]))
        } else {
            let after = &stands[next];
            let progress = Jet::progress(t_s, stand.to_s, after.from_s).ramp();
            let [e0, n0] = along(stand.direction_rad, Jet::constant(leans[1]));
            let [e1, n1] = along(after.direction_rad, Jet::constant(-self.leans[next][0]));
            let mix = |a: Jet, b: Jet| a + progress * (b.value - a.value);
            let turn = Jet::constant(self.turns[now]) + progress * (self.turns[next] - self.turns[now]);
            ([mix(e0, e1), mix(n0, n1)], turn)
        };
        let mut manoeuvres = vec![(stands[last].from_s + 1.0, stands[last].to_s)];
        if self.manoeuvre_is_done {
            manoeuvres.push((self.opening_s[0], self.opening_s[1]));
        }
        for (from_s, to_s) in manoeuvres {
            if !(from_s..to_s).contains(&t_s) {
                continue;
            }
            let rising = Jet::progress(t_s, from_s, from_s + 2.0).ramp();
            let falling = Jet::progress(t_s, to_s, to_s - 2.0).ramp();
            let share = rising * falling;
            east = east + share * sum(&self.manoeuvre[0], t_s);
            north = north + share * sum(&self.manoeuvre[1], t_s);
            turn = turn + share * sum(&self.manoeuvre[2], t_s);
        }
        east = east + sum(&self.tremble[0], t_s);
        north = north + sum(&self.tremble[1], t_s);
        // Leaning east turns about north, leaning north against east.
        JetRotation::about_x(north * -1.0) * JetRotation::about_y(east) * JetRotation::about_z(turn)
    }

    fn tip(&self, t_s: f64, attitude: &JetRotation) -> [Jet; 3] {
        let stands = &self.course.stands;
        let next = stands.partition_point(|stand| stand.from_s <= t_s);
        let now = next.max(1) - 1;
        let stand = &stands[now];
        let slipped = |stand: &Stand, t_s: f64| {
            let progress = Jet::progress(t_s, stand.slips_s[0], stand.slips_s[0] + stand.slips_s[1]);
            // What rolls all the time moves evenly, what slips begins and ends.
            let share = if stand.slips_s[1] > stand.to_s - stand.from_s { progress } else { progress.ramp() };
            let at = |axis: usize| Jet::constant(stand.place_m[axis]) + share * stand.slip_m[axis];
            let sunk = Jet::progress(t_s, stand.from_s, stand.from_s + stand.sinks_s).ramp() * stand.sunk_m;
            [at(0), at(1), at(2) - sunk]
        };
        let touch = if t_s < stand.to_s || next >= stands.len() {
            slipped(stand, t_s)
        } else {
            let after = &stands[next];
            let progress = Jet::progress(t_s, stand.to_s, after.from_s);
            // Both as they move: the tip leaves and meets the ground at the ground's own speed.
            let (from, to) = (slipped(stand, t_s), slipped(after, t_s));
            let ramp = progress.ramp();
            let at = |axis: usize| from[axis] + (to[axis] - from[axis]) * ramp;
            [at(0), at(1), at(2) + progress.bump() * self.lift_m]
        };
        let up = attitude.turn([Jet::constant(0.0), Jet::constant(0.0), Jet::constant(1.0)]);
        [touch[0] + up[0] * self.roundness_m, touch[1] + up[1] * self.roundness_m, touch[2]]
    }
}

impl PoleMotion {
    /// What ringing moves the sensor by, across the pole, m.
    fn rung(&self, t_s: f64) -> [Jet; 3] {
        let still = [Jet::constant(0.0); 3];
        let next = self.course.stands.partition_point(|stand| stand.from_s <= t_s);
        // At the very start the pole stands already.
        let Some(now) = next.checked_sub(1).filter(|now| *now > 0) else { return still };
        let ring = self.rings[now];
        let since_s = t_s - self.course.stands[now].from_s;
        if since_s > 12.0 * ring.decay_s {
            return still;
        }
        let left = libm::exp(-since_s / ring.decay_s);
        let decay = Jet {
            value: left,
            rate: -left / ring.decay_s,
            acceleration: left / (ring.decay_s * ring.decay_s),
        };
        let (swing, _) = (Jet::time(since_s) * ring.rate_rad_s).sin_cos();
        let blow = Jet::progress(since_s, 0.0, BLOW_S).ramp();
        let rung = blow * decay * swing * (ring.speed_m_s / ring.rate_rad_s);
        let (sin, cos) = libm::sincos(ring.direction_rad);
        [rung * cos, rung * sin, Jet::constant(0.0)]
    }
}

impl PoleMotion {
    /// What the load on a standing pole bends the sensor aside by, m: towards where it leans, and by the push of a step
    /// forward. The sensor's attitude is what it is: it is the tip that is not at the end of its arm.
    fn bent(&self, t_s: f64) -> [Jet; 3] {
        let still = [Jet::constant(0.0); 3];
        let [by_lean_m, by_push_m] = self.bend_m;
        let Some(stand) = self.stands(t_s).filter(|_| self.bend_m != [0.0; 2]) else { return still };
        let up = self.attitude(t_s).turn([Jet::constant(0.0), Jet::constant(0.0), Jet::constant(1.0)]);
        let loaded = Jet::progress(t_s, stand.from_s, stand.from_s + LOADED_S).ramp();
        let unloaded = Jet::progress(t_s, stand.to_s, stand.to_s - LOADED_S).ramp();
        let load = if stand.from_s == 0.0 { unloaded } else { loaded * unloaded };
        let (sin, cos) = libm::sincos(stand.direction_rad);
        let pushed = Jet::progress(t_s, stand.from_s, stand.to_s).bump() * by_push_m;
        let leaned = load * (by_lean_m / 0.2);
        [up[0] * leaned + pushed * cos, up[1] * leaned + pushed * sin, Jet::constant(0.0)]
    }
}

impl Motion for PoleMotion {
    fn at(&self, t_s: f64) -> Kinematics {
        let attitude = self.attitude(t_s);
        let stiff = Kinematics::from_jets(self.tip(t_s, &attitude), &attitude).at_lever_arm(&-self.tip_b_m);
        let (rung, bent) = (self.rung(t_s), self.bent(t_s));
        let rung = [0, 1, 2].map(|axis: usize| rung[axis] + bent[axis]);
        Kinematics {
            position_n_m: stiff.position_n_m + Vector3::from(rung.map(|jet| jet.value)),
            velocity_n_m_s: stiff.velocity_n_m_s + Vector3::from(rung.map(|jet| jet.rate)),
            acceleration_n_m_s2: stiff.acceleration_n_m_s2 + Vector3::from(rung.map(|jet| jet.acceleration)),
            ..stiff
        }
    }

    fn end_s(&self) -> f64 {
        self.course.end_s()
    }
}

fn sum(waves: &[Wave], t_s: f64) -> Jet {
    waves.iter().fold(Jet::constant(0.0), |sum, [amplitude, rate, phase]| {
        let angle = Jet { value: rate * t_s + phase, rate: *rate, acceleration: 0.0 };
        sum + angle.sin_cos().0 * *amplitude
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Trouble, Worlds};
    use super::*;
    use crate::sim::motion::tests::largest_inconsistency;

    fn motion(worlds: Worlds, trouble: Trouble, seed: u64) -> PoleMotion {
        let world = World::of(worlds, seed);
        let course = Course::draw("I40".parse().unwrap(), &world, seed, trouble);
        PoleMotion::new(course, &world, seed, true)
    }

    #[test]
    fn the_velocity_never_jumps_whatever_the_tip_lands_on() {
        for (worlds, trouble) in [
            (Worlds::Usual, Trouble::None),
            (Worlds::Usual, Trouble::Slip),
            (Worlds::Usual, Trouble::MovingGround),
            (Worlds::Drawn, Trouble::None),
        ] {
            for seed in 0..3 {
                let motion = motion(worlds, trouble, seed);
                for stand in &motion.course.stands {
                    for t_s in
                        [stand.from_s, stand.to_s, stand.slips_s[0], stand.slips_s[0] + stand.slips_s[1]]
                    {
                        let [before, after] =
                            [t_s - 1e-6, t_s + 1e-6].map(|t_s| motion.at(t_s).velocity_n_m_s);
                        assert!(
                            (after - before).norm() < 1e-3,
                            "{trouble:?}, seed {seed}, {t_s} s: {before} {after}"
                        );
                    }
                    let t_s = 0.5 * (stand.from_s + stand.to_s) + 0.01;
                    let off = largest_inconsistency(|t_s| motion.at(t_s), t_s);
                    assert!(off < 1e-4, "{trouble:?}, seed {seed}, {t_s} s: {off}");
                }
            }
        }
    }

    #[test]
    fn ground_that_moves_takes_the_tip_along_for_a_whole_landing() {
        let motion = motion(Worlds::Usual, Trouble::MovingGround, 0);
        let moving = motion.course.stands.iter().filter(|stand| {
            let speed_m_s = (motion.tip_m(stand.to_s - 0.01) - motion.tip_m(stand.from_s + 0.01)).norm()
                / (stand.to_s - stand.from_s - 0.02);
            (speed_m_s - 0.35).abs() < 0.01
        });
        assert_eq!(moving.count(), 1);
    }
}
