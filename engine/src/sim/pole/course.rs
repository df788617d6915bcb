//! The way of a survey: where the tip lands and when, and where there is no sky.

use std::str::FromStr;

use nalgebra::Vector2;

use super::super::random::{Purpose, Random};
use super::trouble::Trouble;
use super::world::World;

/// A route with the length of its gap, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Route {
    /// Straight, with 10 m of sky before and after the gap.
    I(f64),
    /// Two equal legs with a right angle, without sky.
    L(f64),
    /// Three legs, without sky.
    U(f64),
    /// So far under the roof and the same way back, with 10 m of sky before and after; the point is where it turns.
    B(f64),
}

impl FromStr for Route {
    type Err = String;

    fn from_str(text: &str) -> Result<Route, String> {
        let wrong =
            || format!("expected a letter I, L, U or B and a length in metres such as I60, found {text:?}");
        let (letter, metres) = text.split_at_checked(1).ok_or_else(wrong)?;
        let metres: f64 = metres.parse().map_err(|_| wrong())?;
        if !(5.0..=500.0).contains(&metres) {
            return Err(format!("expected a length from 5 to 500 m, found {metres}"));
        }
        match letter {
            "I" => Ok(Route::I(metres)),
            "L" => Ok(Route::L(metres)),
            "U" => Ok(Route::U(metres)),
            "B" => Ok(Route::B(metres)),
            _ => Err(wrong()),
        }
    }
}

/// A stand of the tip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    pub(super) from_s: f64,
    pub(super) to_s: f64,
    /// Where, east, north and up of the route's start, m.
    pub(super) place_m: [f64; 3],
    /// How it moves while it stands: by how much in all, and from when on for how long, s.
    pub(super) slip_m: [f64; 3],
    pub(super) slips_s: [f64; 2],
    /// How far it sinks from the landing on, m, and for how long, s.
    pub(super) sunk_m: f64,
    pub(super) sinks_s: f64,
    /// The direction of walking there, rad from east to north.
    pub(super) direction_rad: f64,
}

/// A course.
#[derive(Clone, Debug)]
pub(super) struct Course {
    pub(super) stands: Vec<Stand>,
    /// Without sky, s.
    pub(super) gap_s: [f64; 2],
    /// The stand on the point.
    pub(super) target: usize,
}

impl Course {
    pub(super) fn draw(route: Route, world: &World, seed: u64, trouble: Trouble) -> Course {
        let (gait, ground, opening) = (&world.gait, &world.ground, &world.opening);
        let mut random = Random::new(seed, Random::COMMON, Purpose::Course);
        let mut sinking = Random::new(seed, 0, Purpose::Course);
        let heading_rad = random.uniform(0.0, std::f64::consts::TAU);
        let (legs, sky_m): (Vec<f64>, f64) = match route {
            Route::I(gap_m) => (vec![gap_m + 20.0], 10.0),
            Route::L(gap_m) => (vec![gap_m / 2.0; 2], 0.0),
            Route::U(gap_m) => (vec![0.36 * gap_m, 0.28 * gap_m, 0.36 * gap_m], 0.0),
            Route::B(far_m) => (vec![far_m + 10.0; 2], 10.0),
        };
        let corner_rad = match route {
            Route::B(_) => std::f64::consts::PI,
            Route::I(_) | Route::L(_) | Route::U(_) => std::f64::consts::FRAC_PI_2,
        };
        let whole_m: f64 = legs.iter().sum();
        let side = if random.uniform(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
        let at = |way_m: f64| {
            let mut place = Vector2::zeros();
            let mut left_m = way_m;
            let mut direction_rad = heading_rad;
            for (k, leg_m) in legs.iter().enumerate() {
                direction_rad = heading_rad + side * k as f64 * corner_rad;
                let (sin, cos) = libm::sincos(direction_rad);
                let here_m = left_m.min(*leg_m);
                place += Vector2::new(cos, sin) * here_m;
                left_m -= here_m;
                if left_m <= 0.0 {
                    break;
                }
            }
            (place, direction_rad)
        };
        // The target lies in the middle: an even number of equal steps.
        let steps =
            2 * (libm::round(whole_m / 2.0 / random.uniform(gait.step_m[0], gait.step_m[1])) as usize).max(1);
        let target = steps / 2;
        let mut stands = Vec::new();
        let mut t_s = 0.0;
        let mut up_m = 0.0;
        for step in 0..=steps {
            let lasts_s = match step {
                0 => opening.held_s + opening.lasts_s[0],
                _ if step == steps => opening.lasts_s[1] + 2.0,
                _ if step == target => random.uniform(gait.point_s[0], gait.point_s[1]),
                _ => random.uniform(gait.ground_s[0], gait.ground_s[1]),
            };
            let aside = if step == target { 0.0 } else { 0.06 };
            let (place, direction_rad) = at(whole_m * step as f64 / steps as f64);
            up_m += 0.03 * random.normal();
            let mut stand = Stand {
                from_s: t_s,
                to_s: t_s + lasts_s,
                place_m: [place.x + aside * random.normal(), place.y + aside * random.normal(), up_m],
                slip_m: [0.0; 3],
                slips_s: [t_s + 0.3 * lasts_s, 0.15],
                sunk_m: 0.0,
                sinks_s: ground.sinks_s.min(lasts_s),
                direction_rad,
            };
            let slips = random.uniform(0.0, 1.0) < ground.slips && step != target && step > 0 && step < steps;
            let [plan_m, down_m] = ground.slip_m;
            let by = [plan_m * random.normal(), plan_m * random.normal(), -down_m * random.normal().abs()];
            if slips {
                stand.slip_m = by;
            }
            // A point is something solid, and at both ends the pole stands already.
            if step != target && step > 0 && step < steps {
                stand.sunk_m = sinking.uniform(0.0, ground.sink_m);
            }
            t_s += lasts_s + random.uniform(gait.air_s[0], gait.air_s[1]);
            stands.push(stand);
        }
        let troubled = target / 2 + 1;
        let (sin, cos) = libm::sincos(stands[troubled].direction_rad + 1.0);
        match trouble {
            Trouble::Slip => stands[troubled].slip_m = [0.1 * cos, 0.1 * sin, 0.0],
            // The point is where the tip was put.
            Trouble::SlipOnPoint => stands[target].slip_m = [0.1 * cos, 0.1 * sin, 0.0],
            Trouble::MovingGround => {
                // From one lift-off to the landing after the next one: the tip meets the ground at its speed.
                let from_s = stands[troubled - 1].to_s;
                let lasts_s = stands[troubled + 1].from_s - from_s;
                let stand = &mut stands[troubled];
                let rolled_m = 0.35 * lasts_s;
                stand.slip_m = [rolled_m * cos, rolled_m * sin, 0.0];
                stand.slips_s = [from_s, lasts_s];
            }
            _ => {}
        }
        // The sky goes when so much of the way has been walked.
        let crossed_s = |way_m: f64| {
            let step = way_m / whole_m * steps as f64;
            let before = (step as usize).min(steps - 1);
            stands[before].to_s + (stands[before + 1].from_s - stands[before].to_s) * (step - before as f64)
        };
        let gap_s = [crossed_s(sky_m), crossed_s(whole_m - sky_m)];
        Course { stands, gap_s, target }
    }

    pub(super) fn end_s(&self) -> f64 {
        self.stands.last().map_or(0.0, |stand| stand.to_s)
    }
}
