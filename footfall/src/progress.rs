//! A progress bar for long recordings, on stderr and only where that is a terminal.

use std::path::Path;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use recordings::input::{Format, InputError, Opened};

use crate::files::STANDARD;

/// Where the system has standard input.
const STDIN: &str = "/dev/stdin";

/// From this many samples on a bar is worth showing: below it the work takes no second.
const LONG_RECORDING: u64 = 200_000;

/// From this many bytes on a file counts as long; a row takes about a hundred.
const LONG_FILE: u64 = 100 * LONG_RECORDING;

/// The bars of recordings that are worked on at the same time.
#[derive(Debug, Default)]
pub struct Bars(MultiProgress);

impl Bars {
    /// A bar over the samples that are estimated.
    #[must_use]
    pub fn estimating(&self, samples: u64) -> ProgressBar {
        self.0.add(bar("estimating", samples, LONG_RECORDING))
    }

    /// A bar over the bytes of all recordings of a batch.
    #[must_use]
    pub fn batch(&self, bytes: u64) -> ProgressBar {
        self.0.add(bar("batch", bytes, LONG_FILE))
    }
}

/// [`Opened::new`], with a bar while the file is read; `-` is standard input.
///
/// # Errors
/// Those of [`Opened::new`].
pub fn open(path: &Path, format: Option<Format>, bars: &Bars) -> Result<Opened, InputError> {
    let path = if path == Path::new(STANDARD) {
        Path::new(STDIN)
    } else {
        path
    };
    Opened::through(path, format, |file, bytes| {
        let bar = bars.0.add(bar("reading", bytes, LONG_FILE));
        Box::new(bar.wrap_read(file))
    })
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
