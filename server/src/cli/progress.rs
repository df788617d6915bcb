//! Progress on standard error, where somebody watches.

use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar over bytes that are read; its length grows as files are opened.
pub(super) fn of_bytes() -> ProgressBar {
    bar(0, "{bar:40} {percent:>3} %  {bytes}/{total_bytes}  {eta} left")
}

/// A bar over a number of things.
pub(super) fn of_count(count: u64, what: &str) -> ProgressBar {
    bar(count, &format!("{{bar:40}} {{percent:>3}} %  {{pos}}/{{len}} {what}  {{eta}} left"))
}

fn bar(length: u64, template: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr_with_hz(5)).with_style(style)
}
