//! A progress bar for long recordings, on stderr and only where somebody can watch it.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// From this many samples on a bar is worth showing: below it the work takes no second.
const LONG_RECORDING: usize = 200_000;

/// From this many bytes on a file counts as long; a row takes about a hundred.
const LONG_FILE: u64 = 100 * LONG_RECORDING as u64;

/// A bar over `samples` samples, hidden for short recordings.
pub(crate) fn over_samples(activity: &'static str, samples: usize) -> ProgressBar {
    let length = samples as u64;
    bar(activity, length, samples >= LONG_RECORDING)
}

/// A bar over the bytes of a file, hidden for short files.
pub(crate) fn over_bytes(activity: &'static str, bytes: u64) -> ProgressBar {
    bar(activity, bytes, bytes >= LONG_FILE)
}

fn bar(activity: &'static str, length: u64, worth_showing: bool) -> ProgressBar {
    // A stderr target hides itself where stderr is no terminal.
    let target = if worth_showing {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let style = ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3} %, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(Some(length), target).with_style(style);
    bar.set_message(activity);
    bar
}
