//! Names that people can tell apart: what cannot be seen is taken off, wide and other forms of a letter become the letter.

use unicode_normalization::UnicodeNormalization as _;
use unicode_security::confusable_detection::skeleton;

/// The name as it is kept: in Unicode's normal form of compatible letters, without what cannot be seen, with one blank
/// between its words.
pub fn cleaned(name: &str) -> String {
    let visible: String = name.nfkc().filter(|letter| !is_invisible(*letter)).collect();
    visible.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether a name can be reached by the address of an API: a path goes up or nowhere by dots.
pub fn is_dots(name: &str) -> bool {
    matches!(name, "." | "..")
}

/// What look-alikes have in common: two names that a person cannot tell apart have the same. Letters of other scripts,
/// case, and what parts words do not count, nor zeros that lead a number.
pub fn look(name: &str) -> String {
    let mut plain = String::new();
    let mut after_digit = false;
    for letter in cleaned(name).chars() {
        if letter.is_whitespace() || "-_.".contains(letter) || (letter == '0' && !after_digit) {
            continue;
        }
        after_digit = letter.is_ascii_digit();
        plain.push(letter);
    }
    // Case is folded on both sides of the comparison: a capital may look like another script's small letter.
    skeleton(&skeleton(&plain).collect::<String>().to_uppercase()).collect()
}

/// Letters of no width, marks of direction, selectors of variants, and code points that are no letters.
fn is_invisible(letter: char) -> bool {
    matches!(u32::from(letter),
        0x00AD | 0x034F | 0x061C | 0x115F..=0x1160 | 0x17B4..=0x17B5 | 0x180B..=0x180F | 0x200B..=0x200F
        | 0x202A..=0x202E | 0x2060..=0x206F | 0x2800 | 0x3164 | 0xFE00..=0xFE0F | 0xFEFF | 0xFFA0
        | 0xFFF0..=0xFFFB | 0xFFFE..=0xFFFF | 0xFDD0..=0xFDEF | 0xE000..=0xF8FF | 0xE0000..=0x10FFFF)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_cannot_be_seen_is_taken_off() {
        for (name, clean) in [
            ("Q17\u{200b}", "Q17"),
            ("Q\u{ad}17", "Q17"),
            ("\u{202e}Q71", "Q71"),
            ("\u{200b}", ""),
            ("Ｑ１７", "Q17"),
            (" A  1\u{3000}", "A 1"),
            ("促动器一号", "促动器一号"),
        ] {
            assert_eq!(cleaned(name), clean, "{name:?}");
        }
    }

    #[test]
    fn look_alikes_look_alike() {
        assert_eq!(look("А17"), look("A17"), "a Cyrillic letter");
        assert_eq!(look("b-12"), look("B012"));
        assert_eq!(look("O1"), look("０1".replace('０', "O").as_str()));
        assert_ne!(look("A17"), look("A18"));
        assert_ne!(look("B10"), look("B1"));
        assert_ne!(look("测点一"), look("测点二"));
    }

    proptest! {
        #[test]
        fn a_clean_name_stays_as_it_is(name in "\\PC{0,30}") {
            let clean = cleaned(&name);
            prop_assert_eq!(cleaned(&clean), clean.clone());
            prop_assert_eq!(look(&clean), look(&name));
        }
    }
}
