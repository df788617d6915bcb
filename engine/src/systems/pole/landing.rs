//! The tip on the ground: when it is taken to stand, what is measured then, and what becomes of a landing that does not stand.

use nalgebra::Vector3;

use super::aids::TIP;
use super::pass::{Runner, Setting};
use crate::event::AidOutcome;

/// A landing of which so many looks within a second are refused does not stand still.
const MOST_REFUSED: usize = 3;
/// A gate that lets nothing through: a measurement is only asked.
const ASKED_ONLY: f64 = -1.0;
/// A tip that is felt to stand is known not to move to this, m/s, when it has rung out.
const STANDS_M_S: f64 = 0.08;
/// What is left out of a landing that is felt, after its start and before its end, s: it begins when the pole has rung out, and
/// the lift's beginning is too slow to be felt.
const FELT_LESS_S: [f64; 2] = [0.05, 0.12];
/// Between two landings that are parted by less than this no step was made, ns.
const STEP_NS: i64 = 600_000_000;
/// A tip has settled so long after it has struck, ns.
const SETTLED_NS: i64 = 550_000_000;
/// What comes down again nearer than this has not slipped, m.
const LEAST_SLIP_M: f64 = 0.03;

/// What became of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Landing {
    pub(super) looks: usize,
    pub(super) refused: usize,
    pub(super) restless: bool,
    /// Whether it came down elsewhere than where it had stood less than a step before.
    pub(super) slipped_before: bool,
    /// The largest move that was seen, m.
    pub(super) moved_m: f64,
    /// Sum of the normalised innovations squared.
    pub(super) nis: f64,
    /// What the looks scattered by while the tip settled, and after that.
    pub(super) settling: [Scatter; 2],
}

/// By how much looks were off: squares in plan (of both axes) and height, m², and how many they were.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Scatter {
    pub(super) squares_m2: [f64; 2],
    pub(super) looks: usize,
}

impl Scatter {
    fn take(&mut self, off_m: &Vector3<f64>) {
        self.squares_m2[0] += off_m.xy().norm_squared();
        self.squares_m2[1] += off_m.z * off_m.z;
        self.looks += 1;
    }
}

impl Landing {
    /// Whether the tip slipped.
    pub(super) fn has_slipped(&self) -> bool {
        self.refused > 0 || self.slipped_before
    }

    /// As the outcome of an aid, but for its time; `None` where there was no look.
    pub(super) fn outcome(&self) -> Option<AidOutcome> {
        Some(AidOutcome {
            t_ns: 0,
            stream: None,
            aid: TIP,
            nis: self.nis / self.looks as f64,
            degrees_of_freedom: 3,
            updates: u32::try_from(self.looks).ok().filter(|looks| *looks > 0)?,
            accepted: !self.restless,
        })
    }
}

/// The tip on the ground.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    pub(super) contact: usize,
    looked_ns: i64,
    refused_ns: Vec<i64>,
}

impl Runner {
    /// The contact that holds now, less what is left out of it.
    pub(super) fn contact_now(&mut self, setting: &Setting<'_>) -> Option<usize> {
        let landing = &setting.tuning.landing;
        let [after_s, before_s] = match (setting.felt, setting.tuning.zero_velocity_m_s) {
            (true, None) => FELT_LESS_S,
            _ => [landing.after_strike_s, landing.before_lift_s],
        };
        let ns = |s: f64| (s * 1e9) as i64;
        let contacts = setting.contacts;
        while contacts.get(self.next_contact).is_some_and(|contact| contact.to_ns - ns(before_s) < self.t_ns)
        {
            self.next_contact += 1;
        }
        let contact = contacts.get(self.next_contact)?;
        let stands = contact.from_ns + ns(after_s) <= self.t_ns
            && !setting.restless[self.next_contact]
            && !self.pass.landings[self.next_contact].restless;
        stands.then_some(self.next_contact)
    }

    /// A tip that is off the ground for less than a step, and comes down elsewhere, has slipped: without a switch it is all that
    /// is felt of it.
    fn set_down_again(&mut self, setting: &Setting<'_>, contact: usize) {
        let Some(last) = self.landed.filter(|last| last + 1 == contact) else { return };
        let landing = &setting.tuning.landing;
        let apart_ns = setting.contacts[contact].from_ns - setting.contacts[last].to_ns;
        if apart_ns > STEP_NS || self.pass.landings[last].restless {
            return;
        }
        let Some(observation) = self.filter.stands(landing.sigma_m) else { return };
        let (nis, _) = self.filter.weigh(&observation, ASKED_ONLY);
        let moved_m = observation.innovation.norm();
        if nis > landing.gate && moved_m > LEAST_SLIP_M {
            let of = &mut self.pass.landings[contact];
            of.slipped_before = true;
            of.moved_m = of.moved_m.max(moved_m);
        }
    }

    /// Measures that the tip stands, where it does.
    pub(super) fn weigh_stand(&mut self, setting: &Setting<'_>) {
        let Some(contact) = self.contact_now(setting) else {
            self.standing = None;
            return;
        };
        if let Some(sigma_m_s) = setting.tuning.zero_velocity_m_s {
            self.standing = Some(Standing { contact, looked_ns: self.t_ns, refused_ns: Vec::new() });
            self.pass.landings[contact].looks += 1;
            if let Some(observation) = self.filter.has_no_velocity(setting.earth, &self.w_ib_b, sigma_m_s) {
                self.filter.weigh(&observation, f64::INFINITY);
            }
            return;
        }
        let landing = &setting.tuning.landing;
        let t_ns = self.t_ns;
        let new = self.standing.as_ref().is_none_or(|standing| standing.contact != contact);
        if new && setting.felt {
            let still = self.filter.has_no_velocity(setting.earth, &self.w_ib_b, STANDS_M_S);
            let nis = still.map_or(0.0, |still| self.filter.weigh(&still, ASKED_ONLY).0);
            if nis > landing.gate {
                self.pass.landings[contact].restless = true;
                self.walking.leave_out(contact);
                self.standing = None;
                return;
            }
        }
        if new {
            self.set_down_again(setting, contact);
            self.filter.land();
            self.landed = Some(contact);
            self.standing = Some(Standing { contact, looked_ns: t_ns, refused_ns: Vec::new() });
        }
        let Some(standing) = &mut self.standing else { return };
        let settles = t_ns - setting.contacts[contact].from_ns < SETTLED_NS;
        if !new {
            let dt_s = (t_ns - standing.looked_ns) as f64 * 1e-9;
            if setting.is_stirred(standing.looked_ns, t_ns) {
                self.filter.creep(landing.stirred_m, 1.0);
            }
            standing.looked_ns = t_ns;
            self.filter.creep(landing.creep_m_sqrt_s, dt_s);
            if settles {
                self.filter.creep(landing.settling_m_sqrt_s, dt_s);
            }
        }
        let Some(observation) = self.filter.stands(landing.sigma_m) else { return };
        let (nis, used) = self.filter.weigh(&observation, landing.gate);
        let of = &mut self.pass.landings[contact];
        of.looks += 1;
        of.nis += nis;
        if used {
            if !new {
                of.settling[usize::from(!settles)].take(&observation.innovation);
            }
            return;
        }
        of.refused += 1;
        of.moved_m = of.moved_m.max(observation.innovation.norm());
        standing.refused_ns.retain(|refused_ns| t_ns - refused_ns < 1_000_000_000);
        standing.refused_ns.push(t_ns);
        if standing.refused_ns.len() >= MOST_REFUSED {
            of.restless = true;
            self.walking.leave_out(contact);
            self.standing = None;
            return;
        }
        self.filter.land();
        if let Some(observation) = self.filter.stands(landing.sigma_m) {
            self.filter.weigh(&observation, f64::INFINITY);
        }
    }
}
