use super::*;
use crate::parse::log_reader::samples_of;
use crate::sample::ImuSample;

fn file<'a>(name: &'a str, text: &'a str) -> SensorFile<'a> {
    SensorFile { name, bytes: text.as_bytes() }
}

fn joined(files: &[SensorFile<'_>]) -> (Vec<ImuSample>, String) {
    let joined = join(files).unwrap();
    (samples_of(joined.csv.as_bytes()).unwrap().1, joined.note)
}

/// Rows of a file: a header and values that go with the time.
fn rows(header: &str, count: u32, row: impl Fn(u32) -> String) -> String {
    format!("{header}\n{}", (0..count).map(|k| row(k) + "\n").collect::<String>())
}

#[test]
fn sensor_logger_s_files_are_joined_with_gravity_and_by_the_wall_clock() {
    let header = "time,seconds_elapsed,z,y,x";
    let at = |k: u32, ms: u32| 1_700_000_000_000_000_000_u64 + u64::from(k * 10 + ms) * 1_000_000;
    let gyroscope = rows(header, 50, |k| format!("{},{},0.3,0.2,0.1", at(k, 5), f64::from(k) * 0.01));
    let linear = rows(header, 50, |k| format!("{},{},0.5,0,0", at(k, 0), f64::from(k) * 0.01));
    let gravity = rows(header, 50, |k| format!("{},{},9.3,0,0.0", at(k, 0), f64::from(k) * 0.01));
    let magnetometer = rows(header, 10, |k| format!("{},{},-31,20,30", at(5 * k, 0), 0.0));
    let barometer = rows("time,seconds_elapsed,relativeAltitude,pressure", 2, |k| {
        format!("{},0,0.0,890.{k}", at(30 * k, 0))
    });
    let (samples, note) = joined(&[
        file("Accelerometer.csv", &linear),
        file("Gravity.csv", &gravity),
        file("Gyroscope.csv", &gyroscope),
        file("Magnetometer.csv", &magnetometer),
        file("Barometer.csv", &barometer),
        file("Annotation.csv", "time,seconds_elapsed,text,millisecond_press_duration\n"),
    ]);
    assert_eq!(samples.len(), 49, "{note}");
    assert_eq!(samples[0].w_ib_b_rad_s, [0.1, 0.2, 0.3]);
    assert!((samples[0].f_b_m_s2[2] - 9.8).abs() < 1e-9, "{:?}", samples[0]);
    assert_eq!(samples[0].mag_b_ut, Some([30.0, 20.0, -31.0]));
    assert_eq!((samples[1].mag_b_ut, samples[0].pressure_hpa), (None, Some(890.0)));
    assert!(note.contains("Accelerometer.csv and Gravity.csv were added"), "{note}");
    let total = [file("TotalAcceleration.csv", &gravity), file("Gyroscope.csv", &gyroscope)];
    assert_eq!(joined(&total).0.len(), 49);
    // Without gravity there is no specific force.
    let error = join(&[file("Accelerometer.csv", &linear), file("Gyroscope.csv", &gyroscope)]).unwrap_err();
    assert!(error.advice.contains("lacks gravity"), "{error}");
}

#[test]
fn phyphox_names_its_axes_and_units() {
    let force = rows("\"Time (s)\",\"X (m/s^2)\",\"Y (m/s^2)\",\"Z (m/s^2)\"", 40, |k| {
        format!("{},0.1,0.2,9.8", f64::from(k) * 0.01)
    });
    let rates = rows("\"Time (s)\",\"X (rad/s)\",\"Y (rad/s)\",\"Z (rad/s)\"", 80, |k| {
        format!("{},1e-1,0.2,-0.3", f64::from(k) * 0.005)
    });
    let pressure =
        rows("\"Time (s)\",\"X (hPa)\",\"Pressure (hPa)\"", 3, |k| format!("{},0,890.5", f64::from(k) * 0.1));
    let (samples, _) = joined(&[
        file("export/Accelerometer.csv", &force),
        file("export/Gyroscope.csv", &rates),
        file("export/Linear Accelerometer.csv", &force),
        file("export/Pressure.csv", &pressure),
    ]);
    // The last rate comes after the last force.
    assert_eq!(samples.len(), 79);
    assert_eq!((samples[3].f_b_m_s2, samples[3].w_ib_b_rad_s), ([0.1, 0.2, 9.8], [0.1, 0.2, -0.3]));
    assert_eq!(samples[0].pressure_hpa, Some(890.5));
    // As semicolons with decimal commas.
    let german = |text: &str| text.replace(',', ";").replace('.', ",");
    let (force, rates) = (german(&force), german(&rates));
    assert_eq!(joined(&[file("Accelerometer.csv", &force), file("Gyroscope.csv", &rates)]).0.len(), 79);
}

#[test]
fn an_x_imu3_has_its_magnetometer_apart_and_in_no_unit() {
    let inertial = rows(
        "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)",
        20,
        |k| format!("{},180,0,0,0,0,1", 1_700_000_000_000_000_u64 + u64::from(k) * 2_500),
    );
    let field =
        rows("Timestamp (us),Magnetometer X (a.u.),Magnetometer Y (a.u.),Magnetometer Z (a.u.)", 5, |k| {
            format!("{},1,0,0", 1_700_000_000_000_000_u64 + u64::from(k) * 50_000)
        });
    let (samples, note) = joined(&[file("Inertial.csv", &inertial), file("Magnetometer.csv", &field)]);
    assert_eq!(samples.len(), 20);
    assert!((samples[0].w_ib_b_rad_s[0] - std::f64::consts::PI).abs() < 1e-9);
    assert!((samples[0].f_b_m_s2[2] - 9.806_65).abs() < 1e-9);
    assert!(note.contains("Magnetometer.csv was left out"), "{note}");
}

#[test]
fn gaps_are_not_bridged_and_bad_lines_cost_themselves() {
    let row = |k: u32, value: &str| format!("{},{value}", f64::from(k) * 0.01);
    let rates = rows("time,x,y,z", 100, |k| row(k, if k == 50 { "x,?,0" } else { "0,0,0.1" }));
    let forces = rows("time,x,y,z", 100, |k| row(if k < 30 { k } else { k + 40 }, "0,0,981"));
    let forces = forces.replace("981", "1000");
    let (samples, note) = joined(&[file("acc.csv", &forces), file("gyro.csv", &rates)]);
    assert_eq!(samples.len(), 60, "{note}");
    assert!((samples[0].f_b_m_s2[2] - 9.806_65).abs() < 1e-9, "milli-g, by their size");
    assert!(note.contains("1 lines of gyro.csv"), "{note}");
}

#[test]
fn what_is_missing_is_named() {
    let error =
        join(&[file("notes.txt", "hello"), file("Gyroscope.csv", "time,x,y,z\n0,0,0,0\n0.01,0,0,0\n")])
            .unwrap_err();
    assert!(error.to_string().contains("specific forces"), "{error}");
    let error = join(&[]).unwrap_err();
    assert!(error.to_string().contains("angular rates"), "{error}");
}
