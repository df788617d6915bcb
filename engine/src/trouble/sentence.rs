//! Trouble in words.

use super::Trouble;

impl Trouble {
    /// What was expected and what was found, in a sentence with units. It is part of a track's hash: another wording
    /// would make stored tracks look different.
    pub(super) fn sentence(&self) -> String {
        match self {
            Trouble::Gap { silence_s, usual_interval_s } => {
                format!("no samples for {silence_s:.3} s, where one comes every {usual_interval_s:.4} s")
            }
            Trouble::RepeatedTime => {
                "the time stamp equals the one before; the sample is left out".to_owned()
            }
            Trouble::TimeGoesBack { back_by_s } => format!(
                "the time goes back by {back_by_s:.4} s; samples are left out until it passes where it was"
            ),
            Trouble::TimeAhead { ahead_by_s } => format!(
                "a time stamp is {ahead_by_s:.1} s ahead of those around it; the sample is left out"
            ),
            Trouble::TimeOfAnotherAge { .. } => {
                "a time stamp is a hundred years from the session's start; the sample is left out".to_owned()
            }
            Trouble::EndOfRange { channel, reading } => {
                format!("{} stays at {reading:.2}, the end of its range", channel.name())
            }
            Trouble::ImpossibleMotion { largest_rate_rad_s, largest_force_m_s2 } => format!(
                "a rate above {largest_rate_rad_s} rad/s or a specific force above {largest_force_m_s2} m/s²; the sample is left out"
            ),
            Trouble::StuckAxis { channel, reading } => {
                format!("{} has read {reading} without any change for a second and more", channel.name())
            }
            Trouble::NotFinite => {
                "a rate or specific force is not a finite number; the sample is left out".to_owned()
            }
            Trouble::ImpossibleField { .. } => {
                "a magnetic value is not a finite number, or beyond all reason; it counts as missing"
                    .to_owned()
            }
            Trouble::ImpossiblePressure { lowest_hpa, highest_hpa } => format!(
                "a pressure is not between {lowest_hpa} and {highest_hpa} hPa; it counts as missing"
            ),
            Trouble::ImpossibleRestGravity { rest_m_s2, gravity_m_s2 } => format!(
                "at rest the specific force is {rest_m_s2:.2} m/s² where gravity is {gravity_m_s2:.2} m/s²: check the accelerometer's scale and units"
            ),
            Trouble::TiltedInStance { tilt_deg } => {
                wrong_axes(&format!("in stance the specific force stands {tilt_deg:.0}° from upright"))
            }
            Trouble::FastLandings { landing_speed_m_s } => {
                wrong_axes(&format!("the swings end at {landing_speed_m_s:.1} m/s where the foot stands"))
            }
            Trouble::ImpossibleCadence { per_s, most_per_s } => format!(
                "the foot sets off {per_s:.0} times a second, where none does more than {most_per_s:.0} times: check the unit of the time, the sensor's clock, and that the sensor is tied down"
            ),
            Trouble::NoStillStart { wanted_still_s } => format!(
                "no still second at the start; the quietest one was used for levelling, the gyro bias is unknown at first: stand still for {wanted_still_s} s before walking"
            ),
            Trouble::MagneticField { weakest_ut, strongest_ut, stances, found_ut } => format!(
                "the field has been outside {weakest_ut:.0} to {strongest_ut:.0} µT for {stances} stances, now {found_ut:.0} µT: steel nearby, or a magnetometer that needs calibrating; the heading goes on by the gyro"
            ),
            Trouble::FootAbsent { foot } => {
                format!("the {} foot has no samples at all; the other goes on alone", foot.name())
            }
            Trouble::FootNotStored { foot } => format!(
                "expected samples of the {} foot, found none: the track was computed without it",
                foot.name()
            ),
            Trouble::FootLate { foot, late_s } => {
                format!("the {} foot begins {late_s:.1} s late; the other goes on alone", foot.name())
            }
            Trouble::FootEarly { foot, early_s } => {
                format!("the {} foot ends {early_s:.1} s early; the other goes on alone", foot.name())
            }
            Trouble::FootSilent { foot, .. } => {
                format!("the {} foot is silent; the other goes on alone", foot.name())
            }
            Trouble::HeadingUncertain { sigma_heading_deg } => format!(
                "the heading is uncertain by {sigma_heading_deg:.0}° (1σ): only a marker or the magnetometer can mend it"
            ),
            Trouble::FilterReset => {
                "the filter came to a number that is none and went on from the last sound state; look at the samples in this stretch".to_owned()
            }
        }
    }
}

fn wrong_axes(found: &str) -> String {
    format!(
        "{found}: the axes of gyro and accelerometer do not belong together, or the sensor has slipped; check that the log's axes are right-handed and the sensor is tied down"
    )
}
