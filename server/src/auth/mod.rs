//! Who may do what.
//!
//! A request names somebody by a cookie (a person who has signed in) or by a bearer token (a device, a script).
//! [`guard()`] finds out who that is and whether they have the right that the route declares
//! ([`Routes`](crate::http::Routes)); handlers take the [`Caller`]. As long as there is no account, the server is open
//! to people at its machine, and to nobody else.

mod caller;
mod credentials;
mod guard;
mod guesses;
mod passwords;
mod secrets;
mod setup;
mod sign_in;
mod state;

pub(crate) use caller::{By, Caller, not_signed_in};
pub(crate) use credentials::{COOKIE, by_token};
pub(crate) use guard::guard;
pub(crate) use passwords::Password;
pub(crate) use secrets::Secret;
pub(crate) use setup::{checked_name, set_up, tell_how};
pub(crate) use sign_in::{SIGNED_IN_FOR, sign_in, sign_out};
pub(crate) use state::{Auth, until_unknown};
