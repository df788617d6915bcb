//! A table that somebody mapped: any mapping, any table.

use lodestep_engine::parse::ReadOptions;
use lodestep_engine::parse::mapping::{
    Axes, Delimiter, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, Scalar, TimeSource, TimeUnit,
};

use crate::any_log;

/// Either a mapping in JSON, a zero byte and the table; or eight bytes that choose units and columns with
/// names of one letter, and the table.
pub(crate) fn run(bytes: &[u8]) {
    if bytes.first() == Some(&b'{') {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let Ok(reading) = serde_json::from_slice::<ReadOptions>(&bytes[..end]) else { return };
        let text = serde_json::to_string(&reading).expect("a reading that was read is written");
        assert_eq!(serde_json::from_str::<ReadOptions>(&text).ok().as_ref(), Some(&reading), "{text}");
        return any_log::check(&reading, bytes.get(end + 1..).unwrap_or_default(), 7);
    }
    let Some((choices, table)) = bytes.split_first_chunk::<8>() else { return };
    any_log::check(&chosen(choices), table, 1 + usize::from(choices[7]));
}

fn chosen([parted, time, rate, force, field, pressure, wraps, _]: &[u8; 8]) -> ReadOptions {
    let pick = |byte: &u8, of: usize| usize::from(*byte) % of;
    let axes = |names: [&str; 3]| names.map(str::to_owned);
    let units = [
        TimeUnit::S,
        TimeUnit::Ms,
        TimeUnit::Ticks10Khz,
        TimeUnit::Us,
        TimeUnit::Ns,
        TimeUnit::Samples,
        TimeUnit::DateTime,
        TimeUnit::Ticks,
        TimeUnit::Days,
    ];
    let fields = [FieldUnit::Ut, FieldUnit::Gauss, FieldUnit::Mgauss, FieldUnit::Counts, FieldUnit::Nt];
    let rates = [RateUnit::RadS, RateUnit::DegS, RateUnit::MdegS];
    let forces = [ForceUnit::MS2, ForceUnit::G, ForceUnit::Mg];
    let one_is = (force & 8 != 0).then_some(0.01);
    let mapping = Mapping {
        delimiter: Delimiter::ALL[pick(parted, 5)],
        time: TimeSource {
            column: (*time < 0x80).then(|| "t".to_owned()),
            unit: units[pick(time, units.len())],
            rate_hz: (rate & 2 != 0).then_some(200.0),
            wraps_at: [None, Some(1_000), Some(u64::from(u32::MAX)), Some(u64::MAX)][pick(wraps, 4)],
        },
        gyr: Axes { columns: axes(["a", "b", "c"]), unit: rates[pick(rate, 3)], one_is },
        acc: Axes { columns: axes(["d", "e", "f"]), unit: forces[pick(force, 3)], one_is },
        mag: (field & 4 != 0).then(|| Axes {
            columns: axes(["g", "h", "i"]),
            unit: fields[pick(field, 5)],
            one_is: None,
        }),
        pressure: (pressure & 4 != 0).then(|| Scalar {
            column: "p".to_owned(),
            unit: [PressureUnit::Hpa, PressureUnit::Pa, PressureUnit::Kpa, PressureUnit::Mmhg]
                [pick(pressure, 4)],
        }),
        skip_rows_without_inertial: force & 2 != 0,
    };
    ReadOptions {
        mapping: Some(mapping),
        field_ut_per_count: (field & 8 != 0).then_some(0.3),
        ..ReadOptions::default()
    }
}
