//! What an instrument may not be: each contradiction has its sentence.

use nalgebra::{Matrix3, Vector3};

use super::instrument::{Instrument, InstrumentError, matrix};
use super::joints::Joints;

/// The sections that have to be there.
const SECTIONS: [&str; 8] =
    ["site", "imu", "antennas", "stations", "targets_cabin", "targets_platform", "rotator", "stewart"];
/// A cabin is no larger, m.
const LARGEST_M: f64 = 50.0;
/// A pillar stands no farther from the origin, m.
const FARTHEST_M: f64 = 5000.0;
/// A device is no later, s.
const LATEST_S: f64 = 0.4;
/// Encoders are no later, s: the platform is followed beyond their last row.
const LATEST_ENCODERS_S: f64 = 0.05;

fn wrong(sentence: String) -> Result<(), InstrumentError> {
    Err(InstrumentError(sentence))
}

/// Refuses a text without one of the sections, by its name.
pub(super) fn check_sections(text: &str) -> Result<(), InstrumentError> {
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        InstrumentError(format!(
            "expected TOML, found something else: {}; correct it",
            error.to_string().trim()
        ))
    })?;
    match SECTIONS.iter().find(|section| !table.contains_key(**section)) {
        Some(section) => wrong(format!(
            "expected the sections {}, found none called [{section}]; add it",
            SECTIONS.map(|name| format!("[{name}]")).join(", ")
        )),
        None => Ok(()),
    }
}

/// Refuses an instrument that contradicts itself.
pub(super) fn check(instrument: &Instrument) -> Result<(), InstrumentError> {
    let antennas = &instrument.antennas;
    equal("antennas", "position_b", &antennas.names, antennas.position_b.len())?;
    equal("antennas", "make", &antennas.names, antennas.make.len())?;
    equal("stations", "position_n", &instrument.stations.names, instrument.stations.position_n.len())?;
    let (cabin, platform) = (&instrument.targets_cabin, &instrument.targets_platform);
    equal("targets_cabin", "position_b", &cabin.names, cabin.position_b.len())?;
    equal("targets_platform", "position_p", &platform.names, platform.position_p.len())?;
    once("antennas", &antennas.names)?;
    once("stations", &instrument.stations.names)?;
    once("targets", &instrument.target_names())?;
    if antennas.names.len() > MOST || instrument.stations.names.len() > MOST {
        return wrong(format!(
            "expected at most {MOST} antennas and as many stations, found more; leave some out"
        ));
    }
    if let Some(make) = antennas.make.iter().find(|make| !antennas.delay_s.contains_key(*make)) {
        return wrong(format!(
            "[antennas] delay_s: expected a delay for every make, found none for {make:?}; add {make} = seconds"
        ));
    }
    for (make, delay_s) in &antennas.delay_s {
        seconds(&format!("[antennas] delay_s.{make}"), *delay_s, LATEST_S)?;
    }
    seconds("[antennas] delay_sigma_s", antennas.delay_sigma_s, 0.1)?;
    seconds("[stations] delay_s", instrument.stations.delay_s, LATEST_S)?;
    seconds("[stations] delay_sigma_s", instrument.stations.delay_sigma_s, 0.1)?;
    seconds("[stewart] delay_s", instrument.stewart.delay_s, LATEST_ENCODERS_S)?;
    seconds("[stewart] delay_sigma_s", instrument.stewart.delay_sigma_s, LATEST_ENCODERS_S)?;
    seconds("[stations] delay_jitter_s", instrument.stations.delay_jitter_s, 0.1)?;
    rotation("[imu] c_b_s", &matrix(&instrument.imu.c_b_s))?;
    if let Some(imu) = &instrument.platform_imu {
        rotation("[platform_imu] c_p_s", &matrix(&imu.c_p_s))?;
    }
    places(instrument)?;
    sigmas(instrument)?;
    let site = &instrument.site;
    if !(9.7..=9.9).contains(&site.gravity_m_s2) {
        return wrong(format!(
            "[site] gravity_m_s2: expected gravity from 9.7 to 9.9 m/s², found {}; correct it",
            site.gravity_m_s2
        ));
    }
    if !(site.latitude_deg.abs() <= 90.0 && site.longitude_deg.abs() <= 360.0 && site.height_m.abs() < 1e4) {
        return wrong("[site]: expected a latitude and longitude in degrees and a height in metres, found others; correct them".to_owned());
    }
    if Joints::new(instrument).at_rest().is_none() {
        return wrong("[stewart]: expected joints that hold the platform at rest_r, found ones that do not: its six legs do not tell its pose; check joint_r, joint_p and rest_r".to_owned());
    }
    Ok(())
}

/// Antennas, and stations, at most.
const MOST: usize = 16;

fn equal(section: &str, key: &str, names: &[String], found: usize) -> Result<(), InstrumentError> {
    if names.len() == found {
        return Ok(());
    }
    wrong(format!(
        "[{section}] {key}: expected {} entries, one for each of its names, found {found}; make the lists equally long",
        names.len()
    ))
}

fn once(section: &str, names: &[String]) -> Result<(), InstrumentError> {
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        Some((_, name)) => {
            wrong(format!("[{section}] names: expected each name once, found {name:?} twice; rename one"))
        }
        None => Ok(()),
    }
}

fn seconds(key: &str, found_s: f64, most_s: f64) -> Result<(), InstrumentError> {
    if (0.0..=most_s).contains(&found_s) {
        return Ok(());
    }
    wrong(format!("{key}: expected seconds from 0 to {most_s}, found {found_s}; check its unit"))
}

fn rotation(key: &str, found: &Matrix3<f64>) -> Result<(), InstrumentError> {
    let off = (found * found.transpose() - Matrix3::identity()).norm();
    if off < 1e-5 && found.determinant() > 0.0 {
        return Ok(());
    }
    let what = if off < 1e-5 {
        "a reflection (determinant −1)".to_owned()
    } else {
        format!("rows that are off by {off:.1e}")
    };
    wrong(format!(
        "{key}: expected a rotation, rows of length 1 at right angles, found {what}; correct the mounting"
    ))
}

fn places(instrument: &Instrument) -> Result<(), InstrumentError> {
    let stewart = &instrument.stewart;
    let sets: [(&str, Vec<[f64; 3]>, f64); 9] = [
        ("[imu] position_b", vec![instrument.imu.position_b], LARGEST_M),
        ("[antennas] position_b", instrument.antennas.position_b.clone(), LARGEST_M),
        ("[stations] position_n", instrument.stations.position_n.clone(), FARTHEST_M),
        ("[targets_cabin] position_b", instrument.targets_cabin.position_b.clone(), LARGEST_M),
        ("[targets_platform] position_p", instrument.targets_platform.position_p.clone(), LARGEST_M),
        ("[rotator] pivot_b", vec![instrument.rotator.pivot_b], LARGEST_M),
        ("[stewart] joint_r", stewart.joint_r.to_vec(), LARGEST_M),
        ("[stewart] joint_p", stewart.joint_p.to_vec(), LARGEST_M),
        ("[stewart] rest_r", vec![stewart.rest_r], LARGEST_M),
    ];
    for (key, places, most_m) in sets {
        // Written so that a NaN is refused, too.
        if let Some(place) =
            places.iter().find(|place| !(0.0..=most_m).contains(&Vector3::from(**place).norm()))
        {
            return wrong(format!(
                "{key}: expected metres, at most {most_m} from the origin, found {place:?}; check its unit"
            ));
        }
    }
    Ok(())
}

fn sigmas(instrument: &Instrument) -> Result<(), InstrumentError> {
    let (imu, stations) = (&instrument.imu, &instrument.stations);
    for (key, found, most) in [
        ("[imu] mounting_sigma_rad", imu.mounting_sigma_rad, 0.1),
        ("[imu] gyro_bias_sigma_rad_s", imu.gyro_bias_sigma_rad_s, 0.1),
        ("[imu] angle_random_walk_rad_sqrt_s", imu.angle_random_walk_rad_sqrt_s, 0.1),
        ("[imu] accelerometer_bias_sigma_m_s2", imu.accelerometer_bias_sigma_m_s2, 1.0),
        ("[imu] velocity_random_walk_m_s_sqrt_s", imu.velocity_random_walk_m_s_sqrt_s, 1.0),
        ("[stations] angle_sigma_rad", stations.angle_sigma_rad, 0.01),
        ("[stations] slant_sigma_m", stations.slant_sigma_m, 1.0),
        ("[stewart] leg_sigma_m", instrument.stewart.leg_sigma_m, 0.1),
        ("[rotator] angle_sigma_rad", instrument.rotator.angle_sigma_rad, 0.01),
    ] {
        if !(found > 0.0 && found <= most) {
            return wrong(format!(
                "{key}: expected a sigma above 0 and up to {most}, found {found}; check its unit"
            ));
        }
    }
    let known = [instrument.antennas.position_sigma_m, stations.position_sigma_m];
    if !known.iter().all(|sigma_m| (0.0..=0.5).contains(sigma_m)) {
        return wrong(format!(
            "position_sigma_m of antennas and stations: expected metres from 0 to 0.5, found {known:?}; check the unit"
        ));
    }
    Ok(())
}
