//! Progress bar of recordings and updates that take longer than a second, on stderr if that is a terminal.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::thread;
use std::time::Duration;

use indicatif::{
    HumanDuration, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};

/// Time after which bars are shown. Shorter work needs no bar.
const SHOWN_AFTER: Duration = Duration::from_secs(1);

/// Time after which a bar shows the remaining time.
const RATE_KNOWN_AFTER: Duration = Duration::from_secs(5);

/// Progress bars of recordings processed concurrently.
#[derive(Debug)]
pub struct Bars(MultiProgress);

impl Default for Bars {
    /// Creates bars that appear on stderr after a second, if it is a terminal.
    fn default() -> Self {
        let bars = MultiProgress::with_draw_target(ProgressDrawTarget::hidden());
        let shown = bars.clone();
        // The command may end before.
        thread::spawn(move || {
            thread::sleep(SHOWN_AFTER);
            // A stderr target is hidden unless stderr is a terminal.
            shown.set_draw_target(ProgressDrawTarget::stderr());
        });
        Self(bars)
    }
}

impl Bars {
    /// Returns the reader of a file of this length, with a bar over its bytes.
    #[must_use]
    pub fn reading(&self, file: File, bytes: u64) -> Box<dyn Read> {
        let bar = self.0.add(bar("reading", bytes));
        Box::new(bar.wrap_read(file))
    }

    /// Returns a bar over the samples to be estimated.
    #[must_use]
    pub fn estimating(&self, samples: u64) -> ProgressBar {
        self.0.add(bar("estimating", samples))
    }

    /// Returns a bar over the bytes that are sent to a foot, from 0 to 100 %.
    #[must_use]
    pub fn sending(&self) -> ProgressBar {
        self.0.add(bar("sending", 100))
    }
}

/// Returns a bar over `length`.
fn bar(activity: &'static str, length: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3} %{left}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("left", |state: &ProgressState, to: &mut dyn fmt::Write| {
            // Writing to memory does not fail.
            let _ = to.write_str(&left_text(state.elapsed(), state.eta()));
        });
    let hidden = ProgressDrawTarget::hidden();
    let bar = ProgressBar::with_draw_target(Some(length), hidden).with_style(style);
    bar.set_message(activity);
    bar
}

/// Text of the time that is left.
fn left_text(elapsed: Duration, left: Duration) -> String {
    if elapsed < RATE_KNOWN_AFTER {
        return String::new();
    }
    format!(", {} left", HumanDuration(left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_shown_after_five_seconds() {
        let left = |elapsed| left_text(Duration::from_secs(elapsed), Duration::from_secs(80));
        assert_eq!(left(4), "");
        assert_eq!(left(5), ", 80 seconds left");
    }
}
