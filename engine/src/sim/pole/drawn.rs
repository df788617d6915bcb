//! A world that is drawn whole from its seed. The ranges are of data sheets and of field work.

use nalgebra::{Matrix3, Vector3};

use super::super::imu::ImuModel;
use super::super::random::{Purpose, Random};
use super::gnss::GnssModel;
use super::world::{Gait, Ground, MoreBias, Opening, PoleModel, World, mounting};

/// Draws a world.
pub(super) fn world(seed: u64) -> World {
    let usual = World::usual(seed);
    let mut draw = Draw(Random::new(seed, Random::COMMON, Purpose::PoleWorld));
    let pole = pole(&mut draw);
    let class = draw.even(0.0, 1.0);
    let imu = imu(&mut draw, class);
    let more = more(&mut draw, class);
    World {
        origin: usual.origin,
        pole,
        imu,
        more,
        gnss: gnss(&mut draw),
        gait: gait(&mut draw),
        ground: ground(&mut draw),
        opening: opening(&mut draw),
    }
}

/// Draws.
struct Draw(Random);

impl Draw {
    fn even(&mut self, from: f64, to: f64) -> f64 {
        self.0.uniform(from, to)
    }

    /// Evenly in the logarithm.
    fn times(&mut self, from: f64, to: f64) -> f64 {
        libm::exp(self.0.uniform(libm::log(from), libm::log(to)))
    }

    fn one_of(&mut self, of: &[f64]) -> f64 {
        of[(self.0.uniform(0.0, of.len() as f64) as usize).min(of.len() - 1)]
    }

    fn share(&mut self, of: f64) -> bool {
        self.0.uniform(0.0, 1.0) < of
    }

    fn normal_3(&mut self) -> Vector3<f64> {
        self.0.normal_3().into()
    }

    /// Of a class from the best (0) to the worst (1), with a sensor's own luck in each figure.
    fn of_class(&mut self, class: f64, best: f64, worst: f64) -> f64 {
        let at = (class + 0.2 * self.0.normal()).clamp(0.0, 1.0);
        best * libm::pow(worst / best, at)
    }

    /// A range about a middle, so much of it to both sides.
    fn about(&mut self, from: f64, to: f64, share: f64) -> [f64; 2] {
        let middle = self.even(from, to);
        [middle * (1.0 - share), middle * (1.0 + share)]
    }
}

/// Poles of 1.4 to 2.5 m, the sensor anywhere from near the tip to under the antenna, turned and tilted as its case is.
fn pole(draw: &mut Draw) -> PoleModel {
    let length_m = draw.even(1.4, 2.5);
    let tip_m = length_m * draw.even(0.15, 0.97);
    let mut aside = |most_m: f64| [draw.even(-most_m, most_m), draw.even(-most_m, most_m)];
    let ([ax, ay], [tx, ty]) = (aside(0.05), aside(0.06));
    let turned_rad = draw.even(0.0, std::f64::consts::TAU);
    // Level to some degrees, or on its side.
    let tilted_rad = match draw.share(0.7) {
        true => [draw.even(-0.1, 0.1), draw.even(-0.1, 0.1)],
        false => [draw.even(-1.6, 1.6), draw.even(-0.5, 0.5)],
    };
    // What rings swings more the farther it is from the ground.
    let farther = tip_m.min(1.2);
    let ring = draw.times(0.4, 1.6) * farther;
    PoleModel {
        antenna_m: Vector3::new(ax, ay, (length_m - tip_m).max(0.04)),
        tip_m: Vector3::new(tx, ty, -tip_m),
        c_bs: mounting(turned_rad, tilted_rad),
        measured_m: draw.even(0.001, 0.003),
        roundness_m: draw.even(0.0, 0.015),
        // 30 N across an aluminium tube of 32 mm on 2 m bend it by 4 mm, carbon by less.
        bend_m: [draw.even(0.0, 0.004) * farther, draw.even(0.0, 0.003) * farther],
        ring: [[0.03 * ring, 0.15 * ring], draw.about(6.0, 22.0, 0.3), draw.about(0.05, 0.2, 0.3)],
    }
}

/// From tactical MEMS (class 0) to a phone's chip (class 1): noise densities, turn-on biases, walks, and what a factory's
/// calibration leaves of scale and axes.
fn imu(draw: &mut Draw, class: f64) -> ImuModel {
    ImuModel {
        rate_hz: draw.one_of(&[50.0, 100.0, 125.0, 200.0, 250.0, 400.0]),
        averaging: true,
        gyro_noise_deg_s_rthz: draw.of_class(class, 0.001, 0.014),
        gyro_bias_deg_s: draw.of_class(class, 0.03, 1.0),
        gyro_bias_walk_deg_s_rts: draw.of_class(class, 5e-5, 1.5e-3),
        accel_noise_m_s2_rthz: draw.of_class(class, 2e-4, 2.5e-3),
        accel_bias_m_s2: draw.of_class(class, 0.01, 0.3),
        accel_bias_walk_m_s2_rts: draw.of_class(class, 1e-5, 4e-4),
        scale: draw.of_class(class, 2e-4, 3e-3),
        misalignment_rad: draw.of_class(class, 2e-4, 3e-3),
        gyro_range_deg_s: draw.one_of(&[500.0, 1000.0, 2000.0]),
        accel_range_g: draw.one_of(&[4.0, 8.0, 16.0]),
        sixteen_bits: true,
    }
}

/// Sensitivity to force 0.002 to 0.1 °/s/g; temperature 2·10⁻⁴ to 0.01 °/s/K and 0.02 to 0.5 mg/K, ten kelvins of warming up and as
/// many between sun and roof.
fn more(draw: &mut Draw, class: f64) -> MoreBias {
    let by_force = draw.of_class(class, 0.002, 0.1).to_radians() / 9.81;
    let (warms_k, roof_k) = (draw.even(0.0, 10.0), draw.even(-10.0, 10.0));
    let gyro_k = draw.normal_3() * draw.of_class(class, 2e-4, 0.01).to_radians();
    let force_k = draw.normal_3() * draw.of_class(class, 2e-4, 5e-3);
    MoreBias {
        walking: Vector3::from_fn(|_, _| draw.even(-1.0, 1.0)) * draw.of_class(class, 5e-5, 1.2e-3),
        by_force: Matrix3::from_columns(&[draw.normal_3(), draw.normal_3(), draw.normal_3()]) * by_force,
        warm: [gyro_k * warms_k, force_k * warms_k],
        roof: [gyro_k * roof_k, force_k * roof_k],
        warms_in_s: draw.times(60.0, 900.0),
    }
}

/// A receiver says 8 mm + 1 ppm, and means anything from half of it to twice.
fn gnss(draw: &mut Draw) -> GnssModel {
    let (white, slow) = (draw.times(0.002, 0.008), draw.times(0.003, 0.014));
    let (white_up, slow_up) = (draw.even(1.4, 2.2), draw.even(0.8, 1.8));
    let total = |white: f64, slow: f64| libm::sqrt(white * white + slow * slow);
    let (plan_m, up_m) = (total(white, slow), total(white * white_up, slow * slow_up));
    let (told, slow_time_s) = (draw.times(0.5, 2.0), draw.times(5.0, 300.0));
    let apart_s = match draw.share(0.5) {
        // By the pulse of each second, or by when the line came in.
        true => draw.even(-0.002, 0.002),
        false => draw.even(-0.05, 0.05),
    };
    GnssModel {
        rate_hz: draw.one_of(&[1.0, 2.0, 5.0, 10.0, 20.0]),
        white_m: [white, white, white * white_up],
        slow_m: [slow, slow, slow * slow_up],
        slow_time_s: [slow_time_s; 2],
        told_m: [plan_m * told, plan_m * told, up_m * told],
        phase_m: draw.times(0.004, 0.03),
        apart_s,
    }
}

/// From a stroll with short touches to a march with a stick.
fn gait(draw: &mut Draw) -> Gait {
    let lean = draw.times(0.6, 1.5);
    Gait {
        step_m: draw.about(1.2, 2.4, 0.08),
        ground_s: draw.about(0.55, 1.5, 0.2),
        air_s: draw.about(1.0, 2.4, 0.12),
        point_s: draw.about(5.0, 15.0, 0.15),
        lift_m: draw.even(0.05, 0.3),
        leans: [[0.08 * lean, 0.2 * lean], [0.1 * lean, 0.24 * lean]],
        turn_rad: draw.times(0.02, 0.3),
        tremble_rad: draw.times(0.001, 0.005),
    }
}

/// Concrete, gravel, lawn.
fn ground(draw: &mut Draw) -> Ground {
    Ground {
        slips: draw.even(0.05, 0.6),
        slip_m: [draw.times(0.001, 0.006), draw.times(0.0004, 0.002)],
        sink_m: draw.times(0.0002, 0.006),
        sinks_s: draw.even(0.1, 0.5),
    }
}

/// Long or short, thorough or weak.
fn opening(draw: &mut Draw) -> Opening {
    Opening {
        held_s: draw.even(2.5, 15.0),
        lasts_s: [draw.even(20.0, 100.0), draw.even(20.0, 80.0)],
        lean_rad: 0.11 * draw.times(0.35, 1.3),
        turn_rad: 0.15 * draw.times(0.3, 2.0),
        pace: draw.times(0.6, 1.5),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Route, Trouble, Worlds, simulate_in};
    use super::*;

    #[test]
    fn a_seed_draws_the_same_world_again_and_another_seed_another() {
        let short = |seed| simulate_in(Worlds::Drawn, Route::I(10.0), seed, Trouble::None);
        let (first, again, other) = (short(1), short(1), short(2));
        assert_eq!(first.imu[..500], again.imu[..500]);
        assert_eq!(first.gnss, again.gnss);
        assert!(first.antenna_b_m != other.antenna_b_m && first.gnss[0] != other.gnss[0]);
    }

    #[test]
    fn worlds_are_those_of_the_field() {
        let worlds: Vec<World> = (0..200).map(world).collect();
        let within = |of: &dyn Fn(&World) -> f64, from: f64, to: f64| {
            let (least, most) = worlds
                .iter()
                .map(of)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| (least.min(x), most.max(x)));
            assert!(least >= from && most <= to, "{least} {most}");
            // All of the range is drawn from.
            assert!(least < from + 0.3 * (to - from) && most > to - 0.3 * (to - from), "{least} {most}");
        };
        within(&|world| (world.pole.antenna_m - world.pole.tip_m).norm(), 1.4, 2.52);
        within(&|world| world.imu.rate_hz, 50.0, 400.0);
        within(&|world| world.gnss.rate_hz, 1.0, 20.0);
        within(&|world| world.gnss.apart_s, -0.05, 0.05);
        within(&|world| world.opening.lasts_s[0], 20.0, 100.0);
        within(&|world| world.imu.gyro_noise_deg_s_rthz, 0.001, 0.014);
        within(
            &|world| libm::log2(world.gnss.told_m[0] / world.gnss.white_m[0].hypot(world.gnss.slow_m[0])),
            -1.0,
            1.0,
        );
        assert!(worlds.iter().all(|world| (world.pole.c_bs.determinant() - 1.0).abs() < 1e-12));
    }
}
