//! Broadcast orbits of a morning in Nagoya, held against what is known of the satellites.
//!
//! The messages are of MatRTKLIB's example (T. Suzuki, MIT licence), 24 June 2024.

use super::ephemeris::Ephemeris;
use super::navigation_reader::read;
use super::satellite::Satellite;
use super::time::GpsTime;
use crate::geo::Geodetic;

const MESSAGES: &str = "     3.04           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE
GPSA   1.8626E-08  2.2352E-08 -1.1921E-07 -5.9605E-08       IONOSPHERIC CORR
GPSB   1.2902E+05  1.6384E+05 -1.9661E+05 -2.6214E+05       IONOSPHERIC CORR
                                                            END OF HEADER
C01 2024 06 24 08 00 00 9.039411088452E-04 2.186695269302E-12 0.000000000000E+00
     1.000000000000E+00 3.987812500000E+02 1.168655822063E-08-7.785119710056E-01
     1.305714249611E-05 2.352053998038E-04-1.721968874335E-05 6.493358730316E+03
     1.152000000000E+05 3.771856427193E-08-1.376223151778E+00-3.306195139885E-08
     6.493194956776E-02 5.192812500000E+02 5.103894865136E-01-1.047865076358E-08
     2.235807416067E-10 0.000000000000E+00 9.640000000000E+02 0.000000000000E+00
     2.000000000000E+00 0.000000000000E+00-4.900000000000E-09-1.000000000000E-08
     1.152276000000E+05 0.000000000000E+00
C59 2024 06 24 08 00 00 5.364418029785E-07-1.154631945610E-14 0.000000000000E+00
     1.000000000000E+00 4.911562500000E+02 1.076616273961E-08 1.247035771794E+00
     1.611746847630E-05 4.224977456033E-04-1.373514533043E-05 6.493406042099E+03
     1.152000000000E+05-1.681037247181E-07-1.472383873144E+00-4.656612873077E-09
     8.621289890758E-02 4.119843750000E+02-1.497534982503E+00-9.547897708264E-09
     2.892977646988E-10 0.000000000000E+00 9.640000000000E+02 0.000000000000E+00
     2.000000000000E+00 0.000000000000E+00 4.160000000000E-08 4.160000000000E-08
     1.152276000000E+05 1.000000000000E+00
E04 2024 06 24 08 00 00-4.288260824978E-04-9.166001291305E-12 0.000000000000E+00
     6.500000000000E+01-1.331562500000E+02 2.712612991219E-09 1.450514434286E+00
    -6.210058927536E-06 3.254675539210E-04 1.124665141106E-05 5.440636682510E+03
     1.152000000000E+05-1.862645149231E-09-2.626136897440E+00 2.980232238770E-08
     9.617908215797E-01 1.019375000000E+02-1.068999055553E+00-5.213788603794E-09
     4.478757986819E-10 5.170000000000E+02 2.320000000000E+03
     3.120000000000E+00 0.000000000000E+00-1.629814505577E-09-2.328306436539E-09
     1.160750000000E+05
E04 2024 06 24 08 30 00-4.288422642276E-04-9.166001291305E-12 0.000000000000E+00
     6.800000000000E+01-1.374062500000E+02 2.721541934574E-09 1.675409443574E+00
    -6.418675184250E-06 3.259099321440E-04 1.104548573494E-05 5.440635253906E+03
     1.170000000000E+05-2.793967723846E-08-2.626146225006E+00 2.235174179077E-08
     9.617917139597E-01 1.059062500000E+02-1.070742110741E+00-5.206288291376E-09
     4.335894893140E-10 2.580000000000E+02 2.320000000000E+03
     3.120000000000E+00 0.000000000000E+00-2.328306436539E-09 0.000000000000E+00
     1.177400000000E+05
J07 2024 06 24 09 00 00-4.703179001808E-08 0.000000000000E+00 0.000000000000E+00
     1.290000000000E+02-9.837500000000E+01 0.000000000000E+00 1.494854179271E+00
    -3.146007657051E-06 1.765899360180E-04 2.105161547661E-05 6.493471609116E+03
     1.188000000000E+05-1.767650246620E-06-2.712457791886E+00-3.810971975327E-06
     1.164990423670E-03-6.385937500000E+02-4.683612896077E-01 1.203264406507E-09
     0.000000000000E+00 2.000000000000E+00 2.320000000000E+03 1.000000000000E+00
     2.800000000000E+00 1.000000000000E+00-4.656612873077E-09 8.970000000000E+02
     1.152180000000E+05 0.000000000000E+00
";

fn of(name: &str) -> Vec<Ephemeris> {
    let satellite = Satellite::read(name.as_bytes(), b'G').unwrap();
    let all = read(MESSAGES.as_bytes()).unwrap();
    all.ephemerides.into_iter().filter(|one| one.satellite == satellite).collect()
}

fn at(hour: u32, minute: u32) -> GpsTime {
    GpsTime::from_calendar(2024, 6, 24, hour, minute, 0)
}

#[test]
fn geostationary_satellites_stay_over_their_place_on_the_equator() {
    // GEO-1 of BeiDou-3 (C59) is at 140° east; the older one stands four degrees beside it.
    for (name, longitude_deg) in [("C59", 140.0), ("C01", 144.5)] {
        for minute in [0, 30, 59] {
            let state = of(name)[0].state(at(8, minute));
            let place = Geodetic::from_ecef_m(state.p_e.into());
            assert!(place.latitude_deg.abs() < 3.0, "{name}: {place:?}");
            assert!((place.longitude_deg - longitude_deg).abs() < 0.5, "{name}: {place:?}");
            assert!((place.height_m - 35_786e3).abs() < 60e3, "{name}: {place:?}");
        }
    }
}

#[test]
fn two_messages_of_one_satellite_agree_in_between() {
    let all = of("E04");
    let (before, after) = (all[0].state(at(8, 15)), all[1].state(at(8, 15)));
    assert!(all[1].toe > all[0].toe);
    assert!((before.p_e - after.p_e).norm() < 3.0, "{}", (before.p_e - after.p_e).norm());
    assert!((before.clock_s - after.clock_s).abs() < 3e-9);
    // Half an hour is far enough for the orbit to matter.
    assert!((all[0].state(at(8, 30)).p_e - before.p_e).norm() > 1e6);
}

#[test]
fn beidou_s_times_are_read_in_its_own_time_and_a_week_s_end_does_not_matter() {
    let c01 = of("C01")[0];
    assert_eq!(c01.toc, at(8, 0) + 14.0);
    assert_eq!(c01.toe, at(8, 0) + 14.0);
    // The message of QZSS is told for the hour after.
    assert_eq!(of("J07")[0].toe, at(9, 0));
}

#[test]
fn the_nearest_message_of_a_healthy_satellite_is_taken_and_none_of_another_day() {
    let all = read(MESSAGES.as_bytes()).unwrap();
    assert_eq!(all.klobuchar.unwrap()[4], 1.2902e5);
    let e04 = Satellite::read(b"E04", b'G').unwrap();
    assert_eq!(all.nearest(e04, at(8, 29)).unwrap().toe, of("E04")[1].toe);
    assert!(all.nearest(e04, GpsTime::from_calendar(2024, 6, 25, 8, 0, 0)).is_none());
    let mut ill = all;
    ill.ephemerides.iter_mut().for_each(|one| one.healthy = false);
    assert!(ill.nearest(e04, at(8, 29)).is_none());
}

#[test]
fn what_is_cut_off_is_dropped_and_said() {
    let end = MESSAGES.len() - 250;
    let all = read(&MESSAGES.as_bytes()[..end]).unwrap();
    assert_eq!((all.ephemerides.len(), all.notes.len()), (4, 1));
    let error = read(b"t_s,anchor,range_m\n").unwrap_err().to_string();
    assert!(error.contains("navigation"), "{error}");
}
