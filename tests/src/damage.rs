//! What happens to the file of a log between the sensor and the reader: kinds of damage, each with what of the log is readable
//! all the same.

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::parse::{LogReader, ParseError, ReadOptions, imu_csv};
use lodestep_engine::sample::ImuSample;

/// A log as a file, on its way to be damaged.
#[derive(Clone, Debug)]
pub struct LogText {
    /// The names of the columns.
    pub header: String,
    /// A line for each sample.
    pub lines: Vec<Vec<u8>>,
    /// What stands behind the last line.
    pub tail: Vec<u8>,
    /// Whether the last line has an end.
    pub ended: bool,
    /// Lines of it that are no sample, or none any more.
    pub lost: usize,
}

/// Numbers that are the same for the same seed.
#[derive(Clone, Debug)]
pub struct Draw(u64);

impl Draw {
    /// For this seed.
    pub fn new(seed: u64) -> Draw {
        Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03)
    }

    /// A number below this.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }

    /// A number from 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.below(1 << 24) as f64 / f64::from(1 << 24)
    }
}

/// One kind of damage.
pub struct Damage {
    /// What it is.
    pub name: &'static str,
    /// Does it.
    pub harm: fn(&mut LogText, &mut Draw),
    /// Whether it has to be told; what changes nothing that is read need not.
    pub told: bool,
}

impl LogText {
    /// The canonical log of some samples.
    pub fn of(samples: &[ImuSample]) -> LogText {
        let mut text = String::new();
        imu_csv::write(samples, true, &mut text);
        let mut lines = text.lines();
        let header = lines.next().unwrap_or_default().to_owned();
        let lines = lines.map(|line| line.as_bytes().to_vec()).collect();
        LogText { header, lines, tail: Vec::new(), ended: true, lost: 0 }
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.header.clone().into_bytes();
        for line in &self.lines {
            bytes.push(b'\n');
            bytes.extend_from_slice(line);
        }
        if self.ended {
            bytes.push(b'\n');
        }
        bytes.extend_from_slice(&self.tail);
        bytes
    }

    /// Reads it, in pieces as a disk gives them.
    ///
    /// # Errors
    ///
    /// What the reader says.
    pub fn read(&self) -> Result<(Vec<ImuSample>, Vec<Anomaly>), ParseError> {
        let (mut reader, mut samples) = (LogReader::new(ReadOptions::default()), Vec::new());
        for piece in self.bytes().chunks(65_536) {
            reader.push(piece, &mut samples)?;
        }
        reader.finish(&mut samples)?;
        Ok((samples, reader.anomalies()))
    }

    fn field(&self, at: usize, column: usize) -> String {
        let line = String::from_utf8_lossy(&self.lines[at]).into_owned();
        line.split(',').nth(column).unwrap_or_default().to_owned()
    }

    fn set_field(&mut self, at: usize, column: usize, value: &str) {
        let line = String::from_utf8_lossy(&self.lines[at]).into_owned();
        let mut fields: Vec<&str> = line.split(',').collect();
        if let Some(field) = fields.get_mut(column) {
            *field = value;
        }
        self.lines[at] = fields.join(",").into_bytes();
    }

    /// Changes the time of every line from one on.
    fn times(&mut self, from: usize, change: impl Fn(usize, f64) -> f64) {
        for at in from..self.lines.len() {
            // Times that are none any more stay as they are.
            if let Ok(t_s) = self.field(at, 0).parse::<f64>() {
                self.set_field(at, 0, &format!("{:.6}", change(at, t_s)));
            }
        }
    }

    /// A line somewhere after the start.
    fn somewhere(&self, draw: &mut Draw) -> usize {
        1 + draw.below(self.lines.len().saturating_sub(2))
    }
}

/// The kinds.
pub const DAMAGES: &[Damage] = &[
    Damage {
        name: "the last line cut",
        told: true,
        harm: |log, draw| {
            if let Some(last) = log.lines.last_mut() {
                last.truncate(1 + draw.below(last.len().saturating_sub(6)));
            }
            log.ended = false;
            log.lost += 1;
        },
    },
    Damage {
        name: "zeros at the end",
        told: true,
        harm: |log, draw| log.tail = vec![0; 1 + draw.below(60_000)],
    },
    Damage { name: "an end-of-file mark", told: true, harm: |log, _| log.tail.push(0x1A) },
    Damage {
        name: "an erased card's bytes at the end",
        told: true,
        harm: |log, draw| log.tail = vec![0xFF; 1 + draw.below(9_000)],
    },
    Damage {
        name: "zeros in the middle",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            let zeros = vec![0; 1 + draw.below(4_096)];
            let middle = log.lines[at].len() / 2;
            log.lines[at].splice(middle..middle, zeros);
            log.lost += 1;
        },
    },
    Damage {
        name: "a garbled line",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            log.lines[at] = (0..80).map(|_| b"#~x?\x80\xFE\x07}"[draw.below(8)]).collect();
            log.lost += 1;
        },
    },
    Damage {
        name: "garbled lines now and then",
        told: true,
        harm: |log, draw| {
            let every = 60 + draw.below(400);
            for at in (every..log.lines.len()).step_by(every) {
                log.lines[at] = b"ERR sensor busy".to_vec();
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "a byte that has changed",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            let byte = draw.below(log.lines[at].len());
            let changed = b"?#xz"[draw.below(4)];
            if let Some(byte) = log.lines[at].get_mut(byte) {
                *byte = changed;
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "a line feed that is gone",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            let next = log.lines.remove(at);
            log.lines[at - 1].extend(next);
            log.lost += 1;
        },
    },
    Damage {
        name: "a line that is there in two halves",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            let middle = log.lines[at].len() / 2;
            let rest = log.lines[at].split_off(middle);
            log.lines.insert(at + 1, rest);
            log.lost += 2;
        },
    },
    Damage {
        name: "messages of the recorder between the lines",
        told: true,
        harm: |log, draw| {
            for _ in 0..3 {
                let at = log.somewhere(draw);
                log.lines.insert(at, b"# battery low".to_vec());
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "rows without a value for lost packets",
        told: true,
        harm: |log, draw| {
            let every = 50 + draw.below(300);
            for at in (every..log.lines.len()).step_by(every) {
                let t_s = log.field(at, 0);
                log.lines[at] = format!("{t_s},,,,,,,,,,").into_bytes();
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "rows of zeros for lost packets",
        told: true,
        harm: |log, draw| {
            let every = 200 + draw.below(300);
            for at in (every..log.lines.len()).step_by(every) {
                log.lines[at] = b"0,0,0,0,0,0,0,0,0,0,0".to_vec();
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "a field that reads N/A now and then",
        told: false,
        harm: |log, draw| {
            let every = 5 + draw.below(30);
            for at in (every..log.lines.len()).step_by(every) {
                log.set_field(at, 7, "N/A");
            }
        },
    },
    Damage {
        name: "a pressure that is no number now and then",
        told: true,
        harm: |log, draw| {
            let every = 5 + draw.below(30);
            for at in (every..log.lines.len()).step_by(every) {
                log.set_field(at, 10, "#REF!");
            }
        },
    },
    Damage {
        name: "the names in the middle again",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            log.lines.insert(at, log.header.clone().into_bytes());
            log.lost += 1;
        },
    },
    Damage {
        name: "blank lines",
        told: false,
        harm: |log, draw| {
            for _ in 0..20 {
                let at = log.somewhere(draw);
                log.lines.insert(at, Vec::new());
                log.lost += 1;
            }
        },
    },
    Damage {
        name: "lines that end in returns and line feeds",
        told: false,
        harm: |log, _| log.lines.iter_mut().for_each(|line| line.push(b'\r')),
    },
    Damage {
        name: "a clock that is set back",
        told: true,
        harm: |log, draw| {
            let (from, by_s) = (log.somewhere(draw), 0.05 + 7_200.0 * draw.share());
            log.times(from, |_, t_s| t_s - by_s);
        },
    },
    Damage {
        name: "a clock that is set forward by days",
        told: true,
        harm: |log, draw| {
            let (from, by_s) = (log.somewhere(draw), 90_000.0 + 1.7e9 * draw.share());
            log.times(from, |_, t_s| t_s + by_s);
        },
    },
    Damage {
        name: "a clock that is set forward by an hour",
        told: true,
        harm: |log, draw| {
            let from = log.somewhere(draw);
            log.times(from, |_, t_s| t_s + 3_600.0);
        },
    },
    Damage {
        name: "a counter that wraps",
        told: true,
        harm: |log, draw| {
            let wraps_s = [2.56, 16.384, 10.0, 4.096][draw.below(4)];
            log.times(0, |_, t_s| t_s.rem_euclid(wraps_s));
        },
    },
    Damage {
        name: "single wrong times",
        told: true,
        harm: |log, draw| {
            let at = log.somewhere(draw);
            let wrong = ["0", "86400", "-5", "1764063000"][draw.below(4)];
            log.set_field(at, 0, wrong);
        },
    },
    Damage {
        name: "times cut to coarse steps",
        told: true,
        harm: |log, draw| {
            let step_s = [0.1, 0.25, 1.0, 0.0625][draw.below(4)];
            log.times(0, |_, t_s| (t_s / step_s).floor() * step_s);
        },
    },
    Damage {
        name: "times of arrival in packets",
        told: true,
        harm: |log, draw| {
            let packet = 3 + draw.below(6);
            log.times(0, |at, _| {
                let last = (at / packet) * packet + packet - 1;
                last as f64 * 0.01 + 0.001 * (at % packet) as f64
            });
        },
    },
    Damage {
        name: "times with a jitter",
        told: true,
        harm: |log, draw| {
            let mut noise = draw.clone();
            let jitter: Vec<f64> = (0..log.lines.len()).map(|_| 0.008 * (noise.share() - 0.5)).collect();
            log.times(0, |at, t_s| t_s + jitter[at]);
        },
    },
    Damage {
        name: "packets that changed places",
        told: true,
        harm: |log, draw| {
            for _ in 0..5 {
                let at = log.somewhere(draw);
                log.lines.swap(at, at - 1);
            }
        },
    },
    Damage {
        name: "rows that were written twice",
        // The walk tells it.
        told: false,
        harm: |log, draw| {
            for _ in 0..5 {
                let at = log.somewhere(draw);
                let again = log.lines[at].clone();
                log.lines.insert(at, again);
            }
        },
    },
    Damage {
        name: "a gap",
        told: false,
        harm: |log, draw| {
            let from = log.somewhere(draw);
            let count = (20 + draw.below(150)).min(log.lines.len() - from);
            log.lines.drain(from..from + count);
        },
    },
];
