//! Logs in other units than is said of them: found out by what every walk has, gravity, the Earth's field, the pressure of the
//! air and the swings of a foot.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::mapping::{Axes, Factor, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, Scalar};
use crate::sample::ImuSample;

/// Above the range of every foot sensor: ±2000 °/s are 34.9 rad/s.
const MOST_RATE_RAD_S: f64 = 40.0;
/// No sensor's range is larger in deg/s: numbers beyond are of a smaller unit, or counts.
const MOST_RATE_DEG_S: f64 = 4_500.0;
/// A foot stands for half of its walk and more: the middle of all lengths of the force is then near gravity, m/s².
const LIKE_GRAVITY_M_S2: std::ops::RangeInclusive<f64> = 5.5..=18.0;
/// The middle of all lengths of a linear acceleration, which lacks gravity, is less, m/s²; a sensor that says nothing has 0.
const LINEAR_M_S2: std::ops::RangeInclusive<f64> = 0.004..=0.6;
/// A force that differs from gravity by so much belongs to a foot in motion, m/s² …
const MOVING_M_S2: f64 = 3.0;
/// … unless no foot is pushed so hard, m/s².
const MOST_MOVING_M_S2: f64 = 60.0;
/// A foot that walks turns faster than this in every step, rad/s.
const SLOWEST_STEP_RAD_S: f64 = 0.35;
/// The field at a foot, with the iron of floors and shoes, µT.
const LIKE_FIELD_UT: std::ops::RangeInclusive<f64> = 8.0..=200.0;
/// The pressure of the air where people walk, hPa.
const LIKE_AIR_HPA: std::ops::RangeInclusive<f64> = 300.0..=1_200.0;
/// Fewer rows in motion than these are no ground for a verdict on what is slow.
const FEWEST_MOVING: u64 = 200;
/// Fewer rows than these are no ground for a verdict.
const FEWEST_ROWS: u64 = 50;
/// After so many rows the verdict need not wait for the end of the file.
const EARLY_ROWS: u64 = 20_000;
/// One reading of field and pressure in so many is looked at …
const LOOKED_AT: u64 = 8;
/// … and no more than these.
const MOST_LOOKED_AT: usize = 256;

/// What was said of the units: decides which mistakes are possible and what helps against them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Said {
    /// The file is the canonical log, whose columns name their units.
    canonical: bool,
    rate: RateUnit,
    /// What the numbers of the file were multiplied by: rate, force, field, pressure.
    factors: [f64; 4],
}

impl Said {
    /// Of the canonical log.
    pub(super) const CANONICAL: Said = Said { canonical: true, rate: RateUnit::RadS, factors: [1.0; 4] };

    /// Of a table that is read so.
    pub(super) fn by(mapping: &Mapping, canonical: bool) -> Said {
        fn of<U: Factor>(axes: &Axes<U>) -> f64 {
            axes.unit.factor() * axes.one_is.unwrap_or(1.0)
        }
        let pressure = |scalar: &Scalar<PressureUnit>| scalar.unit.factor();
        Said {
            canonical,
            rate: mapping.gyr.unit,
            factors: [
                of(&mapping.gyr),
                of(&mapping.acc),
                // How much a count is somebody has said for just this sensor.
                mapping.mag.as_ref().filter(|mag| mag.unit != FieldUnit::Counts).map_or(0.0, of),
                mapping.pressure.as_ref().map_or(1.0, pressure),
            ],
        }
    }
}

/// Counts the values that look like other units.
#[derive(Clone, Debug)]
pub(super) struct UnitsCheck {
    said: Said,
    rows: u64,
    too_fast: u64,
    fastest_rad_s: f64,
    forces: Lengths,
    fields: Picked,
    pressures: Picked,
}

/// How often a length was as long as this, eight steps to the double.
#[derive(Clone, Debug)]
struct Lengths {
    bins: Vec<u64>,
}

impl Lengths {
    const STEPS: usize = 256;
    /// 2⁻⁸, and three bits of the mantissa.
    const LEAST: u64 = (1023 - 8) << 3;

    #[inline]
    fn take(&mut self, length: f64) {
        let step = ((length.to_bits() >> 49).saturating_sub(Lengths::LEAST) as usize).min(Lengths::STEPS - 1);
        self.bins[step] += 1;
    }

    /// The middle of a step.
    fn at(step: usize) -> f64 {
        let edge = |step: u64| f64::from_bits((step + Lengths::LEAST) << 49);
        0.5 * (edge(step as u64) + edge(step as u64 + 1))
    }

    /// The length in the middle of all.
    fn median(&self) -> f64 {
        let half = self.bins.iter().sum::<u64>() / 2;
        let mut below = 0;
        let middle = self.bins.iter().position(|count| {
            below += count;
            below > half
        });
        match middle {
            None | Some(0) => 0.0,
            Some(step) => Lengths::at(step),
        }
    }

    /// How many lie outside of one range and within another.
    fn count(&self, holds: impl Fn(f64) -> bool) -> u64 {
        (0..Lengths::STEPS).filter(|step| holds(Lengths::at(*step))).map(|step| self.bins[step]).sum()
    }
}

/// Some of many values.
#[derive(Clone, Debug, Default)]
struct Picked {
    seen: u64,
    values: Vec<f64>,
}

impl Picked {
    #[inline]
    fn take(&mut self, value: impl FnOnce() -> f64) {
        self.seen += 1;
        if self.seen.is_multiple_of(LOOKED_AT) && self.values.len() < MOST_LOOKED_AT {
            self.values.push(value());
        }
    }

    fn median(&self) -> Option<f64> {
        let mut values: Vec<f64> = self.values.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        (values.len() >= 4).then(|| values[values.len() / 2])
    }
}

impl UnitsCheck {
    pub(super) fn new(said: Said) -> UnitsCheck {
        UnitsCheck {
            said,
            rows: 0,
            too_fast: 0,
            fastest_rad_s: 0.0,
            forces: Lengths { bins: vec![0; Lengths::STEPS] },
            fields: Picked::default(),
            pressures: Picked::default(),
        }
    }

    pub(super) fn take(&mut self, sample: &ImuSample) -> Result<(), ParseError> {
        self.rows += 1;
        let [x, y, z] = sample.w_ib_b_rad_s.map(f64::abs);
        let fastest = x.max(y).max(z);
        if fastest.is_finite() {
            self.too_fast += u64::from(fastest > MOST_RATE_RAD_S);
            self.fastest_rad_s = self.fastest_rad_s.max(fastest);
        }
        let length = length(sample.f_b_m_s2);
        if length.is_finite() {
            self.forces.take(length);
        }
        if let Some(field) = sample.mag_b_ut {
            self.fields.take(|| self::length(field));
        }
        if let Some(pressure_hpa) = sample.pressure_hpa {
            self.pressures.take(|| pressure_hpa);
        }
        if self.rows == EARLY_ROWS { self.finish() } else { Ok(()) }
    }

    pub(super) fn finish(&self) -> Result<(), ParseError> {
        if self.rows < FEWEST_ROWS {
            return Ok(());
        }
        self.rates().and_then(|()| self.force()).and_then(|()| self.field()).and_then(|()| self.pressure())
    }

    fn rates(&self) -> Result<(), ParseError> {
        let factor = self.said.factors[0];
        let raw = self.fastest_rad_s / factor.abs();
        let wrong = |kind, found: String, advice: String| {
            let expected = match self.said.rate {
                RateUnit::RadS => "angular rates in rad/s, at most 34.9 (±2000 °/s)",
                RateUnit::DegS => "angular rates in deg/s, of some hundreds in every step",
                RateUnit::MdegS => "angular rates in thousandths of a degree per second",
            };
            let columns = if self.said.canonical {
                "gyr_x_rad_s, gyr_y_rad_s, gyr_z_rad_s"
            } else {
                "the angular rate"
            };
            Err(ParseError::new(kind, expected, found, advice).in_column(columns))
        };
        // A few wild values are a sensor's trouble; one row in fifty is a unit's.
        if self.too_fast * 50 > self.rows {
            let most = MOST_RATE_RAD_S / factor.abs();
            let beyond =
                format!("more than {most:.0} in {} of {} rows, up to {raw:.1}", self.too_fast, self.rows);
            if self.said.rate == RateUnit::RadS && raw <= MOST_RATE_DEG_S {
                let advice = match self.said.canonical {
                    true => "multiply the three gyr columns by π/180, or map them with deg/s as their unit",
                    false => "choose deg/s as the unit of the angular rate",
                };
                let found = format!("{beyond}: these look like degrees per second");
                return wrong(ParseErrorKind::DegreesNotRadians, found, advice.to_owned());
            }
            let found = format!("{beyond}: these look like counts, or thousandths of a degree per second");
            let advice = "choose mdeg/s as the unit of the angular rate, or say by one_is in the mapping how many deg/s a count is (1/16.4 for ±2000 °/s in 16 bits)";
            return wrong(ParseErrorKind::OtherUnit, found, advice.to_owned());
        }
        let moving = self
            .forces
            .count(|length| (length - 9.8).abs() > MOVING_M_S2 && length < MOST_MOVING_M_S2 && length > 0.01);
        if self.said.rate != RateUnit::RadS
            && moving >= FEWEST_MOVING
            && self.fastest_rad_s < SLOWEST_STEP_RAD_S
            && LIKE_GRAVITY_M_S2.contains(&self.forces.median())
        {
            let found = format!(
                "at most {raw:.1} in {} rows, in {moving} of which the sensor is in motion: these look like radians per second",
                self.rows
            );
            let advice = "choose rad/s as the unit of the angular rate";
            return wrong(ParseErrorKind::RadiansNotDegrees, found, advice.to_owned());
        }
        Ok(())
    }

    fn force(&self) -> Result<(), ParseError> {
        let median_m_s2 = self.forces.median();
        if LIKE_GRAVITY_M_S2.contains(&median_m_s2) {
            return Ok(());
        }
        let factor = self.said.factors[1];
        let raw = median_m_s2 / factor.abs();
        let expected = if factor == 1.0 {
            "specific force in m/s², about 9.8 long at rest".to_owned()
        } else {
            format!("specific force about {:.4} long at rest, as was said of its unit", 9.8 / factor.abs())
        };
        let unit = Looks::of_gravity(raw);
        let canonical = self.said.canonical;
        let (kind, looks_like, advice) = match unit {
            Some(Looks::G) => (
                ParseErrorKind::GNotMetres,
                "multiples of g".to_owned(),
                if canonical {
                    "multiply the three acc columns by 9.80665, or map them with g as their unit".to_owned()
                } else {
                    "choose g as the unit of the specific force, or the columns that include gravity"
                        .to_owned()
                },
            ),
            Some(Looks::Metres) => (
                ParseErrorKind::MetresNotG,
                "metres per second squared".to_owned(),
                "choose m/s² as the unit of the specific force".to_owned(),
            ),
            Some(Looks::Mg) => (
                ParseErrorKind::OtherUnit,
                "thousandths of g (mg)".to_owned(),
                if canonical {
                    "multiply the three acc columns by 0.00980665, or map them with mg as their unit"
                        .to_owned()
                } else {
                    "choose mg as the unit of the specific force".to_owned()
                },
            ),
            Some(Looks::Counts(counts)) => (
                ParseErrorKind::OtherUnit,
                format!("counts of the sensor, {counts} for g"),
                format!(
                    "map the columns with g as the unit of the specific force and one_is {} (1/{counts}), and say how many deg/s a count of the angular rate is",
                    1.0 / f64::from(counts)
                ),
            ),
            None if LINEAR_M_S2.contains(&median_m_s2) && factor == 1.0 => (
                ParseErrorKind::OtherUnit,
                "linear acceleration, which lacks gravity".to_owned(),
                "take the columns that include gravity (total acceleration), or export them".to_owned(),
            ),
            // In no unit: the sensor may be broken, which the walk tells.
            None => return Ok(()),
        };
        let shown = if raw < 10.0 { format!("{raw:.2}") } else { format!("{raw:.0}") };
        let found = format!(
            "a length of about {shown} in the middle of {} rows: these look like {looks_like}",
            self.rows
        );
        let columns = if canonical { "acc_x_m_s2, acc_y_m_s2, acc_z_m_s2" } else { "the specific force" };
        Err(ParseError::new(kind, expected, found, advice).in_column(columns))
    }

    fn field(&self) -> Result<(), ParseError> {
        let factor = self.said.factors[2].abs();
        let Some(median_ut) = self.fields.median().filter(|_| factor > 0.0) else { return Ok(()) };
        if LIKE_FIELD_UT.contains(&median_ut) {
            return Ok(());
        }
        let raw = median_ut / factor;
        let (looks_like, unit, times) = match raw {
            ut if (15.0..100.0).contains(&ut) => ("microtesla", "µT", 1.0),
            gauss if (0.15..0.85).contains(&gauss) => ("gauss", "gauss", 100.0),
            mgauss if (150.0..850.0).contains(&mgauss) => ("milligauss", "mgauss", 0.1),
            nt if (15_000.0..85_000.0).contains(&nt) => ("nanotesla", "nT", 0.001),
            // In no unit, or with much iron: the walk tells.
            _ => return Ok(()),
        };
        let advice = match self.said.canonical {
            true => format!(
                "multiply the three mag columns by {times}, map them with {unit} as their unit, or leave them out"
            ),
            false => format!("choose {unit} as the unit of the magnetic field, or leave it out"),
        };
        let columns = if self.said.canonical { "mag_x_ut, mag_y_ut, mag_z_ut" } else { "the magnetic field" };
        Err(ParseError::new(
            ParseErrorKind::OtherUnit,
            format!("a magnetic field about {:.4} long, as the Earth's is (22 to 67 µT)", 45.0 / factor),
            format!("a length of about {raw:.3}: these look like {looks_like}"),
            advice,
        )
        .in_column(columns))
    }

    fn pressure(&self) -> Result<(), ParseError> {
        let Some(median_hpa) = self.pressures.median() else { return Ok(()) };
        if LIKE_AIR_HPA.contains(&median_hpa) {
            return Ok(());
        }
        let raw = median_hpa / self.said.factors[3];
        let (looks_like, unit, times) = match raw {
            hpa if (300.0..1_200.0).contains(&hpa) => ("hectopascals", "hPa", 1.0),
            pa if (30_000.0..120_000.0).contains(&pa) => ("pascals", "Pa", 0.01),
            kpa if (30.0..120.0).contains(&kpa) => ("kilopascals", "kPa", 10.0),
            _ => return Ok(()),
        };
        let advice = match self.said.canonical {
            true => {
                format!("multiply the column by {times}, map it with {unit} as its unit, or leave it out")
            }
            false => format!("choose {unit} as the unit of the pressure, or leave it out"),
        };
        let column = if self.said.canonical { "pressure_hpa" } else { "the pressure" };
        Err(ParseError::new(
            ParseErrorKind::OtherUnit,
            format!(
                "a pressure of the air, {:.0} to {:.0}",
                300.0 / self.said.factors[3],
                1_200.0 / self.said.factors[3]
            ),
            format!("about {raw:.1}: these look like {looks_like}"),
            advice,
        )
        .in_column(column))
    }
}

/// What gravity is as long as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Looks {
    Metres,
    G,
    Mg,
    /// So many for g, a power of two.
    Counts(u32),
}

impl Looks {
    /// The unit in which gravity is so long.
    pub(super) fn of_gravity(length: f64) -> Option<Looks> {
        let near = |of: f64, share: f64| (length / of - 1.0).abs() < share;
        if near(9.8, 0.28) {
            Some(Looks::Metres)
        } else if near(1.0, 0.28) {
            Some(Looks::G)
        } else if near(1000.0, 0.12) {
            // 1024 counts for g are so near that nobody can tell them apart.
            Some(Looks::Mg)
        } else {
            (6..=16)
                .filter(|bits| *bits != 10)
                .map(|bits| 1_u32 << bits)
                .find(|counts| near(f64::from(*counts), 0.1))
                .map(Looks::Counts)
        }
    }

    /// As a unit, and how many of it a 1 is.
    pub(super) fn unit(self) -> (ForceUnit, Option<f64>) {
        match self {
            Looks::Metres => (ForceUnit::MS2, None),
            Looks::G => (ForceUnit::G, None),
            Looks::Mg => (ForceUnit::Mg, None),
            Looks::Counts(counts) => (ForceUnit::G, Some(1.0 / f64::from(counts))),
        }
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
#[path = "units_check_tests.rs"]
mod tests;
