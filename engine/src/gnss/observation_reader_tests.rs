//! Oddities of observation files, one a test.
