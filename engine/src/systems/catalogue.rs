//! The systems that there are. This is the one file that names them all: a new one is one line here.

use super::{cabin, fixes, pedestrian, pole, rover};
use crate::event::AidKind;
use crate::stream::{FormerKeys, StreamId};
use crate::system::Declaration;

/// All systems; the first is that of a session of which nothing is said.
pub const SYSTEMS: &[&Declaration] = &[
    &pedestrian::DECLARATION,
    &fixes::DECLARATION,
    &pole::DECLARATION,
    &cabin::DECLARATION,
    &rover::DECLARATION,
];

/// The system of a session of which nothing is said.
pub fn usual() -> &'static Declaration {
    SYSTEMS[0]
}

/// The system of this name.
pub fn named(name: &str) -> Option<&'static Declaration> {
    SYSTEMS.iter().copied().find(|system| system.name == name)
}

/// The kinds of what is positioned, each once, in the order of the systems.
pub fn carrier_kinds() -> Vec<&'static str> {
    let mut kinds: Vec<&str> = Vec::new();
    for system in SYSTEMS {
        if !kinds.contains(&system.carrier_kind) {
            kinds.push(system.carrier_kind);
        }
    }
    kinds
}

/// What clients that know no streams call them, of all systems.
pub fn former_keys() -> Vec<FormerKeys> {
    SYSTEMS.iter().filter_map(|system| system.former_keys).collect()
}

/// The same of the system that has such a stream; `None` where it is not older than streams.
pub fn former_keys_of(stream: StreamId) -> Option<FormerKeys> {
    SYSTEMS.iter().find(|system| system.stream(stream).is_some()).and_then(|system| system.former_keys)
}

/// The aid of this word, of the first system that has it: in the order in which that system declares its aids.
pub fn aid_named(word: &str) -> Option<AidKind> {
    SYSTEMS.iter().find_map(|system| system.aid(word)).map(|aid| aid.kind)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn systems_streams_and_parameters_are_named_once_and_defaults_lie_in_their_ranges() {
        let names: BTreeSet<&str> = SYSTEMS.iter().map(|system| system.name).collect();
        assert_eq!(names.len(), SYSTEMS.len());
        for system in SYSTEMS {
            let streams = system.usual_streams();
            assert!(!streams.is_empty(), "{}", system.name);
            system.check_streams(&streams).unwrap();
            for stream in &streams {
                assert_eq!(system.stream(stream.id).as_ref(), Some(stream));
            }
            assert!(system.parts.len() <= crate::event::MOST_PARTS, "{}", system.name);
            let keys: BTreeSet<&str> = system.parameters.iter().map(|parameter| parameter.key).collect();
            assert_eq!(keys.len(), system.parameters.len(), "{}", system.name);
            for parameter in system.parameters {
                let default = parameter.default_of(system);
                assert!(
                    (parameter.least..=parameter.most).contains(&default),
                    "{} of {}: {default}",
                    parameter.key,
                    system.name
                );
                assert!(system.parameter_groups.contains(&parameter.group), "{}", parameter.group);
            }
            let aids = (system.config)().aids();
            assert!(aids.iter().all(|aid| system.aid(aid.as_str()).is_some()), "{}", system.name);
        }
    }
}
