//! Where bytes come from, as people write it.

use std::fmt;
use std::str::FromStr;

/// `ntrip://user:password@host:port/MOUNT` or `tcp://host:port`.
#[derive(Clone, PartialEq, Eq)]
pub struct Source {
    /// Host and port.
    pub(super) address: String,
    /// The caster's mount point; `None` for plain TCP.
    pub(super) mount: Option<String>,
    /// User and password, as they are written.
    pub(super) credentials: Option<String>,
}

/// Of an NTRIP caster where no port is written.
const USUAL_PORT: u16 = 2101;

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Source, String> {
        let wrong = |why: &str| {
            format!(
                "expected ntrip://user:password@host:port/MOUNT or tcp://host:port, found {why}: write the source so"
            )
        };
        let (scheme, rest) = text.split_once("://").ok_or_else(|| wrong("no scheme"))?;
        if rest.chars().any(|c| c.is_whitespace() || c.is_control()) {
            return Err(wrong("a blank"));
        }
        let (place, mount) = match rest.split_once('/') {
            Some((place, mount)) => (place, mount.trim_end_matches('/')),
            None => (rest, ""),
        };
        // A password may hold an @, a host cannot.
        let (credentials, host) = match place.rsplit_once('@') {
            Some((credentials, host)) => (Some(credentials.to_owned()), host),
            None => (None, place),
        };
        let has_port = host
            .rsplit_once(':')
            .is_some_and(|(name, port)| !name.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0));
        if host.is_empty() || (host.contains(':') && !has_port && !host.ends_with(']')) {
            return Err(wrong("no host"));
        }
        match scheme {
            "ntrip" if mount.is_empty() => Err(wrong("no mount point")),
            "ntrip" => {
                let address = if has_port { host.to_owned() } else { format!("{host}:{USUAL_PORT}") };
                Ok(Source { address, mount: Some(mount.to_owned()), credentials })
            }
            "tcp" if !mount.is_empty() || credentials.is_some() => Err(wrong("more than host and port")),
            "tcp" if !has_port => Err(wrong("no port")),
            "tcp" => Ok(Source { address: host.to_owned(), mount: None, credentials: None }),
            _ => Err(wrong("another scheme")),
        }
    }
}

/// Without the password.
impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mount {
            Some(mount) => write!(f, "ntrip://{}/{mount}", self.address),
            None => write!(f, "tcp://{}", self.address),
        }
    }
}

/// The same: who logs it must not tell the password.
impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_read_and_never_show_their_password() {
        let source: Source = "ntrip://me:p@ss@caster.example/BASE1".parse().unwrap();
        assert_eq!(source.credentials.as_deref(), Some("me:p@ss"));
        assert_eq!(
            format!("{source} {source:?}"),
            "ntrip://caster.example:2101/BASE1 ntrip://caster.example:2101/BASE1"
        );
        let source: Source = "tcp://[::1]:5000".parse().unwrap();
        assert_eq!((source.address.as_str(), source.mount), ("[::1]:5000", None));
        for wrong in [
            "caster:2101/X",
            "ntrip://caster",
            "ntrip:///X",
            "tcp://host",
            "tcp://host:99999",
            "tcp://host:1/X",
            "http://host:1/X",
            "ntrip://host/a b",
        ] {
            assert!(wrong.parse::<Source>().is_err(), "{wrong}");
        }
    }
}
