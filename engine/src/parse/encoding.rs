//! Bytes of a log as text in UTF-8 with line feeds, whatever a spreadsheet made of it. Nearly all logs pass as they are.

use std::borrow::Cow;

/// Bytes by which the encoding is told.
const JUDGED_BY: usize = 64;

/// Decodes bytes that come in pieces of any size.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    state: State,
}

#[derive(Default)]
enum State {
    /// Too few bytes have come.
    #[default]
    Unknown,
    Held(Vec<u8>),
    AsIs,
    Utf16(Box<encoding_rs::Decoder>),
}

impl std::fmt::Debug for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            State::Unknown | State::Held(_) => "Unknown",
            State::AsIs => "AsIs",
            State::Utf16(_) => "Utf16",
        })
    }
}

impl Decoder {
    /// What these bytes say, as far as they are whole characters.
    pub(super) fn push<'a>(&mut self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        match &mut self.state {
            State::AsIs => return Cow::Borrowed(bytes),
            State::Utf16(decoder) => return Cow::Owned(decoded(decoder, bytes, false)),
            State::Unknown if bytes.len() >= JUDGED_BY => {
                self.state = judged(bytes);
                return self.push(bytes);
            }
            State::Unknown => self.state = State::Held(bytes.to_vec()),
            State::Held(held) => {
                held.extend_from_slice(bytes);
            }
        }
        match &mut self.state {
            State::Held(held) if held.len() >= JUDGED_BY => {
                let held = std::mem::take(held);
                self.state = judged(&held);
                Cow::Owned(self.push(&held).into_owned())
            }
            _ => Cow::Borrowed(&[]),
        }
    }

    /// What is left at the end.
    pub(super) fn finish(self) -> Vec<u8> {
        match self.state {
            State::Held(held) => match judged(&held) {
                State::Utf16(mut decoder) => decoded(&mut decoder, &held, true),
                _ => held,
            },
            State::Utf16(mut decoder) => decoded(&mut decoder, &[], true),
            State::Unknown | State::AsIs => Vec::new(),
        }
    }
}

fn judged(head: &[u8]) -> State {
    match utf16(head) {
        Some(encoding) => State::Utf16(Box::new(encoding.new_decoder_with_bom_removal())),
        None => State::AsIs,
    }
}

/// UTF-16 with its mark, or without it as every other byte of a Latin text says.
pub(super) fn utf16(head: &[u8]) -> Option<&'static encoding_rs::Encoding> {
    match head {
        [0xFF, 0xFE, ..] => return Some(encoding_rs::UTF_16LE),
        [0xFE, 0xFF, ..] => return Some(encoding_rs::UTF_16BE),
        _ => {}
    }
    let pairs = head.len().min(JUDGED_BY) / 2;
    let zeros = |at: usize| head.chunks_exact(2).take(pairs).filter(|pair| pair[at] == 0).count();
    match (zeros(0), zeros(1)) {
        (0, second) if pairs >= 8 && second * 4 >= pairs * 3 => Some(encoding_rs::UTF_16LE),
        (first, 0) if pairs >= 8 && first * 4 >= pairs * 3 => Some(encoding_rs::UTF_16BE),
        _ => None,
    }
}

/// Text that is neither UTF-8 nor UTF-16: Chinese in GBK, or western letters. Chinese letters are two bytes each and stand
/// together; a degree, a micro or an umlaut stands alone. `None` where it is neither.
pub(super) fn legacy(bytes: &[u8]) -> Option<&'static encoding_rs::Encoding> {
    let (mut alone, mut together) = (0, 0);
    for run in bytes.split(|byte| byte.is_ascii()).filter(|run| !run.is_empty()) {
        if run.len() == 1 { alone += 1 } else { together += 1 }
    }
    if alone > together {
        return Some(encoding_rs::WINDOWS_1252);
    }
    let gbk = encoding_rs::GBK.decode_without_bom_handling_and_without_replacement(bytes);
    gbk.map(|_| encoding_rs::GBK)
}

fn decoded(decoder: &mut encoding_rs::Decoder, bytes: &[u8], last: bool) -> Vec<u8> {
    let room = decoder.max_utf8_buffer_length(bytes.len()).unwrap_or(bytes.len() * 3 + 16);
    let mut out = vec![0; room];
    let (_, _, written, _) = decoder.decode_to_utf8(bytes, &mut out, last);
    out.truncate(written);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chinese_and_western_text_without_a_mark_are_told_apart() {
        for (text, encoding) in [
            ("加速度X(g),角速度X(°/s)", encoding_rs::GBK),
            ("点号,X(北),Y(东)", encoding_rs::GBK),
            ("GYROSCOPE X (°/s),MAGNETIC FIELD X (µT),ACC (m/s²)", encoding_rs::WINDOWS_1252),
            ("Drehrate längs,Höhe", encoding_rs::WINDOWS_1252),
        ] {
            let (bytes, _, unmappable) = encoding.encode(text);
            assert!(!unmappable);
            assert_eq!(legacy(&bytes), Some(encoding), "{text}");
        }
        assert_eq!(legacy(b"\xFF\xFFx"), None);
    }
}
