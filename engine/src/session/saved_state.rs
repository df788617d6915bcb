//! The state of a live session, saved so that a server that starts again need not go over the whole session.
//!
//! It is not all that a session knows: what only a look back needs (inputs, checkpoints, stretches of the trail before the
//! newest one) is left out, some dozens of kilobytes remain. A session that is restored and given what came after is the one that
//! was never cut as soon as all that it looks back to came after; until then it has reported nothing that differs, unless
//! it says that it [lacks its past](Session::lacks_past).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{NotRestored, Session, SessionConfig, Summary};
use crate::identify::stands::Stands;
use crate::replay::{self, InputStore};

/// Names the sources that this engine was built from. What another engine saved is not to be given to this one: the
/// layout of a saved state is that of its own private parts.
pub const SOURCES: &str = env!("LODESTEP_ENGINE_SOURCES");

#[derive(Debug, Serialize, Deserialize)]
struct Saved<'a> {
    system: String,
    state: Cow<'a, [u8]>,
    summary: Summary,
    first_point_ns: Option<i64>,
    stands: Option<Cow<'a, Stands>>,
}

impl Session {
    /// The state to be saved now, when so much has come that it is worth it; `None` between. A restored session that is given
    /// what came after needs so much of it that another state could be saved [`Self::LOOKS_BACK_NS`] after this one's time.
    pub fn state_to_save(&mut self) -> Option<SavedState> {
        let (t_ns, state) = self.system.save()?;
        let saved = Saved {
            system: self.config.system.declaration().name.to_owned(),
            state: Cow::Owned(state),
            summary: self.summary,
            first_point_ns: self.first_point_ns,
            stands: self.stands.as_deref().map(Cow::Borrowed),
        };
        let mut bytes = vec![0; CHECKSUM_BYTES];
        bytes = postcard::to_extend(&saved, bytes).ok()?;
        let checksum = checksum(&bytes[CHECKSUM_BYTES..]);
        bytes[..CHECKSUM_BYTES].copy_from_slice(&checksum);
        Some(SavedState { t_ns, bytes })
    }

    /// A live session looks back so far, ns: a state that was saved longer than this before another one was is enough for
    /// a session that is the same.
    pub const LOOKS_BACK_NS: i64 = replay::LOOKS_BACK_NS;

    /// The session whose state this is, configured as it was at its start, but for the markers, which may be others by now; it goes
    /// on with the readings and visits that came after.
    ///
    /// # Errors
    ///
    /// Where the bytes are not a state that this engine ([`SOURCES`]) has saved, or not one of such a session.
    pub fn restored(
        config: SessionConfig,
        bytes: &[u8],
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Session, NotRestored> {
        let (stored, bytes) = bytes.split_at_checked(CHECKSUM_BYTES).ok_or_else(|| damaged(bytes.len()))?;
        if stored != checksum(bytes) {
            return Err(damaged(CHECKSUM_BYTES + bytes.len()));
        }
        let saved: Saved<'_> = postcard::from_bytes(bytes).map_err(|error| NotRestored(error.to_string()))?;
        let Saved { system, state, summary, first_point_ns, stands } = saved;
        if system != config.system.declaration().name {
            return Err(NotRestored(format!("a session of the {system} system")));
        }
        let system = config.system.restore(&config, &state, store)?;
        let stands = match (&config.identification, stands) {
            (Some(identification), Some(saved)) => {
                Some(Box::new(saved.into_owned().told_again(identification)))
            }
            (None, None) => None,
            _ => return Err(NotRestored("other knowledge of markers".to_owned())),
        };
        Ok(Session { config, system, summary, first_point_ns, stands })
    }
}

/// Length of the checksum prefix, bytes: what was damaged is refused, not believed.
const CHECKSUM_BYTES: usize = 8;

fn checksum(bytes: &[u8]) -> [u8; CHECKSUM_BYTES] {
    let hash: [u8; 32] = Sha256::digest(bytes).into();
    std::array::from_fn(|k| hash[k])
}

fn damaged(bytes: usize) -> NotRestored {
    NotRestored(format!("{bytes} bytes that were cut or altered"))
}

/// A state that was saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedState {
    /// The time from which on the session would know its past, ns.
    pub t_ns: i64,
    /// For [`Session::restored`].
    pub bytes: Vec<u8>,
}
