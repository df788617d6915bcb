//! Values that more than one type shows in its example in the description of the API.

/// A SHA-256 as it is spelled.
pub(crate) const SHA256: &str = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08";
/// A secret as it is made.
pub(crate) const SECRET: &str = "0kX3v0QmE1f5cB7dYtJq2sWzR8uN4pLh6gAaKeMi9Oo";
/// What is said of something that the disk has changed.
pub(crate) const DAMAGE: &str = "a chunk of samples of walk 0199f3a0-7c1e-7d52-9b1a-4f6e2d8c3b57: expected the checksum 1f0c22a9, found 8e44d017";
