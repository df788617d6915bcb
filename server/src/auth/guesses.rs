//! How many passwords may be tried: by account and by address, so that guessing leads nowhere.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// Wrong passwords for one account before it has to wait.
const FREE_FOR_AN_ACCOUNT: u32 = 5;
/// Wrong passwords from one address before it has to wait; more people may share an address.
const FREE_FROM_AN_ADDRESS: u32 = 20;
/// The first wait; each further wrong password doubles it.
const FIRST_WAIT: Duration = Duration::from_secs(10);
/// The longest wait.
const LONGEST_WAIT: Duration = Duration::from_secs(15 * 60);
/// After so long without a wrong password all is forgotten.
const FORGOTTEN_AFTER: Duration = Duration::from_secs(60 * 60);
/// Names and addresses that are remembered; the oldest are let go of first.
const MOST_REMEMBERED: usize = 20_000;

/// The wrong passwords of late.
#[derive(Debug, Default)]
pub(crate) struct Guesses {
    by: Mutex<HashMap<String, Wrong>>,
}

#[derive(Clone, Copy, Debug)]
struct Wrong {
    times: u32,
    last: Instant,
}

impl Wrong {
    /// Until when the next try has to wait.
    fn waits_until(self, free: u32) -> Option<Instant> {
        let over = self.times.checked_sub(free)?;
        let wait = FIRST_WAIT.saturating_mul(1_u32.checked_shl(over.min(16)).unwrap_or(u32::MAX));
        Some(self.last + wait.min(LONGEST_WAIT))
    }
}

impl Guesses {
    /// Counts a try before the password is looked at: tries that come side by side are all counted. Refuses one that
    /// has to wait, whether its password is right or not.
    ///
    /// From where somebody has signed in to the account before (`is_known`) only what was tried from there counts: nobody else
    /// can keep its owner out.
    pub(crate) fn count_try(
        &self,
        account: &str,
        (address, is_known): (&str, bool),
        now: Instant,
    ) -> Result<()> {
        let keys = keys(account, address, is_known);
        let mut by = self.by.lock().expect("nobody panics while counting");
        for (key, free) in &keys {
            let wrong = by.get(key).filter(|wrong| now < wrong.last + FORGOTTEN_AFTER);
            if let Some(until) = wrong.and_then(|wrong| wrong.waits_until(*free)).filter(|until| now < *until)
            {
                let seconds = until.duration_since(now).as_secs() + 1;
                return Err(Error::TooMany {
                    code: "too_many_guesses",
                    detail: format!("there were too many wrong passwords: try again in {seconds} s"),
                    retry_after_s: seconds,
                });
            }
        }
        if by.len() >= MOST_REMEMBERED {
            forget_the_oldest(&mut by, now);
        }
        for (key, _) in keys {
            let wrong = by.entry(key).or_insert(Wrong { times: 0, last: now });
            if now >= wrong.last + FORGOTTEN_AFTER {
                wrong.times = 0;
            }
            *wrong = Wrong { times: wrong.times.saturating_add(1), last: now };
        }
        Ok(())
    }

    /// The password was right: the account starts afresh, and its try does not count against the address.
    pub(crate) fn right(&self, account: &str, (address, is_known): (&str, bool)) {
        let [(account, _), (address, _)] = keys(account, address, is_known);
        let mut by = self.by.lock().expect("nobody panics while counting");
        by.remove(&account);
        if let Some(wrong) = by.get_mut(&address) {
            wrong.times = wrong.times.saturating_sub(1);
        }
    }
}

fn keys(account: &str, address: &str, is_known: bool) -> [(String, u32); 2] {
    let account =
        if is_known { format!("account {account} from {address}") } else { format!("account {account}") };
    [(account, FREE_FOR_AN_ACCOUNT), (format!("address {address}"), FREE_FROM_AN_ADDRESS)]
}

fn forget_the_oldest(by: &mut HashMap<String, Wrong>, now: Instant) {
    by.retain(|_, wrong| now < wrong.last + FORGOTTEN_AFTER);
    if by.len() < MOST_REMEMBERED {
        return;
    }
    let mut ages: Vec<Instant> = by.values().map(|wrong| wrong.last).collect();
    ages.sort_unstable();
    let middle = ages[ages.len() / 2];
    by.retain(|_, wrong| wrong.last > middle);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tries until a point in time, one a second; how many were let through to the password.
    fn tries(guesses: &Guesses, account: impl Fn(u64) -> String, seconds: u64, from: Instant) -> u64 {
        (0..seconds)
            .filter(|&s| {
                guesses.count_try(&account(s), ("10.0.0.9", false), from + Duration::from_secs(s)).is_ok()
            })
            .count() as u64
    }

    #[test]
    fn a_thousand_guesses_at_one_account_are_let_through_a_dozen_times() {
        let let_through = tries(&Guesses::default(), |_| "li wei".to_owned(), 1_000, Instant::now());
        assert!((6..=12).contains(&let_through), "{let_through}");
    }

    #[test]
    fn guesses_at_many_accounts_from_one_address_wait_too() {
        let let_through = tries(&Guesses::default(), |s| format!("name {s}"), 1_000, Instant::now());
        assert!((20..=30).contains(&let_through), "{let_through}");
    }

    #[test]
    fn somebody_elsewhere_with_another_account_does_not_wait() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        tries(&guesses, |_| "li wei".to_owned(), 100, now);
        assert!(guesses.count_try("wang fang", ("10.0.0.10", false), now + Duration::from_secs(100)).is_ok());
    }

    #[test]
    fn nobody_keeps_the_owner_of_an_account_out_from_where_that_has_signed_in_before() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        tries(&guesses, |_| "li wei".to_owned(), 600, now);
        let later = now + Duration::from_secs(600);
        assert!(guesses.count_try("li wei", ("10.0.0.10", false), later).is_err());
        assert!(guesses.count_try("li wei", ("10.0.0.10", true), later).is_ok());
        // Who guesses there waits all the same.
        let there =
            |s| guesses.count_try("li wei", ("10.0.0.10", true), later + Duration::from_secs(s)).is_ok();
        assert!((0..1_000).filter(|&s| there(s)).count() <= 12);
    }

    #[test]
    fn a_right_password_makes_the_account_start_afresh() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        for _ in 0..50 {
            guesses.count_try("li wei", ("10.0.0.9", false), now).unwrap();
            guesses.right("li wei", ("10.0.0.9", false));
        }
    }

    #[test]
    fn what_is_remembered_stays_bounded() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        for n in 0..50_000_u64 {
            let (name, address) = (format!("name {n}"), format!("address {n}"));
            let _ = guesses.count_try(&name, (&address, false), now + Duration::from_millis(n));
        }
        assert!(guesses.by.lock().unwrap().len() <= MOST_REMEMBERED + 2);
    }
}
