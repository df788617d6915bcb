//! Roles, and what each may do. Which right a route asks for stands where the route is declared.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What somebody is here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Looks: a display on the wall.
    Viewer,
    /// Walks, and writes the walks that are the inspector's own.
    Inspector,
    /// Sends people to faults.
    Dispatcher,
    /// Keeps the markers right.
    Surveyor,
    /// Works walks out with other parameters, and compares.
    Engineer,
    /// Gives accounts and rights.
    Admin,
}

/// What a route asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// Nothing: signing in, and what is needed for it.
    Open,
    /// To be known at all: one's own password and tokens.
    Known,
    /// To see what there is.
    Read,
    /// To write walks: sessions, logs, visits and reports of faults. An inspector's own, or anybody's.
    Walk,
    /// To write anybody's walks, not only one's own.
    WalkForOthers,
    /// To send people to faults, and to keep the list of inspectors.
    Dispatch,
    /// To change markers.
    Survey,
    /// To change parameters, and to remove walks with their samples.
    Engineer,
    /// To give accounts and rights, and to read who changed what.
    Administer,
}

impl Role {
    /// All of them, the least first.
    pub const ALL: [Role; 6] =
        [Role::Viewer, Role::Inspector, Role::Dispatcher, Role::Surveyor, Role::Engineer, Role::Admin];

    /// What one of this role may do, beside what everybody who is known may.
    pub fn rights(self) -> &'static [Right] {
        match self {
            Role::Viewer => &[Right::Read],
            Role::Inspector => &[Right::Read, Right::Walk],
            Role::Dispatcher => &[Right::Read, Right::Walk, Right::WalkForOthers, Right::Dispatch],
            Role::Surveyor => &[Right::Read, Right::Survey],
            Role::Engineer => &[Right::Read, Right::Walk, Right::WalkForOthers, Right::Engineer],
            Role::Admin => &[
                Right::Read,
                Right::Walk,
                Right::WalkForOthers,
                Right::Dispatch,
                Right::Survey,
                Right::Engineer,
                Right::Administer,
            ],
        }
    }

    /// Whether one of this role has a right.
    pub fn may(self, right: Right) -> bool {
        matches!(right, Right::Open | Right::Known) || self.rights().contains(&right)
    }
}

impl Right {
    /// The word for it in tokens, in answers and in the audit log.
    pub fn word(self) -> &'static str {
        match self {
            Right::Open => "open",
            Right::Known => "known",
            Right::Read => "read",
            Right::Walk => "walk",
            Right::WalkForOthers => "walk_for_others",
            Right::Dispatch => "dispatch",
            Right::Survey => "survey",
            Right::Engineer => "engineer",
            Right::Administer => "administer",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_administrator_gives_rights_and_everybody_may_look() {
        for role in Role::ALL {
            assert!(role.may(Right::Read), "{role:?}");
            assert_eq!(role.may(Right::Administer), role == Role::Admin, "{role:?}");
        }
    }

    #[test]
    fn a_right_is_told_by_the_word_that_a_token_names_it_with() {
        for right in [Right::Read, Right::Walk, Right::WalkForOthers, Right::Administer] {
            assert_eq!(serde_json::to_value(right).unwrap(), right.word());
        }
    }
}
