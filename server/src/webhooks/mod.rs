//! Other programs are told of faults and anomalies.
//!
//! An event goes into the outbox in the transaction in which it happens (`store::webhook_deliveries`); [`deliver`] takes
//! it from there, as often as it takes, over restarts; [`sign`] lets the receiver know that it is ours.

pub(crate) mod deliver;
mod sign;
