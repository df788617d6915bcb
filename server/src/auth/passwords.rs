//! Passwords: argon2id, with the cost that the crate's authors hold for right today (19 MiB, two passes).

use std::fmt;
use std::sync::LazyLock;

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher, PasswordVerifier};
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::sync::Semaphore;

use crate::error::{Error, Result};

/// Letters of a password, at least; length is what counts, so nothing else is asked.
pub(crate) const SHORTEST: usize = 10;
/// Bytes of a password, at most: hashing takes time by length.
const LONGEST_BYTES: usize = 1_000;

/// Hashes worked out at once, each 19 MiB and most of a core for some 30 ms; more wait their turn.
static TURNS: Semaphore = Semaphore::const_new(2);

/// A password as it was typed. Its text appears in no log.
#[derive(Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
pub(crate) struct Password(#[schemars(example = &"a sentence that nobody else says")] String);

impl Password {
    /// Refuses one that is too short for an account of this name.
    pub(crate) fn checked(&self, name: &str) -> Result<()> {
        let letters = self.0.chars().count();
        if letters < SHORTEST || self.0.len() > LONGEST_BYTES {
            return Err(Error::invalid(
                "weak_password",
                format!(
                    "expected a password of {SHORTEST} letters or more (at most {LONGEST_BYTES} bytes), found {letters}: a sentence is a good one"
                ),
            ));
        }
        if is_weak(&self.0.to_lowercase(), &name.to_lowercase()) {
            return Err(Error::invalid(
                "weak_password",
                "expected a password that is not made of the account's name, of digits alone, of neighbours on the keyboard or of a few letters repeated: a sentence is a good one",
            ));
        }
        Ok(())
    }

    /// What is kept of it: a PHC string with salt and cost.
    pub(crate) async fn hash(self) -> Result<String> {
        let _turn = TURNS.acquire().await.expect("the turns are never closed");
        let hashed = tokio::task::spawn_blocking(move || hash(&self.0)).await;
        hashed.map_err(|error| Error::Internal(error.into()))?
    }

    /// Whether it is the one that was kept; where none was, the same work is done for nothing, so that the time tells
    /// nobody which names exist.
    pub(crate) async fn is(self, kept: Option<String>) -> Result<bool> {
        let _turn = TURNS.acquire().await.expect("the turns are never closed");
        let is = tokio::task::spawn_blocking(move || {
            let exists = kept.is_some();
            let kept = kept.unwrap_or_else(|| NOBODYS.clone());
            let long = self.0.len() > LONGEST_BYTES;
            let password = if long { "" } else { self.0.as_str() };
            let same = PasswordHash::new(&kept)
                .is_ok_and(|kept| Argon2::default().verify_password(password.as_bytes(), &kept).is_ok());
            exists && same && !long
        });
        is.await.map_err(|error| Error::Internal(error.into()))
    }
}

/// Rows of keys, and letters and digits in their order: what is along one of them in either direction is guessed first.
const NEIGHBOURS: [&str; 5] =
    ["abcdefghijklmnopqrstuvwxyz", "01234567890", "qwertyuiop", "asdfghjkl", "zxcvbnm"];

/// Whether a password, in lower case, is among those that are tried first.
fn is_weak(password: &str, name: &str) -> bool {
    // What is left of it without the name has to be a password of its own; a short name may be part of any word.
    let is_named =
        name.chars().count() >= 4 || password.starts_with(name) && password.len() < 2 * name.len() + 8;
    let rest = if is_named && !name.is_empty() { password.replace(name, "") } else { password.to_owned() };
    let letters: Vec<char> = rest.chars().collect();
    let different: std::collections::HashSet<&char> = letters.iter().collect();
    let are_neighbours = |pair: &[char]| {
        let found = |row: &&str| {
            let place = |letter: char| row.find(letter);
            place(pair[0]).zip(place(pair[1])).is_some_and(|(one, other)| one.abs_diff(other) <= 1)
        };
        pair[0] == pair[1] || NEIGHBOURS.iter().any(found)
    };
    let steps = letters.windows(2).filter(|pair| are_neighbours(pair)).count();
    letters.len() < 8
        || different.len() < 5
        || letters.iter().all(|letter| !letter.is_alphabetic()) && letters.len() < 16
        || 2 * steps > letters.len()
}

impl fmt::Debug for Password {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Password(…)")
    }
}

/// The hash of a password that nobody has.
static NOBODYS: LazyLock<String> =
    LazyLock::new(|| hash(super::Secret::random().text()).expect("argon2 hashes with its own defaults"));

fn hash(password: &str) -> Result<String> {
    let hash = Argon2::default()
        .hash_password(password.as_bytes())
        .map_err(|error| Error::Internal(anyhow::anyhow!("argon2 failed: {error}")))?;
    Ok(hash.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn password(text: &str) -> Password {
        Password(text.to_owned())
    }

    #[tokio::test]
    async fn a_password_is_known_again_and_another_is_not() {
        let kept = password("ein guter Satz 好").hash().await.unwrap();
        assert!(kept.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{kept}");
        assert!(password("ein guter Satz 好").is(Some(kept.clone())).await.unwrap());
        assert!(!password("ein guter Satz").is(Some(kept)).await.unwrap());
        assert!(!password("ein guter Satz").is(None).await.unwrap());
        assert!(!password("ein guter Satz").is(Some("damaged".to_owned())).await.unwrap());
    }

    #[tokio::test]
    async fn the_same_password_is_kept_differently_each_time() {
        let one = password("ein guter Satz").hash().await.unwrap();
        assert_ne!(one, password("ein guter Satz").hash().await.unwrap());
    }

    #[test]
    fn a_weak_password_is_refused_and_none_is_shown() {
        let long = "x".repeat(2_000);
        for weak in [
            "short",
            "aaaaaaaaaaaa",
            "ababababababab",
            "Wang Fang 1234",
            "1234567890",
            "0987654321",
            "2026-11-29",
            "qwertyuiop",
            "abcdefghij",
            "asdfghjkl;",
            &long,
        ] {
            assert!(password(weak).checked("wang fang").is_err(), "{weak}");
        }
        assert!(password("the lighthouse keeper 77").checked("li").is_ok());
        assert!(password("correct horse battery").checked("horse").is_ok());
        assert!(password("ein guter Satz").checked("wang fang").is_ok());
        assert_eq!(format!("{:?}", password("ein guter Satz")), "Password(…)");
    }
}
