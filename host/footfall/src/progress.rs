//! Progress bar for long recordings and updates, on stderr if that is a terminal.

use std::path::Path;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use recordings::input::{Format, InputError, Opened};

use crate::files::STANDARD;

/// Path of standard input on Unix.
const STDIN: &str = "/dev/stdin";

/// Number of samples from which a bar is shown; fewer take less than a second.
const LONG_RECORDING: u64 = 200_000;

/// File size from which a bar is shown, bytes; a row has about a hundred.
const LONG_FILE: u64 = 100 * LONG_RECORDING;

/// Progress bars of recordings processed concurrently.
#[derive(Debug, Default)]
pub struct Bars(MultiProgress);

impl Bars {
    /// Returns a bar over the samples to be estimated.
    #[must_use]
    pub fn estimating(&self, samples: u64) -> ProgressBar {
        self.0.add(bar("estimating", samples, LONG_RECORDING))
    }

    /// Returns a bar over the bytes that are sent to a foot, from 0 to 100 %.
    #[must_use]
    pub fn sending(&self) -> ProgressBar {
        self.0.add(bar("sending", 100, 0))
    }
}

/// Opens a file like [`Opened::new`], with a bar while it is read; `-` is standard input.
///
/// # Errors
/// Those of [`Opened::new`].
pub fn open(path: &Path, format: Option<Format>, bars: &Bars) -> Result<Opened, InputError> {
    let path = if path == Path::new(STANDARD) { Path::new(STDIN) } else { path };
    Opened::through(path, format, |file, bytes| {
        let bar = bars.0.add(bar("reading", bytes, LONG_FILE));
        Box::new(bar.wrap_read(file))
    })
}

/// Returns a bar over `length`, hidden if it is below `shown_from`.
fn bar(activity: &'static str, length: u64, shown_from: u64) -> ProgressBar {
    // A stderr target is hidden unless stderr is a terminal.
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
