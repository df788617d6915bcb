//! The navigation library of Lodestep: samples in, events out.
//!
//! It is a calculator. It opens no file and no socket, starts no thread and asks no clock: time comes in
//! the samples, and the same samples give the same [`event::Event`]s, to the last bit, on every machine.
//! [`session::Session`] is the door; an upload, a live stream and the command line all go through it.
//!
//! The rest of this page is the notation that every module keeps to.
//!
//! # Frames
//!
//! | sign | frame | axes |
//! |---|---|---|
//! | n | navigation: the plane that touches the ellipsoid at the site's origin ([`geo::local_frame`]) | x east, y north, z up |
//! | b | body: the case of one sensor, as its maker drew the axes; one for each foot | any mounting; levelling at the start finds it |
//! | i | inertial | for feet n is taken to be at rest in it; for instruments it turns with Earth ([`ins::earth`]) |
//! | e | Earth: centred and fixed, WGS84 | z to the north pole, x to the meridian of Greenwich |
//!
//! At rest the specific force points up and has the length of gravity: a sensor that lies level reads +g on
//! z. Headings and azimuths run clockwise from true north, (−π, π]; the declination is positive where
//! magnetic north lies east of true north.
//!
//! # Spelling
//!
//! * A vector carries the frame it is written in: `v_n`, `f_b`, `mag_b`.
//! * A rotation matrix is spelt destination first, so that touching letters match: `f_n = c_nb * f_b`. A
//!   product in which they do not match is wrong.
//! * `w_ib_b` is the rate of b against i, written in b.
//! * A unit stands at the end of the name wherever a number leaves or enters: `rest_m_s2`, `sigma_rad`, `t_ns`.
//!   Inside the filter everything is SI and radians; two things keep the units that their world uses, the
//!   magnetic field (µT) and air pressure (hPa).
//! * Time is a whole number of nanoseconds since the session's start.
//!
//! # Signs of the errors
//!
//! One convention for all systems:
//!
//! | error | definition | block |
//! |---|---|---|
//! | attitude φ, in n | true rotation = (I + \[φ×\]) · estimated | [`Attitude`](ins::layout::ErrorState::Attitude) |
//! | gyro bias δb_g, in b | true − estimated | [`GyroBias`](ins::layout::ErrorState::GyroBias) |
//! | position δp, in n | estimated − true | [`Position`](ins::layout::ErrorState::Position) |
//! | velocity δv, in n | estimated − true | [`Velocity`](ins::layout::ErrorState::Velocity) |
//! | accelerometer bias δb_a, in b | true − estimated | [`AccelerometerBias`](ins::layout::ErrorState::AccelerometerBias) |
//! | scale factors δs_g, δs_a, by axis of b | true − estimated | [`SensorStates`](ins::layout::SensorStates), where they are states |
//! | lever arm δl, in b | true − estimated | [`LeverArm`](ins::lever_arm::LeverArm), where it is a state |
//! | compass deviation, stride error, surroundings | true − estimated | `systems::pedestrian::slow_errors` |
//!
//! A bias is what the reading has too much: reading = (1 + scale factor) · truth + bias, by axis. With these signs
//! the errors grow as
//!
//! φ̇ = −C δb_g,  δv̇ = \[f_n×\] φ + C δb_a,  δṗ = δv,
//!
//! and each bias fades with its correlation time ([`ins::error_model`]); on a turning Earth and with scale factors, as
//!
//! φ̇ = −\[w_ie×\] φ − C (δb_g + W δs_g),  δv̇ = \[f_n×\] φ − 2 \[w_ie×\] δv + ∂g/∂p δp + C (δb_a + F δs_a),  δṗ = δv,
//!
//! W and F the diagonals of rate and specific force ([`ins::strapdown`]). An innovation has the sign of the
//! errors: for a position or velocity it is estimated − measured ([`ins::observation`]). Corrections are taken
//! off the state at once ([`ins::nav_state`]), after which the estimated errors are zero again.
//!
//! # Symbols
//!
//! | in the papers | here | what, unit |
//! |---|---|---|
//! | C_b^n | `c_nb` | attitude: turns b into n |
//! | ω, Ω = \[ω×\] | `w_ib_b`, [`rotation::skew`] | angular rate, rad/s |
//! | f^b | `f_b` | specific force, m/s² |
//! | v^n, p^n | `v_n`, `p_n` | velocity m/s, position m |
//! | b_g, b_a | `gyro_bias_b`, `accelerometer_bias_b` | rad/s, m/s² |
//! | B | `mag_b_ut` | magnetic flux density, µT |
//! | α_nm | `declination_rad` | declination, rad |
//! | T_gb, T_ab | `…_correlation_time_s` | of the biases, s |
//! | ω_ie^n, g^n | [`Earth`](ins::earth::Earth): `w_ie_n`, `gravity_n` | Earth rate and gravity at a place, in n |
//! | l^b | [`LeverArm`](ins::lever_arm::LeverArm) | from the sensor to an antenna, tip or prism, m |
//! | P, Φ, Q | [`ins::block_covariance`], [`ins::error_model`] | covariance of the errors, its transition, its growth |
//! | H, m, R | [`Observation`](ins::observation::Observation): jacobians, innovation, noise | of one measurement |
//! | λ, Λ | `ins::adjoint` | what the future says of the errors, and how sure it is: smoothed errors P λ, covariance P − P Λ P |
//! | d_min | `separation_m` | distance of the feet where one passes the other, m |
//! | – | `nis` | normalised innovation squared: m' (H P H' + R)⁻¹ m |
//!
//! # Where the papers are misprinted, and where the engine departs from them
//!
//! Paper 1 is the pedestrian system's; the others are listed for what already leans on them.
//!
//! | where | what is printed | what is done |
//! |---|---|---|
//! | paper 1, §2.1 | the Cayley form turns by 2·atan(θ/2), not θ | the first term of the series puts it right ([`rotation::cayley`]); the rate is the mean of both ends of a step |
//! | paper 1, §2.2 | the row of δṗ holds \[f_n×\] φ and that of δv̇ does not | \[f_n×\] φ belongs to δv̇ |
//! | paper 1, §2.2 | δv̇ = … − C δb_a | + C δb_a, as both biases here are true − estimated |
//! | paper 1, §2.3 | one fixed threshold on ‖ω‖ and ‖f‖ | kept as [`StanceTuning::PAPER`](detect::stance::StanceTuning::PAPER); the default is a likelihood ratio ([`detect::stance`]) |
//! | paper 1, §2.3 | ZUPT sigma 0.017 m/s at every sample | larger, and once in an interval: neighbouring samples of a stance err alike ([`systems::pedestrian::tuning`]) |
//! | paper 1, §2.3 | a zero velocity measures the velocity's error | that error less the part that an error of the attitude has turned: a foot at rest tells nothing of north ([`measure::zero_velocity`]); after a correction the errors of velocity and position are those of the corrected ones |
//! | paper 1, §3.1 | the row of H is all zeros | \[B_u B_e / B_h², B_u B_n / B_h², −1\]: at a dip of 40° the tilt counts too ([`measure::magnetic_heading`]) |
//! | paper 1, §3.1 | true heading = magnetic heading − declination | azimuth of the levelled field = declination, east positive, which is the same with a declination of the other sign |
//! | paper 1, §3.1 | a heading update at every sample of a stance | once a stance, and what bends the field from stance to stance alike is an error state: a compass's deviation and the field's deflection (`systems::pedestrian::slow_errors`) |
//! | paper 1, §3.2 | MARU from sample to sample | from end to end of a stance: 0.25 µT of noise hides what 0.01 s of bias does ([`measure::magnetic_rate`]) |
//! | paper 1, §3.3 | the smallest distance of the feet is zero, along the line between them | `separation_m`, measured across the swing with its sign: two feet that changed sides are pulled back, not pushed on ([`systems::pedestrian::foot_separation`]); its error is set aside at its past moment, and nothing is run again (`ins::aside`) |
//! | – | – | a stride lies evenly about the standing foot, along the way and upwards, which a distance across the way cannot say ([`systems::pedestrian::foot_separation`]) |
//! | paper 1, §3.4 | a marker corrects the sensor's position | it corrects the middle of the feet, with a gate that lets the second of two agreeing visits through |
//! | paper 1, §2.1 | Earth's rotation is left out | likewise: 15 °/h is far below the bias of these sensors |
//! | paper 2, II-A | height = 443300·(…) | 44330 m ([`measure::height`]) |
//! | paper 2, (1)–(2) | a closed form for P₃₃ whose units do not balance | kept to compare with; [`systems::vertical`] derives one that agrees with the filter |
//! | paper 3 | a level frame that moves along, with transport rate | n is fixed to Earth: no transport rate, and gravity that leans with distance, which is the same motion ([`ins::earth`]) |
//! | paper 3, (20) | GPS − SINS, without a lever arm | estimated − measured, as the errors have it, and each antenna at its own lever arm ([`measure::antenna_position`], [`measure::antenna_velocity`]) |
//! | paper 3, tables 4–6 | "RMS" beside "Ave" | RMS there is scatter about the mean |
//! | paper 4 | north-east-down | everything here is east-north-up |
//! | paper 4, (10) | ω_eb as the rate of e against b | of b against e, as its equation has it ([`ins::lever_arm`]) |
//! | paper 4, (12) | the rate at the epoch | readings that are means over an interval give it as the mean of two neighbours ([`LeverArm::velocity`](ins::lever_arm::LeverArm::velocity)) |
//! | paper 4, (14) | the tip's lever arm in the antenna's Jacobian | the antenna's ([`measure::antenna_position`]) |
//! | paper 5, (6)–(7) | double differences | single differences with clocks that are free in each epoch, which give the same ([`systems::rover::satellites`]) |
//! | paper 5, (8)–(10) | ranges without bias, of the nearest epoch | a slow and a quick bias for each anchor, each range at its own time ([`systems::rover::coupling`]) |
//! | paper 5, (13)–(15) | components of an epoch | over a window that forgets, with a prior and a floor ([`adjust::variance_components`]); an epoch alone is kept to compare with ([`systems::rover::paper`]) |
//! | IGRF-13, WMM2020 | declination −2.62° at FAST in 2024 | [`geo::magnetic_field`] is the World Magnetic Model 2025 |
//!
//! # Sources
//!
//! 1. *Research on IMU-based positioning system for FAST inspection*, ChinaXiv postprint, 2025: the pedestrian system.
//! 2. C.-S. Jao, Y. Wang, S. Askari, A. M. Shkel, *A closed-form analytical estimation of vertical displacement
//!    error in pedestrian navigation*: the altimeter.
//! 3. M.-H. Li, P. Jiang, D.-J. Yu, J.-H. Sun, *Position and attitude determination by integrated GPS/SINS/TS for
//!    feed support system of FAST*, 2020: the feed cabin.
//! 4. C. Lai, R. Guo, Q. Chen, X. Niu, *Extending the real-time kinematics survey method to GNSS-denied areas using
//!    a low-cost inertial-aided positioning pole*: the surveyors' pole.
//! 5. 郝雨时, 徐爱功, 隋心, *GNSS/UWB 高精度室内外组合定位方法*: tight coupling.
//! 6. I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, *Zero-velocity detection: an algorithm evaluation*, IEEE
//!    Transactions on Biomedical Engineering 57, 2010: the likelihood ratio of a standing foot.
//!
//! # Contents
//!
//! Arrows point one way: `session → systems → replay, measure, detect, ins → geo, rotation`. `sim` knows none of the filter.

pub mod adjust;
pub mod anomaly;
pub mod cause;
pub mod detect;
#[cfg(feature = "parse")]
pub mod evaluate;
pub mod event;
pub mod figures;
pub mod geo;
pub mod gnss;
pub mod identify;
pub mod ins;
pub mod measure;
pub mod parameters;
#[cfg(feature = "parse")]
pub mod parse;
pub mod replay;
pub mod rotation;
pub mod sample;
pub mod session;
#[cfg(feature = "sim")]
pub mod sim;
pub mod stream;
pub mod system;
pub mod systems;
pub mod track;
pub mod visit;
pub mod word;

mod array;
mod merge;

// What a session takes and gives, without looking for the room that it is from.
pub use anomaly::Anomaly;
pub use event::{Event, TrackPoint};
pub use geo::Site;
pub use sample::ImuSample;
pub use session::{ConfigError, Session, SessionConfig, Solution, Summary};
pub use stream::{Reading, Stream, StreamId};
pub use track::Track;
pub use visit::Visit;

/// The examples of the README are kept true by being run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
