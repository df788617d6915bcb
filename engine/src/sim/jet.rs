//! A number that changes in time, known with its first two derivatives. Whatever is computed from
//! jets has exact rates and accelerations, with no formula differentiated by hand but the few here.

use std::ops::{Add, Mul, Sub};

/// A value and its first and second derivatives in time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// Its first derivative, 1/s.
    pub rate: f64,
    /// Its second derivative, 1/s².
    pub acceleration: f64,
}

impl Jet {
    /// The time itself, s.
    pub const fn time(t_s: f64) -> Jet {
        Jet { value: t_s, rate: 1.0, acceleration: 0.0 }
    }

    /// A value that does not change.
    pub const fn constant(value: f64) -> Jet {
        Jet { value, rate: 0.0, acceleration: 0.0 }
    }

    /// How far a time lies between two others: 0 at the first, 1 at the second.
    pub fn progress(t_s: f64, from_s: f64, to_s: f64) -> Jet {
        let rate = 1.0 / (to_s - from_s);
        Jet { value: (t_s - from_s) * rate, rate, acceleration: 0.0 }
    }

    /// The same for a jet between two values: the progress within a part of a whole.
    pub fn within(self, from: f64, to: f64) -> Jet {
        (self - Jet::constant(from)) * (1.0 / (to - from))
    }

    fn chain(self, value: f64, first: f64, second: f64) -> Jet {
        Jet {
            value,
            rate: first * self.rate,
            acceleration: second * self.rate * self.rate + first * self.acceleration,
        }
    }

    /// Sine and cosine of an angle, rad.
    pub fn sin_cos(self) -> (Jet, Jet) {
        let (sin, cos) = libm::sincos(self.value);
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }

    /// From 0 to 1 as the jet goes from 0 to 1, with two derivatives zero at both ends.
    pub fn ramp(self) -> Jet {
        let x = self.value;
        if x <= 0.0 {
            return Jet::constant(0.0);
        }
        if x >= 1.0 {
            return Jet::constant(1.0);
        }
        let w = x * (1.0 - x);
        self.chain(x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * w * w, 60.0 * w * (1.0 - 2.0 * x))
    }

    /// Like [`Jet::ramp`] with a steadier speed in between: its peak is 1.46 of its mean, not 1.88,
    /// as a swinging foot's is.
    pub fn glide(self) -> Jet {
        if self.value <= 0.0 {
            return Jet::constant(0.0);
        }
        if self.value >= 1.0 {
            return Jet::constant(1.0);
        }
        // Speed ∝ (1 − y²)²(1 + 2y²) = 1 − 3y⁴ + 2y⁶ on −1 < y < 1.
        const AREA: f64 = 48.0 / 35.0;
        let y = 2.0 * self.value - 1.0;
        let (y2, y3) = (y * y, y * y * y);
        let y4 = y2 * y2;
        self.chain(
            0.5 + (y - 0.6 * y4 * y + 2.0 / 7.0 * y4 * y3) / AREA,
            2.0 * (1.0 - 3.0 * y4 + 2.0 * y4 * y2) / AREA,
            48.0 * y3 * (y2 - 1.0) / AREA,
        )
    }

    /// From 0 through 1 in the middle back to 0, with two derivatives zero at both ends.
    pub fn bump(self) -> Jet {
        let x = self.value;
        if x <= 0.0 || x >= 1.0 {
            return Jet::constant(0.0);
        }
        let (w, slope) = (x * (1.0 - x), 1.0 - 2.0 * x);
        self.chain(64.0 * w * w * w, 192.0 * w * w * slope, 384.0 * w * (slope * slope - w))
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        Jet {
            value: self.value + other.value,
            rate: self.rate + other.rate,
            acceleration: self.acceleration + other.acceleration,
        }
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        self + other * -1.0
    }
}

impl Mul for Jet {
    type Output = Jet;
    fn mul(self, other: Jet) -> Jet {
        Jet {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            acceleration: self.acceleration * other.value
                + 2.0 * self.rate * other.rate
                + self.value * other.acceleration,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Jet;
    fn mul(self, factor: f64) -> Jet {
        Jet { value: self.value * factor, rate: self.rate * factor, acceleration: self.acceleration * factor }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_has_the_derivatives_it_claims() {
        type Function = fn(Jet) -> Jet;
        let functions: [(&str, Function); 6] = [
            ("ramp", Jet::ramp),
            ("glide", Jet::glide),
            ("bump", Jet::bump),
            ("sin", |x| x.sin_cos().0),
            ("cos", |x| x.sin_cos().1),
            ("product", |x| x.ramp() * x.sin_cos().1),
        ];
        // A curved argument, so that the chain rule's both terms count.
        let argument = |t: f64| {
            let t = Jet::time(t);
            t * t * 0.3 + t * 0.4
        };
        let h = 1e-5;
        for (name, function) in functions {
            for i in 1..20 {
                let t = 0.06 * f64::from(i);
                let [before, at, after] = [t - h, t, t + h].map(|t| function(argument(t)));
                let rate = (after.value - before.value) / (2.0 * h);
                let acceleration = (after.rate - before.rate) / (2.0 * h);
                assert!((rate - at.rate).abs() < 1e-8, "{name} at {t}: rate {} is {rate}", at.rate);
                assert!((acceleration - at.acceleration).abs() < 1e-7, "{name} at {t}");
            }
        }
    }

    #[test]
    fn shapes_begin_and_end_at_rest() {
        for shape in [Jet::ramp, Jet::glide, Jet::bump] {
            for end in [1e-6, 1.0 - 1e-6] {
                let jet = shape(Jet { value: end, rate: 1.0, acceleration: 0.0 });
                assert!(jet.rate.abs() < 1e-9 && jet.acceleration.abs() < 1e-3, "{jet:?}");
            }
        }
        assert_eq!(Jet::constant(0.5).bump().value, 1.0);
        assert!((Jet::constant(1.0 - 1e-12).glide().value - 1.0).abs() < 1e-12);
    }
}
