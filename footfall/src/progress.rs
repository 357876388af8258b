//! A progress bar for long recordings, on stderr and only where that is a terminal.

use std::path::Path;

use estimator_core::{ContactEstimate, Learnt, Params, ParamsError};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use recordings::input::{Format, InputError, Opened};
use recordings::recording::Recording;
use recordings::replay::replay_observed;

/// From this many samples on a bar is worth showing: below it the work takes no second.
const LONG_RECORDING: u64 = 200_000;

/// From this many bytes on a file counts as long; a row takes about a hundred.
const LONG_FILE: u64 = 100 * LONG_RECORDING;

/// [`Opened::new`], with a bar while the file is read.
///
/// # Errors
/// Those of [`Opened::new`].
pub fn open(path: &Path, format: Option<Format>) -> Result<Opened, InputError> {
    Opened::through(path, format, |file, bytes| {
        Box::new(bar("reading", bytes, LONG_FILE).wrap_read(file))
    })
}

/// [`replay`](recordings::replay::replay), with a bar.
///
/// # Errors
/// Those of [`replay`](recordings::replay::replay).
pub fn replay(recording: &Recording, params: &Params) -> Result<Vec<ContactEstimate>, ParamsError> {
    Ok(replay_and_learn(recording, params)?.0)
}

/// [`replay_and_learn`](recordings::replay::replay_and_learn), with a bar.
///
/// # Errors
/// Those of [`replay`](recordings::replay::replay).
pub fn replay_and_learn(
    recording: &Recording,
    params: &Params,
) -> Result<(Vec<ContactEstimate>, Learnt), ParamsError> {
    let samples = recording.samples.len() as u64;
    let bar = bar("estimating", samples, LONG_RECORDING);
    let estimated = replay_observed(recording, params, || bar.inc(1));
    bar.finish_and_clear();
    estimated
}

/// A bar over `length`, hidden where that is below `shown_from`.
fn bar(activity: &'static str, length: u64, shown_from: u64) -> ProgressBar {
    // A stderr target hides itself where stderr is no terminal.
    let target = if length >= shown_from {
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
