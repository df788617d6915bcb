//! What the tables hold packed, raw samples and charts: read as it was written, refused where it is damaged.

use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::LEFT;
use lodestep_server::store::charts::{self, Series};
use lodestep_server::store::raw_chunks::{self, Samples};

use crate::samples;

/// The first byte says which; then a count of two bytes and the packed body, or values to pack.
pub(crate) fn run(bytes: &[u8]) {
    let [kind, low, high, body @ ..] = bytes else { return };
    let count = usize::from(u16::from_le_bytes([*low, *high]));
    // Counts of a damaged row may be anything at all.
    let claimed = if *kind & 8 != 0 { count << 48 | count } else { count };
    match kind % 4 {
        0 => {
            if let Ok(found) = raw_chunks::unpacked(i64::from(*kind >> 4), body, claimed as u64) {
                assert_eq!(found.len(), claimed);
            }
        }
        1 => {
            if let Ok((low, high)) = charts::unpacked(body, claimed as u64) {
                assert_eq!((low.len(), high.len()), (claimed, claimed));
            }
        }
        2 => samples_again(body),
        _ => cells_again(body),
    }
}

fn samples_again(body: &[u8]) {
    let samples: Vec<ImuSample> = body.as_chunks::<88>().0.iter().map(sample).collect();
    let batch =
        Samples { stream: LEFT, first_sequence: 0, sequences: 1, readings: Readings::Imu(samples.clone()) };
    let packed = raw_chunks::Packed::new(&batch).expect("samples can be packed");
    let again =
        raw_chunks::unpacked(2, packed.body(), samples.len() as u64).expect("what was packed is unpacked");
    let Readings::Imu(again) = again else { panic!("samples were packed") };
    samples::assert_same(&samples, &again);
}

fn sample(bytes: &[u8; 88]) -> ImuSample {
    let words = bytes.as_chunks::<8>().0;
    let value = |at: usize| f64::from_le_bytes(words[at]);
    let three = |at: usize| [value(at), value(at + 1), value(at + 2)];
    let mag = three(7);
    ImuSample {
        t_ns: i64::from_le_bytes(words[0]),
        w_ib_b_rad_s: three(1),
        f_b_m_s2: three(4),
        mag_b_ut: (!mag.iter().all(|axis| axis.is_nan())).then_some(mag),
        pressure_hpa: Some(value(10)).filter(|pressure| !pressure.is_nan()),
    }
}

fn cells_again(body: &[u8]) {
    let values: Vec<f32> = body.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let (low, high) = values.split_at(values.len() / 2);
    let series = Series {
        chart: "speed".to_owned(),
        name: "left".to_owned(),
        cell_ns: 1,
        first_cell: 0,
        low: low.to_vec(),
        high: high[..low.len()].to_vec(),
    };
    let packed = charts::Packed::new(&series).expect("cells can be packed");
    let (low, high) =
        charts::unpacked(packed.body(), series.low.len() as u64).expect("what was packed is unpacked");
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!((bits(&low), bits(&high)), (bits(&series.low), bits(&series.high)));
}
