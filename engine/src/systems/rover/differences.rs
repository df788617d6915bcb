//! Differences between rover and base: what one epoch says, linearised at a place.

use nalgebra::{Matrix3, Vector3};

use crate::geo::{Geodetic, LocalFrame};
use crate::gnss::ephemeris::Navigation;
use crate::gnss::geometry::{at_transmission, azimuth_elevation, sight};
use crate::gnss::observations::{Epoch, Signal};
use crate::gnss::satellite::{Constellation, Satellite};
use crate::gnss::signal::{LIGHT_M_S, bands, preference, wavelength_m};
use crate::gnss::time::GpsTime;
use crate::gnss::troposphere;

/// Bands of one satellite that are used: a third one halves what multipath of a single one does to a position.
const MOST_BANDS: usize = 3;

/// The base: where it is, and the frame that is spanned there.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// Its antenna.
    pub place: Geodetic,
    /// Its antenna, Earth-centred, m.
    pub p_e: Vector3<f64>,
    /// From Earth-centred to east, north, up.
    pub c_ne: Matrix3<f64>,
    /// The frame.
    pub frame: LocalFrame,
}

impl Base {
    /// The base at a place.
    pub fn new(place: Geodetic) -> Base {
        let frame = LocalFrame::new(place);
        Base { place, p_e: Vector3::from(place.to_ecef_m()), c_ne: frame.c_ne(), frame }
    }

    /// A position of the frame, Earth-centred.
    pub fn to_e(&self, p_n: &Vector3<f64>) -> Vector3<f64> {
        self.p_e + self.c_ne.tr_mul(p_n)
    }
}

/// What is the same in all differences of one epoch of the rover.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The rover's epoch.
    pub rover: &'a Epoch,
    /// The base's.
    pub base: &'a Epoch,
}

/// One band of one satellite: rover minus base, what geometry explains taken off.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// The satellite.
    pub satellite: Satellite,
    /// The band.
    pub band: u8,
    /// The ways of tracking, rover and base.
    pub attributes: [u8; 2],
    /// Wavelength, m.
    pub wavelength_m: f64,
    /// Code, measured − expected, m.
    pub code_m: Option<f64>,
    /// Phase, measured − expected, m.
    pub phase_m: Option<f64>,
    /// The phase may be off by half a cycle.
    pub half_cycle: bool,
    /// How the range changes with the position: minus the unit vector to the satellite, in n.
    pub row_n: Vector3<f64>,
    /// Elevation seen from the rover, rad.
    pub elevation_rad: f64,
    /// The weaker of both signals, dB·Hz; 0 where it is not known.
    pub strength_db_hz: f32,
}

/// The satellite as rover and base saw it: where it was when it sent what each received.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    satellite: Satellite,
    rover: &'a [Signal],
    base: &'a [Signal],
    rover_e: Vector3<f64>,
    rover_clock_m: f64,
    /// What explains the base's observation, m.
    base_m: f64,
}

/// The satellites that both saw, and whose orbits are known.
pub fn seen<'a>(
    pair: Pair<'a>,
    base: &Base,
    navigation: &Navigation,
    systems: &[Constellation],
    mask_rad: f64,
) -> Vec<Seen<'a>> {
    let mut all = Vec::with_capacity(pair.rover.satellites.len());
    for tracked in &pair.rover.satellites {
        if !systems.contains(&tracked.satellite.constellation) {
            continue;
        }
        let Some(other) = pair.base.satellites.iter().find(|other| other.satellite == tracked.satellite)
        else {
            continue;
        };
        let Some(ephemeris) = navigation.nearest(tracked.satellite, pair.rover.time) else { continue };
        let rover = pair.rover.signals_of(tracked);
        let base_signals = pair.base.signals_of(other);
        let code = |signals: &[Signal]| signals.iter().map(|signal| signal.code_m).find(|code| *code != 0.0);
        let (Some(rover_code), Some(base_code)) = (code(rover), code(base_signals)) else { continue };
        let at_base = at_transmission(ephemeris, pair.base.time, base_code);
        let line = sight(&at_base.p_e, &base.p_e);
        let (_, elevation) = azimuth_elevation(&line.to_satellite_e, &base.c_ne);
        if elevation < mask_rad {
            continue;
        }
        let base_m = line.range_m - LIGHT_M_S * at_base.clock_s + troposphere::delay_m(base.place, elevation);
        let at_rover = at_transmission(ephemeris, pair.rover.time, rover_code);
        all.push(Seen {
            satellite: tracked.satellite,
            rover,
            base: base_signals,
            rover_e: at_rover.p_e,
            rover_clock_m: LIGHT_M_S * at_rover.clock_s,
            base_m,
        });
    }
    all.sort_by_key(|one| one.satellite);
    all
}

/// The differences at a position of the rover in n.
pub fn differences(seen: &[Seen<'_>], base: &Base, p_n: &Vector3<f64>) -> Vec<Difference> {
    let p_e = base.to_e(p_n);
    let place = Geodetic::from_ecef_m(p_e.into());
    let c_ne = LocalFrame::new(place).c_ne();
    let mut all = Vec::with_capacity(2 * seen.len());
    for one in seen {
        let line = sight(&one.rover_e, &p_e);
        let (_, elevation_rad) = azimuth_elevation(&line.to_satellite_e, &c_ne);
        if elevation_rad < 0.02 {
            continue;
        }
        let expected_m =
            line.range_m - one.rover_clock_m + troposphere::delay_m(place, elevation_rad) - one.base_m;
        let row_n = -(base.c_ne * line.to_satellite_e);
        let constellation = one.satellite.constellation;
        let mut used = 0;
        for &band in bands(constellation) {
            let Some((rover, from_base)) = matching(one.rover, one.base, constellation, band) else {
                continue;
            };
            let Some(wavelength_m) = wavelength_m(constellation, band) else { continue };
            let both = |rover: f64, base: f64| (rover != 0.0 && base != 0.0).then_some(rover - base);
            let code_m = both(rover.code_m, from_base.code_m).map(|code| code - expected_m);
            let phase_m = both(rover.phase_cycles, from_base.phase_cycles)
                .map(|cycles| cycles * wavelength_m - expected_m);
            if code_m.is_none() && phase_m.is_none() {
                continue;
            }
            all.push(Difference {
                satellite: one.satellite,
                band,
                attributes: [rover.attribute, from_base.attribute],
                wavelength_m,
                code_m,
                phase_m,
                half_cycle: rover.half_cycle || from_base.half_cycle,
                row_n,
                elevation_rad,
                strength_db_hz: rover.strength_db_hz.min(from_base.strength_db_hz),
            });
            used += 1;
            if used == MOST_BANDS {
                break;
            }
        }
    }
    all
}

/// The signals of a band by which both are compared: tracked the same way where there is one, with phases where there are.
fn matching<'a>(
    rover: &'a [Signal],
    base: &'a [Signal],
    constellation: Constellation,
    band: u8,
) -> Option<(&'a Signal, &'a Signal)> {
    let mut best: Option<(usize, &Signal, &Signal)> = None;
    for ours in rover.iter().filter(|signal| signal.band == band) {
        for theirs in base.iter().filter(|signal| signal.band == band) {
            let with_phase = ours.phase_cycles != 0.0 && theirs.phase_cycles != 0.0;
            let with_code = ours.code_m != 0.0 && theirs.code_m != 0.0;
            let same = ours.attribute == theirs.attribute;
            let worth = 1000 * usize::from(with_phase)
                + 400 * usize::from(with_code)
                + 200 * usize::from(same)
                + preference(constellation, band, ours.attribute)
                + preference(constellation, band, theirs.attribute);
            if best.is_none_or(|(most, ..)| worth > most) {
                best = Some((worth, ours, theirs));
            }
        }
    }
    best.map(|(_, ours, theirs)| (ours, theirs))
}

/// How old the base's epoch is, s.
pub fn age_s(rover: GpsTime, base: GpsTime) -> f64 {
    rover.since(base)
}
