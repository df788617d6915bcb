//! Sensors that contradict each other, on purpose: every reading by itself is one that such a sensor may give, and no two of
//! them belong together. What merely breaks stands in `faults`.

use nalgebra::{Matrix3, Vector3};

use crate::rotation::cayley;
use crate::sample::ImuSample;

/// Fall of the pressure with the height, hPa/m, near 1,000 m.
const HPA_PER_M: f64 = -0.1075;
/// How long a lift or an escalator takes to come to its speed, s.
const SPEED_UP_S: f64 = 2.0;

/// The logs of a walker's feet, and what a contradiction has done to where he truly is.
#[derive(Clone, Debug)]
pub struct Worn {
    /// The logs, left first; empty where a foot has none.
    pub logs: [Vec<ImuSample>; 2],
    /// Where he truly is, by the clock of the logs: time, ns, and east, north, up, m.
    pub truth: Vec<(i64, [f64; 3])>,
}

/// A kind of contradiction, in the severities that it comes in.
#[derive(Clone, Copy, Debug)]
pub struct Contradiction {
    /// What it is; `{}` stands for the severity.
    pub name: &'static str,
    /// How much of it.
    pub severities: &'static [f64],
    spoil: fn(&mut Worn, f64),
}

impl Contradiction {
    /// Lets it happen to the logs of a walk.
    pub fn spoil(&self, worn: &mut Worn, severity: f64) {
        (self.spoil)(worn, severity);
    }

    /// Its name with the severity.
    pub fn named(&self, severity: f64) -> String {
        self.name.replace("{}", &severity.to_string())
    }
}

const fn of(name: &'static str, severities: &'static [f64], spoil: fn(&mut Worn, f64)) -> Contradiction {
    Contradiction { name, severities, spoil }
}

const ONCE: &[f64] = &[1.0];

/// Every kind.
pub const CONTRADICTIONS: &[Contradiction] = &[
    // Signs.
    of("force with the other sign", ONCE, |worn, _| each(worn, |s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| -f))),
    of("force with the other sign, right foot alone", ONCE, |worn, _| {
        right(worn, |s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| -f))
    }),
    of("field with the other sign", ONCE, |worn, _| {
        each(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|b| b.map(|b| -b)))
    }),
    of("field with the other sign, right foot alone", ONCE, |worn, _| {
        right(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|b| b.map(|b| -b)))
    }),
    of("rate with the other sign", ONCE, |worn, _| {
        each(worn, |s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| -w))
    }),
    of("rate of axis {} with the other sign", AXES, |worn, axis| {
        each(worn, |s| s.w_ib_b_rad_s[axis as usize] *= -1.0)
    }),
    of("rate of axis {} with the other sign, right foot alone", AXES, |worn, axis| {
        right(worn, |s| s.w_ib_b_rad_s[axis as usize] *= -1.0)
    }),
    of("force of axis {} with the other sign", AXES, |worn, axis| {
        each(worn, |s| s.f_b_m_s2[axis as usize] *= -1.0)
    }),
    of("field of axis {} with the other sign", AXES, |worn, axis| {
        each(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|b| mirrored(b, axis as usize)))
    }),
    of("left-handed axes, {} mirrored", AXES, |worn, axis| {
        each(worn, |s| {
            s.w_ib_b_rad_s = mirrored(s.w_ib_b_rad_s, axis as usize);
            s.f_b_m_s2 = mirrored(s.f_b_m_s2, axis as usize);
            s.mag_b_ut = s.mag_b_ut.map(|b| mirrored(b, axis as usize));
        })
    }),
    // Axes.
    of("field in the axes y, x, -z", ONCE, |worn, _| field(worn, |[x, y, z]| [y, x, -z])),
    of("field in the axes y, x, -z, right foot alone", ONCE, |worn, _| {
        right(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [y, x, -z]))
    }),
    of("field in the axes y, z, x", ONCE, |worn, _| field(worn, |[x, y, z]| [y, z, x])),
    of("field in the axes x, -y, -z", ONCE, |worn, _| field(worn, |[x, y, z]| [x, -y, -z])),
    of("field in the axes -x, -y, z", ONCE, |worn, _| field(worn, |[x, y, z]| [-x, -y, z])),
    of("field turned by {} deg about the vertical", &[30.0, 90.0, 180.0], |worn, deg| {
        turn_field(worn, 0, deg)
    }),
    of("rates in the axes y, x, z", ONCE, |worn, _| each(worn, |s| s.w_ib_b_rad_s.swap(0, 1))),
    of("rates in the axes y, z, x", ONCE, |worn, _| each(worn, |s| s.w_ib_b_rad_s.rotate_left(1))),
    of("rates in the axes -y, x, z", ONCE, |worn, _| {
        each(worn, |s| {
            let [x, y, z] = s.w_ib_b_rad_s;
            s.w_ib_b_rad_s = [-y, x, z];
        })
    }),
    of("forces in the axes y, x, z", ONCE, |worn, _| each(worn, |s| s.f_b_m_s2.swap(0, 1))),
    of("forces in the axes x, z, y, right foot alone", ONCE, |worn, _| {
        right(worn, |s| s.f_b_m_s2.swap(1, 2))
    }),
    // Scales and units.
    of("rates times {}", &[0.017_453_3, 0.5, 0.8, 0.9, 0.97, 1.03, 1.1, 1.25, 2.0, 57.295_78], |worn, by| {
        each(worn, |s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| by * w))
    }),
    of("rate of the z axis times {}", &[0.5, 0.9, 1.1, 2.0], |worn, by| {
        each(worn, |s| s.w_ib_b_rad_s[2] *= by)
    }),
    of("force times {}", &[0.101_97, 0.5, 0.95, 1.05, 2.0], |worn, by| {
        each(worn, |s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| by * f))
    }),
    of("force of the x axis times {}", &[0.8, 1.2, 2.0], |worn, by| each(worn, |s| s.f_b_m_s2[0] *= by)),
    of("field times {}", &[0.7, 0.85, 1.2, 1.5], |worn, by| field(worn, |b| b.map(|b| by * b))),
    // Axes that are dead, but not still.
    of("rate of axis {} noise alone", AXES, |worn, axis| {
        noisy(worn, |s, noise| s.w_ib_b_rad_s[axis as usize] = 0.01 * noise)
    }),
    of("force of axis {} noise alone", AXES, |worn, axis| {
        noisy(worn, |s, noise| s.f_b_m_s2[axis as usize] = 0.05 * noise)
    }),
    of("field of axis {} noise alone", AXES, |worn, axis| {
        noisy(worn, |s, noise| {
            if let Some(b) = &mut s.mag_b_ut {
                b[axis as usize] = 0.5 * noise;
            }
        })
    }),
    of("field that does not turn with the foot", ONCE, |worn, _| {
        noisy(worn, |s, noise| {
            s.mag_b_ut = s.mag_b_ut.map(|_| [30.0 + 0.3 * noise, 12.0, -34.0 - 0.2 * noise])
        })
    }),
    of("rates late by {} samples", &[2.0, 5.0, 10.0], |worn, by| {
        late(worn, by, |to, from| to.w_ib_b_rad_s = from.w_ib_b_rad_s)
    }),
    of("forces late by {} samples", &[2.0, 5.0, 10.0], |worn, by| {
        late(worn, by, |to, from| to.f_b_m_s2 = from.f_b_m_s2)
    }),
    of("field late by {} samples", &[10.0, 50.0, 200.0], |worn, by| {
        late(worn, by, |to, from| to.mag_b_ut = from.mag_b_ut)
    }),
    // Biases.
    of("rate off by {} rad/s on x from the middle on", &[0.02, 0.05, 0.2], |worn, by| {
        from_middle(worn, |s| s.w_ib_b_rad_s[0] += by)
    }),
    of("rate off by {} rad/s on z from the middle on", &[0.02, 0.05, 0.2], |worn, by| {
        from_middle(worn, |s| s.w_ib_b_rad_s[2] += by)
    }),
    of("force off by {} m/s2 on x", &[0.3, 1.0, 3.0], |worn, by| each(worn, |s| s.f_b_m_s2[0] += by)),
    of("force off by {} m/s2 on z", &[0.3, 1.0, 3.0], |worn, by| each(worn, |s| s.f_b_m_s2[2] += by)),
    of("force off by {} m/s2 on x from the middle on", &[0.3, 1.0, 3.0], |worn, by| {
        from_middle(worn, |s| s.f_b_m_s2[0] += by)
    }),
    // Iron.
    of("iron of {} uT on one axis of the shoes", &[5.0, 10.0, 20.0, 40.0], |worn, by| {
        field(worn, |[x, y, z]| [x, y + by, z])
    }),
    of("iron of {} uT on the right shoe", &[10.0, 20.0, 40.0], |worn, by| {
        right(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [x + by, y, z]))
    }),
    of("iron of {} uT put on in the middle", &[10.0, 20.0, 40.0], |worn, by| {
        from_middle(worn, |s| s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [x, y + by, z]))
    }),
    of("field turned by {} deg about the vertical in the middle", &[10.0, 30.0, 60.0, 120.0], |worn, deg| {
        let middle = worn.truth.len() / 2;
        turn_field(worn, middle, deg)
    }),
    // What slips.
    of("sensor turned by {} deg about x in the middle", &[10.0, 40.0, 90.0], |worn, deg| {
        slip(worn, Vector3::x(), deg)
    }),
    of("sensor turned by {} deg about z in the middle", &[10.0, 40.0, 90.0], |worn, deg| {
        slip(worn, Vector3::z(), deg)
    }),
    // Heights.
    of("a lift of {} m at the end", &[-8.0, 3.0, 16.0, 60.0], |worn, rise| ride(worn, 1.0, rise, true)),
    of("a lift of {} m in the middle of a stand", &[-8.0, 3.0, 16.0], |worn, rise| {
        ride(worn, 0.0, rise, true)
    }),
    of("an escalator of {} m at the end", &[-5.0, 5.0, 12.0], |worn, rise| ride(worn, 1.0, rise, false)),
    of("pressure of {} m of height in a minute that nobody climbs", &[2.0, 10.0, 30.0], |worn, rise| {
        let count = worn.truth.len().max(1) as f64;
        numbered(worn, |k, s| {
            s.pressure_hpa = s.pressure_hpa.map(|p| p + rise * HPA_PER_M * k as f64 / count)
        })
    }),
    of("pressure with steps of {} hPa", &[0.3, 1.0, 3.0], |worn, by| {
        numbered(worn, |k, s| {
            s.pressure_hpa = s.pressure_hpa.map(|p| p + if k / 700 % 2 == 1 { by } else { 0.0 })
        })
    }),
    of("pressure with noise of {} hPa", &[0.3, 1.0, 3.0], |worn, by| {
        noisy(worn, |s, noise| s.pressure_hpa = s.pressure_hpa.map(|p| p + by * noise))
    }),
    of("pressure of the right foot off by {} hPa from the middle on", &[1.0, 5.0], |worn, by| {
        let middle = worn.truth.len() / 2;
        for s in worn.logs[1].iter_mut().skip(middle) {
            s.pressure_hpa = s.pressure_hpa.map(|p| p + by);
        }
    }),
    // Two feet.
    of("the feet swapped", ONCE, |worn, _| worn.logs.swap(0, 1)),
    of("the log of the left foot for both", ONCE, |worn, _| {
        if !worn.logs[1].is_empty() {
            worn.logs[1] = worn.logs[0].clone();
        }
    }),
    of("the clock of the right foot ahead by {} s", &[0.05, 0.2, 0.6, 2.0], |worn, by| {
        worn.logs[1].iter_mut().for_each(|s| s.t_ns += (by * 1e9) as i64)
    }),
    of("the clock of the right foot {} times as fast", &[0.9, 0.99, 0.999, 1.001, 1.01, 1.1], |worn, by| {
        worn.logs[1].iter_mut().for_each(|s| s.t_ns = (by * s.t_ns as f64) as i64)
    }),
    of("both clocks {} times as fast", &[0.5, 0.9, 0.97, 1.03, 1.1, 2.0], |worn, by| {
        each(worn, |s| s.t_ns = (by * s.t_ns as f64) as i64);
        worn.truth.iter_mut().for_each(|(t_ns, _)| *t_ns = (by * *t_ns as f64) as i64);
    }),
    // Worse data.
    of("{} spikes of one sample a foot", &[5.0, 50.0], spikes),
    of("one sample in {} lost", &[3.0, 5.0, 10.0], |worn, every| {
        let mut random = Scatter::new();
        for log in &mut worn.logs {
            log.retain(|_| random.next().abs() > 1.0 / every);
        }
    }),
    of("stamps that jitter by {} ms", &[2.0, 5.0, 9.0], |worn, ms| {
        noisy(worn, |s, noise| s.t_ns += (0.49 * noise * ms * 1e6) as i64)
    }),
    of("every {}th sample alone", &[2.0, 4.0, 5.0, 10.0, 20.0], |worn, every| {
        for log in &mut worn.logs {
            let mut k = 0;
            log.retain(|_| {
                k += 1;
                (k - 1) % every as usize == 0
            });
        }
    }),
    of("forces in steps of {} m/s2", &[0.1, 0.5, 1.0], |worn, step| {
        each(worn, |s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| step * (f / step).round()))
    }),
    of("rates in steps of {} rad/s", &[0.02, 0.1], |worn, step| {
        each(worn, |s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| step * (w / step).round()))
    }),
    of("no magnetometer", ONCE, |worn, _| each(worn, |s| s.mag_b_ut = None)),
];

const AXES: &[f64] = &[0.0, 1.0, 2.0];

fn each(worn: &mut Worn, change: impl Fn(&mut ImuSample)) {
    worn.logs.iter_mut().flatten().for_each(change);
}

fn numbered(worn: &mut Worn, change: impl Fn(usize, &mut ImuSample)) {
    for log in &mut worn.logs {
        log.iter_mut().enumerate().for_each(|(k, s)| change(k, s));
    }
}

fn right(worn: &mut Worn, change: impl Fn(&mut ImuSample)) {
    worn.logs[1].iter_mut().for_each(change);
}

fn field(worn: &mut Worn, change: impl Fn([f64; 3]) -> [f64; 3]) {
    each(worn, |s| s.mag_b_ut = s.mag_b_ut.map(&change));
}

fn from_middle(worn: &mut Worn, change: impl Fn(&mut ImuSample)) {
    let middle = worn.truth.len() / 2;
    for log in &mut worn.logs {
        log.iter_mut().skip(middle).for_each(&change);
    }
}

fn noisy(worn: &mut Worn, change: impl Fn(&mut ImuSample, f64)) {
    let mut scatter = Scatter::new();
    worn.logs.iter_mut().flatten().for_each(|s| change(s, 1.7 * scatter.next()));
}

fn late(worn: &mut Worn, by: f64, take: impl Fn(&mut ImuSample, &ImuSample)) {
    for log in &mut worn.logs {
        let before = log.clone();
        for (to, from) in log.iter_mut().skip(by as usize).zip(&before) {
            take(to, from);
        }
    }
}

fn mirrored(mut axes: [f64; 3], axis: usize) -> [f64; 3] {
    axes[axis] *= -1.0;
    axes
}

/// The turn by an angle about an axis.
fn turn(axis: Vector3<f64>, deg: f64) -> Matrix3<f64> {
    // A Cayley turn by small parts is exact to 1e-6 here.
    let part = cayley(&(axis * (deg.to_radians() / 64.0)));
    (0..64).fold(Matrix3::identity(), |turned, _| turned * part)
}

/// The field of each foot, turned about what is upright while it stands at the start.
fn turn_field(worn: &mut Worn, from: usize, deg: f64) {
    for log in &mut worn.logs {
        let up_b: Vector3<f64> = log.iter().take(500).map(|s| Vector3::from(s.f_b_m_s2)).sum();
        let turned = turn(up_b.try_normalize(0.0).unwrap_or_else(Vector3::z), deg);
        for s in log.iter_mut().skip(from) {
            s.mag_b_ut = s.mag_b_ut.map(|b| (turned * Vector3::from(b)).into());
        }
    }
}

/// Both sensors turn where they are tied, in the middle of the walk.
fn slip(worn: &mut Worn, axis: Vector3<f64>, deg: f64) {
    let turned = turn(axis, deg);
    let of = |v: [f64; 3]| -> [f64; 3] { (turned * Vector3::from(v)).into() };
    from_middle(worn, |s| {
        s.w_ib_b_rad_s = of(s.w_ib_b_rad_s);
        s.f_b_m_s2 = of(s.f_b_m_s2);
        s.mag_b_ut = s.mag_b_ut.map(of);
    });
}

/// Somebody stands while something takes him up: at the end of the walk (`share` 1) or after its standing start (0). A
/// lift goes at 2 m/s, an escalator at 0.5.
fn ride(worn: &mut Worn, share: f64, rise_m: f64, lift: bool) {
    const PERIOD_NS: i64 = 10_000_000;
    let at = (1_000 + (share * (worn.truth.len() as f64 - 1_100.0).max(0.0)) as usize)
        .min(worn.truth.len().max(1) - 1);
    let speed_m_s = if lift { 2.0 } else { 0.5_f64 }.min(rise_m.abs() / SPEED_UP_S);
    let ride_s = rise_m.abs() / speed_m_s + SPEED_UP_S;
    let count = (ride_s * 100.0) as usize + 300;
    let risen = |k: usize| -> (f64, f64) {
        let t_s = k as f64 / 100.0;
        let a = rise_m.signum() * speed_m_s / SPEED_UP_S;
        if t_s < SPEED_UP_S {
            (0.5 * a * t_s * t_s, a)
        } else if t_s < ride_s - SPEED_UP_S {
            (a * SPEED_UP_S * (t_s - 0.5 * SPEED_UP_S), 0.0)
        } else if t_s < ride_s {
            (rise_m - 0.5 * a * (ride_s - t_s).powi(2), -a)
        } else {
            (rise_m, 0.0)
        }
    };
    for log in &mut worn.logs {
        if log.len() <= at {
            continue;
        }
        let before = log.clone();
        let stood: Vec<ImuSample> = (0..count)
            .map(|k| {
                // The stand goes on by its own last seconds, to and fro.
                let back = k % 100;
                let mut s = before[at - if k / 100 % 2 == 0 { back } else { 99 - back }];
                let (height_m, push_m_s2) = risen(k);
                let f = Vector3::from(s.f_b_m_s2);
                s.f_b_m_s2 = (f * (1.0 + push_m_s2 / f.norm())).into();
                s.pressure_hpa = s.pressure_hpa.map(|p| p + HPA_PER_M * height_m);
                s.t_ns = before[at].t_ns + (k as i64 + 1) * PERIOD_NS;
                s
            })
            .collect();
        for s in log.iter_mut().skip(at + 1) {
            s.t_ns += count as i64 * PERIOD_NS;
            s.pressure_hpa = s.pressure_hpa.map(|p| p + HPA_PER_M * rise_m);
        }
        log.splice(at + 1..at + 1, stood);
    }
    for (t_ns, place_m) in worn.truth.iter_mut().skip(at + 1) {
        *t_ns += count as i64 * PERIOD_NS;
        place_m[2] += rise_m;
    }
    let (t_ns, [e_m, n_m, u_m]) = worn.truth[at];
    let rides = (0..count).map(|k| (t_ns + (k as i64 + 1) * PERIOD_NS, [e_m, n_m, u_m + risen(k).0]));
    worn.truth.splice(at + 1..at + 1, rides);
}

/// Single samples far from their neighbours, on every axis.
fn spikes(worn: &mut Worn, count: f64) {
    let mut scatter = Scatter::new();
    for log in &mut worn.logs {
        let every = (log.len() / count as usize).max(2);
        for s in log.iter_mut().skip(every / 2).step_by(every) {
            s.w_ib_b_rad_s = std::array::from_fn(|_| 30.0 * scatter.next().signum());
            s.f_b_m_s2 = std::array::from_fn(|_| 150.0 * scatter.next().signum());
        }
    }
}

/// Numbers that are scattered between -1 and 1, the same for every walk.
struct Scatter(u64);

impl Scatter {
    fn new() -> Scatter {
        Scatter(1)
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
