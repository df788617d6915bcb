//! The strapdown and error model of instruments, as the pole and the feed cabin will use them: against physics
//! (Earth's rotation, Schuler, Foucault), against a strapdown as a textbook writes it, and in a filter that has
//! to know how wrong it is.

mod consistency;
mod drift;
mod earth;
mod local_level;
mod motion;
