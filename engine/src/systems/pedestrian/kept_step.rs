//! A step as it is kept for a run to come: half its size, to the same bits.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::foot::Step;
use crate::replay::filter::Input;

/// A step and the number of its epoch. Readings are of single precision from the session's door on, so
/// nothing is lost; a reading that is missing is not a number.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct KeptStep {
    pub(crate) t_ns: i64,
    w_ib_b: [f32; 3],
    f_b: [f32; 3],
    mag_b_ut: [f32; 3],
    pressure_hpa: f32,
    zupt_sigma_m_s: f32,
    /// The epoch, above one bit each for a doubtful stance, the sensor, the stance, and whether it opens the epoch.
    epoch_and_flags: u32,
}

impl KeptStep {
    pub(crate) fn new(step: &Step, epoch: u64) -> Self {
        let single = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
        KeptStep {
            t_ns: step.t_ns,
            w_ib_b: single(&step.w_ib_b),
            f_b: single(&step.f_b),
            mag_b_ut: step.mag_b_ut.as_ref().map_or([f32::NAN; 3], single),
            pressure_hpa: step.pressure_hpa.map_or(f32::NAN, |hpa| hpa as f32),
            zupt_sigma_m_s: step.zupt_sigma_m_s as f32,
            epoch_and_flags: (epoch as u32) << 4
                | u32::from(step.doubtful) << 3
                | (step.sensor as u32) << 2
                | u32::from(step.stance) << 1
                | u32::from(step.opens_epoch),
        }
    }

    pub(crate) fn step(&self) -> Step {
        let double = |v: &[f32; 3]| Vector3::new(v[0].into(), v[1].into(), v[2].into());
        Step {
            sensor: self.sensor(),
            t_ns: self.t_ns,
            w_ib_b: double(&self.w_ib_b),
            f_b: double(&self.f_b),
            mag_b_ut: (!self.mag_b_ut[0].is_nan()).then(|| double(&self.mag_b_ut)),
            pressure_hpa: (!self.pressure_hpa.is_nan()).then(|| self.pressure_hpa.into()),
            stance: self.epoch_and_flags & 2 != 0,
            doubtful: self.epoch_and_flags & 8 != 0,
            zupt_sigma_m_s: self.zupt_sigma_m_s.into(),
            opens_epoch: self.opens_epoch(),
        }
    }

    /// The sensor's place in the joint state.
    pub(crate) fn sensor(&self) -> usize {
        (self.epoch_and_flags >> 2 & 1) as usize
    }
}

impl Input for KeptStep {
    const BYTES: usize = 56;

    fn t_ns(&self) -> i64 {
        self.t_ns
    }

    fn epoch(&self) -> u64 {
        u64::from(self.epoch_and_flags >> 4)
    }

    fn opens_epoch(&self) -> bool {
        self.epoch_and_flags & 1 != 0
    }

    fn write(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.t_ns.to_le_bytes());
        for vector in [&self.w_ib_b, &self.f_b, &self.mag_b_ut] {
            for value in vector {
                out.extend_from_slice(&value.to_le_bytes());
            }
        }
        out.extend_from_slice(&self.pressure_hpa.to_le_bytes());
        out.extend_from_slice(&self.zupt_sigma_m_s.to_le_bytes());
        out.extend_from_slice(&self.epoch_and_flags.to_le_bytes());
    }

    fn read(bytes: &[u8]) -> Self {
        let (t_ns, rest) = bytes.split_at(8);
        let mut words = rest.as_chunks::<4>().0.iter().copied();
        let mut word = || words.next().unwrap_or_default();
        let mut vector = || std::array::from_fn(|_| f32::from_le_bytes(word()));
        let (w_ib_b, f_b, mag_b_ut) = (vector(), vector(), vector());
        KeptStep {
            t_ns: i64::from_le_bytes(t_ns.try_into().unwrap_or_default()),
            w_ib_b,
            f_b,
            mag_b_ut,
            pressure_hpa: f32::from_le_bytes(word()),
            zupt_sigma_m_s: f32::from_le_bytes(word()),
            epoch_and_flags: u32::from_le_bytes(word()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_comes_back_to_the_bit() {
        let single = |x: f64| f64::from(x as f32);
        for (sensor, mag_b_ut, pressure_hpa) in [(0, None, Some(single(889.123))), (1, Some(1.0), None)] {
            let step = Step {
                sensor,
                t_ns: 1_234_567_890_123,
                w_ib_b: Vector3::new(0.1, -0.2, 1e-7).map(single),
                f_b: Vector3::new(9.787, 0.3, -150.0).map(single),
                mag_b_ut: mag_b_ut.map(|x| Vector3::new(x, 36.7, -31.2).map(single)),
                pressure_hpa,
                stance: sensor == 1,
                doubtful: sensor == 1,
                zupt_sigma_m_s: single(0.03),
                opens_epoch: sensor == 0,
            };
            let kept = KeptStep::new(&step, 2_880_000);
            assert_eq!(format!("{:?}", kept.step()), format!("{step:?}"));
            assert_eq!(kept.epoch(), 2_880_000);
            let mut bytes = Vec::new();
            kept.write(&mut bytes);
            let read = KeptStep::read(&bytes);
            assert_eq!(format!("{read:?}"), format!("{kept:?}"));
        }
        assert_eq!(size_of::<KeptStep>(), KeptStep::BYTES);
    }
}
