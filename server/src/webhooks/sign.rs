//! The signature of a body: HMAC-SHA256 (RFC 2104) over its time and its text, so that an old one cannot be sent again.

use sha2::{Digest, Sha256};

/// Bytes that SHA-256 takes in at once.
const BLOCK: usize = 64;

/// What the header says: `t=` the time in whole seconds since 1970, `v1=` the HMAC of `{t}.{body}` in lower-case hex.
pub(super) fn signature(secret: &str, unix_s: i64, body: &str) -> String {
    let mac = hmac_sha256(secret.as_bytes(), format!("{unix_s}.{body}").as_bytes());
    let hex: String = mac.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("t={unix_s},v1={hex}")
}

fn hmac_sha256(key: &[u8], text: &[u8]) -> [u8; 32] {
    let mut block = [0; BLOCK];
    if key.len() > BLOCK {
        block[..32].copy_from_slice(&Sha256::digest(key));
    } else {
        block[..key.len()].copy_from_slice(key);
    }
    let inner = Sha256::new().chain_update(block.map(|byte| byte ^ 0x36)).chain_update(text).finalize();
    Sha256::new().chain_update(block.map(|byte| byte ^ 0x5c)).chain_update(inner).finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hex(bytes: [u8; 32]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// RFC 4231, cases 1, 2 and 6.
    #[test]
    fn the_mac_is_that_of_the_standard() {
        assert_eq!(
            hex(hmac_sha256(&[0x0b; 20], b"Hi There")),
            "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7"
        );
        assert_eq!(
            hex(hmac_sha256(b"Jefe", b"what do ya want for nothing?")),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"
        );
        assert_eq!(
            hex(hmac_sha256(&[0xaa; 131], b"Test Using Larger Than Block-Size Key - Hash Key First")),
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"
        );
    }

    #[test]
    fn another_time_or_another_body_has_another_signature() {
        let one = signature("secret", 1_764_000_000, "{}");
        assert!(one.starts_with("t=1764000000,v1="));
        assert_ne!(one[15..], signature("secret", 1_764_000_001, "{}")[15..]);
        assert_ne!(one, signature("secret", 1_764_000_000, "{ }"));
        assert_ne!(one, signature("other", 1_764_000_000, "{}"));
    }
}
