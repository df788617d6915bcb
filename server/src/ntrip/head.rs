//! What is asked of a caster, and how its answer begins.

use std::fmt::Write as _;

use super::source::Source;

/// The longest head of an answer, bytes.
const LONGEST: usize = 16 << 10;

/// An answer, as far as it has come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Its head is not complete.
    Wait,
    /// Data follow from this byte on.
    Data(usize),
    /// It will not send, in a sentence.
    Refused(String),
}

/// The request for a source's mount point: NTRIP 1, which all casters speak, and which sends data as they are.
pub(super) fn request(source: &Source) -> Option<String> {
    let mount = source.mount.as_ref()?;
    let mut text = format!(
        "GET /{mount} HTTP/1.0\r\nHost: {}\r\nUser-Agent: NTRIP lodestep/{}\r\nAccept: */*\r\n",
        source.address,
        env!("CARGO_PKG_VERSION")
    );
    if let Some(credentials) = &source.credentials {
        let _ = write!(text, "Authorization: Basic {}\r\n", base64(credentials.as_bytes()));
    }
    text.push_str("Connection: close\r\n\r\n");
    Some(text)
}

/// Looks at how an answer begins.
pub fn read(bytes: &[u8]) -> Answer {
    let Some(end) = bytes.windows(2).position(|pair| pair == b"\r\n") else {
        let odd =
            bytes.len() > LONGEST || bytes.iter().any(|byte| !(b' '..=b'~').contains(byte) && *byte != b'\r');
        return if odd { Answer::Refused(no_caster(bytes)) } else { Answer::Wait };
    };
    let first = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let mut words = first.split_whitespace();
    let protocol = words.next().unwrap_or_default();
    let status = words.next().and_then(|word| word.parse::<u16>().ok());
    match (protocol, status) {
        // NTRIP 1: data follow at once, or behind an empty line.
        ("ICY", Some(200)) => match &bytes[end + 2..] {
            [] | b"\r" => Answer::Wait,
            [b'\r', b'\n', ..] => Answer::Data(end + 4),
            _ => Answer::Data(end + 2),
        },
        ("SOURCETABLE", _) => Answer::Refused(
            "the caster has no such mount point and sent its list instead: correct the name behind the /"
                .to_owned(),
        ),
        ("ERROR", _) => {
            Answer::Refused(format!("the caster said {first:?}: check mount point, user and password"))
        }
        (http, Some(200)) if http.starts_with("HTTP/") => {
            let Some(head) = bytes.windows(4).position(|four| four == b"\r\n\r\n") else {
                return if bytes.len() > LONGEST { Answer::Refused(no_caster(bytes)) } else { Answer::Wait };
            };
            let lines = String::from_utf8_lossy(&bytes[..head]).to_ascii_lowercase();
            if lines.contains("gnss/sourcetable") {
                return Answer::Refused(
                    "the caster has no such mount point and sent its list instead: correct the name behind the /"
                        .to_owned(),
                );
            }
            if lines.contains("transfer-encoding: chunked") {
                return Answer::Refused(
                    "the caster sends in chunks, which NTRIP 1 does not have: use its NTRIP 1 port"
                        .to_owned(),
                );
            }
            Answer::Data(head + 4)
        }
        (http, Some(status)) if http.starts_with("HTTP/") || http == "ICY" => Answer::Refused(match status {
            401 => "the caster does not accept user and password (401): check both".to_owned(),
            403 => {
                "the caster lets this user not in (403): it may have banned an eager client; ask its operator"
                    .to_owned()
            }
            404 => "the caster has no such mount point (404): correct the name behind the /".to_owned(),
            429 | 503 => format!(
                "the caster is too busy or bans eager clients ({status}): it is asked again, ever less often"
            ),
            _ => format!("the caster said {first:?}: ask its operator"),
        }),
        _ => Answer::Refused(no_caster(bytes)),
    }
}

fn no_caster(bytes: &[u8]) -> String {
    let shown: String = String::from_utf8_lossy(&bytes[..bytes.len().min(24)])
        .chars()
        .flat_map(char::escape_default)
        .collect();
    format!("expected a caster's answer, found \"{shown}\": check host and port")
}

/// As headers carry credentials (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let of = |k: usize| u32::from(three.get(k).copied().unwrap_or(0));
        let number = of(0) << 16 | of(1) << 8 | of(2);
        for k in 0..4 {
            let letter = LETTERS[(number >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_request_carries_user_and_password_as_the_standard_s_examples_do() {
        assert_eq!(
            ["", "f", "fo", "foo", "foob"].map(|text| base64(text.as_bytes())),
            ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]
        );
        let text = request(&"ntrip://Aladdin:open sesame@h/M".replace(' ', "_").parse().unwrap()).unwrap();
        assert!(text.starts_with("GET /M HTTP/1.0\r\n") && text.ends_with("\r\n\r\n"), "{text}");
        assert!(text.contains("Authorization: Basic QWxhZGRpbjpvcGVuX3Nlc2FtZQ==\r\n"), "{text}");
        assert_eq!(request(&"tcp://h:1".parse().unwrap()), None);
    }

    #[test]
    fn answers_are_told_apart_wherever_they_are_cut() {
        for (text, data) in [
            ("ICY 200 OK\r\n\r\n\u{13}", 14),
            ("ICY 200 OK\r\n!", 12),
            ("HTTP/1.1 200 OK\r\nContent-Type: gnss/data\r\n\r\n!", 44),
        ] {
            assert_eq!(read(text.as_bytes()), Answer::Data(data), "{text:?}");
            for cut in 0..11 {
                assert_eq!(read(&text.as_bytes()[..cut]), Answer::Wait, "{text:?} {cut}");
            }
        }
        for (text, said) in [
            ("SOURCETABLE 200 OK\r\n", "no such mount point"),
            ("HTTP/1.1 401 Unauthorized\r\n", "user and password"),
            ("HTTP/1.1 403 Forbidden\r\n", "banned"),
            ("HTTP/1.0 404 Not Found\r\n", "no such mount point"),
            ("HTTP/1.1 429 Too Many\r\n", "bans"),
            ("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", "NTRIP 1"),
            ("HTTP/1.1 200 OK\r\nContent-Type: gnss/sourcetable\r\n\r\n", "no such mount point"),
            ("ERROR - Bad Password\r\n", "Bad Password"),
            ("SSH-2.0-OpenSSH_9.6\r\n", "host and port"),
            ("\u{0}\u{1}", "host and port"),
        ] {
            let Answer::Refused(sentence) = read(text.as_bytes()) else { panic!("{text:?}") };
            assert!(sentence.contains(said), "{text:?}: {sentence}");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_answers_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), start in prop::sample::select(vec!["", "ICY 200 OK\r\n", "HTTP/1.1 200 OK\r\n", "HTTP/1.1 "])) {
            let _ = read(&[start.as_bytes(), &bytes].concat());
        }
    }
}
