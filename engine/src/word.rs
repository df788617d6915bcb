//! A short word that a system declares: the kind of an anomaly, an aid. Small enough to be copied about in events.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};

use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};

/// The longest word, bytes.
const MOST_BYTES: usize = 24;

/// Lower-case letters, digits and `_`. Two words are the same by their letters; lists of them are in the order in which
/// they were declared, and words read from elsewhere come last, by the alphabet.
#[derive(Clone, Copy)]
pub struct Word {
    text: [u8; MOST_BYTES],
    length: u8,
    order: u8,
}

impl Word {
    /// A word that is number `order` of those declared.
    ///
    /// # Panics
    ///
    /// Where it is no such word, or longer than 24 bytes: while compiling, for a constant.
    pub const fn declared(word: &str, order: u8) -> Word {
        match Word::checked(word.as_bytes(), order) {
            Some(word) => word,
            None => panic!("a word is 1 to 24 lower-case letters, digits and underscores"),
        }
    }

    /// A word read from elsewhere; `None` where it is none.
    pub const fn read(word: &str) -> Option<Word> {
        Word::checked(word.as_bytes(), u8::MAX)
    }

    const fn checked(bytes: &[u8], order: u8) -> Option<Word> {
        if bytes.is_empty() || bytes.len() > MOST_BYTES {
            return None;
        }
        let mut text = [0; MOST_BYTES];
        let mut at = 0;
        while at < bytes.len() {
            let byte = bytes[at];
            if !(byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_') {
                return None;
            }
            text[at] = byte;
            at += 1;
        }
        Some(Word { text, length: bytes.len() as u8, order })
    }

    /// Its letters.
    pub fn as_str(&self) -> &str {
        // Only ASCII goes in.
        std::str::from_utf8(&self.text[..usize::from(self.length)]).unwrap_or_default()
    }
}

impl PartialEq for Word {
    fn eq(&self, other: &Word) -> bool {
        self.text == other.text
    }
}

impl Eq for Word {}

impl Hash for Word {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.text.hash(state);
    }
}

impl Ord for Word {
    fn cmp(&self, other: &Word) -> Ordering {
        if self == other {
            return Ordering::Equal;
        }
        self.order.cmp(&other.order).then_with(|| self.text.cmp(&other.text))
    }
}

impl PartialOrd for Word {
    fn partial_cmp(&self, other: &Word) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Debug for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl Serialize for Word {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() {
            return to.serialize_str(self.as_str());
        }
        // A saved state goes on in the order that was declared.
        (self.as_str(), self.order).serialize(to)
    }
}

impl<'de> Deserialize<'de> for Word {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Word, D::Error> {
        let (text, order) = if from.is_human_readable() {
            (String::deserialize(from)?, u8::MAX)
        } else {
            <(String, u8)>::deserialize(from)?
        };
        Word::checked(text.as_bytes(), order).ok_or_else(|| {
            D::Error::custom(format!(
                "expected a word of 1 to 24 lower-case letters, digits and underscores, found {text:?}"
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_from_json_and_keep_their_declared_order() {
        let (first, second) = (Word::declared("zupt", 0), Word::declared("heading", 1));
        assert!(first < second && second < Word::read("a_word").unwrap());
        assert_eq!(Word::read("zupt"), Some(first));
        let read: Word = serde_json::from_str(&serde_json::to_string(&first).unwrap()).unwrap();
        assert_eq!(read, first);
        let bytes = postcard::to_allocvec(&[first, second]).unwrap();
        let saved: [Word; 2] = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(saved, [first, second]);
        assert!(saved[0] < saved[1]);
        for wrong in ["", "Zupt", "two words", "a_word_that_is_longer_than_24"] {
            assert_eq!(Word::read(wrong), None, "{wrong:?}");
            assert!(serde_json::from_value::<Word>(wrong.into()).is_err(), "{wrong:?}");
        }
    }
}
