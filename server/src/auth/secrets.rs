//! Secrets of cookies and tokens: long and random, shown once, kept as a hash only.

use std::fmt;

use sha2::{Digest, Sha256};

/// Bytes of chance in a secret; nobody guesses 256 bits.
const BYTES: usize = 32;

/// A secret as its owner holds it. Its text appears in no log.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Secret(String);

impl Secret {
    /// A new one.
    pub(crate) fn random() -> Secret {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).expect("the system gives random bytes");
        Secret(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// One that was sent; `None` when it cannot be one of ours.
    pub(crate) fn sent(text: &str) -> Option<Secret> {
        let ours = text.len() == 2 * BYTES && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        ours.then(|| Secret(text.to_ascii_lowercase()))
    }

    /// As it is handed to its owner.
    pub(crate) fn text(&self) -> &str {
        &self.0
    }

    /// What is kept of it, and looked up by. A lookup by the hash tells nothing by its duration: who does not know
    /// the secret cannot choose the hash.
    pub(crate) fn sha256(&self) -> [u8; 32] {
        Sha256::digest(self.0.as_bytes()).into()
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_do_not_show_in_debug_output() {
        let (one, other) = (Secret::random(), Secret::random());
        assert_ne!(one, other);
        assert_ne!(one.sha256(), other.sha256());
        assert!(!format!("{one:?}").contains(one.text()));
        assert_eq!(Secret::sent(one.text()), Some(one));
    }

    #[test]
    fn what_cannot_be_a_secret_is_none() {
        for text in ["", "abc", &"g".repeat(64), &"a".repeat(63), &"é".repeat(32)] {
            assert_eq!(Secret::sent(text), None, "{text}");
        }
    }
}
