//! What goes wrong with the feed cabin, kind by kind: `cargo run --release --features sim --example cabin_faults -- 4`.
//!
//! Runs of 40 s parked, 20 s to the source and 40 s on it, of so many seeds; each fault begins at 55 s (on the way) or 70 s and lasts
//! 10 s. Told: how long after its beginning the device was named, the largest error of both bodies from then to the end, how many
//! rows are farther off than their protection level, and the largest leap from row to row beyond what the velocity says.

#[path = "../tests/cabin/run.rs"]
#[expect(dead_code, reason = "the table looks at the largest errors, the tests at their spread, too")]
mod run;

use std::error::Error;
use std::io::{self, Write};

use lodestep_engine::sim::cabin::{RunPlan, SimulatedRun, simulate};
use lodestep_engine::systems::cabin::Row;

use self::run::{Found, Read, errors, process};

/// Faults with the devices and kinds that have to be named; `|` between those of which one is enough.
const CASES: [(&str, &[&str], &[&str]); 15] = [
    ("one wrong fix", &["wrong_fix.2@70..80"], &["A3 wrong_fix"]),
    ("one wrong fix, on the way", &["wrong_fix.4@50..60"], &["A5 wrong_fix"]),
    ("a whole make wrong", &["wrong_make.0@70..80"], &["B wrong_make|L wrong_make"]),
    ("a station on the wrong prism", &["wrong_prism.1@70..80"], &["S2 wrong_prism|S2 wrong_distance"]),
    ("a station's distance wrong", &["wrong_distance.3@70..80"], &["S4 wrong_distance"]),
    ("a make late, on the way", &["late_make.1@50..60"], &["B late|B wrong_make|L late|L wrong_make"]),
    ("the inertial sensor starts anew", &["restart@70..78"], &["imu silent"]),
    ("the inertial sensor starts anew, on the way", &["restart@50..58"], &["imu silent"]),
    ("fog", &["fog@70..90"], &["stations silent"]),
    ("no antennas", &["no_antennas@70..90"], &["antennas silent"]),
    ("no encoders", &["no_encoders@70..80"], &["encoders silent"]),
    ("one leg off", &["wrong_leg.2@70..80"], &["leg_3 wrong_length"]),
    ("one leg off, on the way", &["wrong_leg.5@50..60"], &["leg_6 wrong_length"]),
    ("one leg off from the beginning", &["wrong_leg.4@-1..200"], &["leg_5 wrong_length"]),
    (
        "a storm of all",
        &[
            "fog@60..75",
            "wrong_fix.2@65..90",
            "wrong_make.1@80..90",
            "restart@84..87",
            "wrong_prism.1@80..95",
            "wrong_leg.0@78..92",
        ],
        &[
            "stations silent",
            "A3 wrong_fix",
            "B wrong_make|L wrong_make",
            "imu silent",
            "S2 wrong_prism|S2 wrong_distance",
            "leg_1 wrong_length",
        ],
    ),
];

const ALL: Read = Read {
    stations: true,
    encoders: true,
    platform_imu: true,
    smoothed: false,
    paper: false,
    until_ns: i64::MAX,
};

/// When a fault of those that are to be named begins, s: as the kind of fault says.
fn begins_s(fault: &str) -> f64 {
    let from = fault.split('@').nth(1).and_then(|span| span.split("..").next());
    from.and_then(|text| text.parse().ok()).unwrap_or(0.0)
}

/// How long after the beginning one of these was told, s.
fn named_after_s(found: &Found, wanted: &str, from_s: f64) -> Option<f64> {
    let is_wanted =
        |source: &str, kind: &str| wanted.split('|').any(|one| one.split_once(' ') == Some((source, kind)));
    let told = found.told.iter().filter(|(t_s, one)| *t_s >= from_s && is_wanted(&one.source, one.kind));
    told.map(|(t_s, _)| t_s - from_s).min_by(f64::total_cmp)
}

/// The largest leap from row to row beyond the mean velocity, m, and when, s.
fn leap_m(rows: &[Row], from_s: f64) -> (f64, f64) {
    let leaps = rows.windows(2).filter(|two| two[1].t_ns as f64 * 1e-9 > from_s).map(|two| {
        let dt_s = (two[1].t_ns - two[0].t_ns) as f64 * 1e-9;
        let by = two[1].p_n - two[0].p_n - (two[0].v_n + two[1].v_n) * (0.5 * dt_s);
        (by.norm(), two[1].t_ns as f64 * 1e-9)
    });
    leaps.fold((0.0, 0.0), |most, leap| if leap.0 > most.0 { leap } else { most })
}

fn told(run: &SimulatedRun, found: &Found, platform: bool) -> String {
    let rows = if platform { &found.poses.platform } else { &found.poses.cabin };
    let errors = errors(run, rows, platform, 45.0, 1e9);
    let size = |e: &[f64; 6]| (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt();
    let largest = errors.iter().map(|(e, _)| size(e)).fold(0.0, f64::max);
    let beyond = errors.iter().filter(|(e, row)| size(e) > row.protection_level_m()).count();
    let (leap_m, at_s) = leap_m(rows, 45.0);
    format!("{:.1} mm | {beyond} of {} | {:.1} mm at {at_s:.2} s", 1e3 * largest, errors.len(), 1e3 * leap_m)
}

fn main() -> Result<(), Box<dyn Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(4), |text| text.parse())?;
    let only = std::env::args().nth(2).unwrap_or_default();
    let mut out = io::stdout();
    writeln!(
        out,
        "| fault | seed | named after, s | cabin, largest | beyond | leap | platform, largest | beyond | leap |"
    )?;
    writeln!(out, "|---|---|---|---|---|---|---|---|---|")?;
    for (what, faults, wanted) in CASES.iter().filter(|(what, ..)| what.contains(&only)) {
        for seed in 0..seeds {
            let parsed = faults.iter().map(|fault| fault.parse()).collect::<Result<Vec<_>, _>>()?;
            let plan = RunPlan {
                hold_s: 40.0,
                slew_s: 20.0,
                track_s: 40.0,
                stations_on_platform: true,
                faults: parsed,
            };
            let run = simulate(&plan, seed);
            let found = process(&run, &ALL)?;
            let named: Vec<String> = wanted
                .iter()
                .zip(*faults)
                .map(|(one, fault)| {
                    named_after_s(&found, one, begins_s(fault))
                        .map_or("never".to_owned(), |s| format!("{s:.2}"))
                })
                .collect();
            let (cabin, platform) = (told(&run, &found, false), told(&run, &found, true));
            writeln!(out, "| {what} | {seed} | {} | {cabin} | {platform} |", named.join(" "))?;
            let others = found
                .anomalies
                .iter()
                .map(|one| format!("{} {} {:.1}..{:.1}", one.source, one.kind, one.t_start_s, one.t_end_s));
            writeln!(io::stderr(), "{what} {seed}: {}", others.collect::<Vec<_>>().join(", "))?;
        }
    }
    Ok(())
}
