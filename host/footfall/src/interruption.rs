//! Interruption by SIGINT, SIGTERM and SIGHUP, and by Ctrl-C on systems without signals.
//!
//! A signal that is ignored at program start stays ignored: `nohup` ignores SIGHUP, and shells without job control
//! ignore SIGINT for background jobs. The other signals must still work: `kill` sends SIGTERM. `ctrlc` handles all
//! of them or none, so it is used only on systems without signals.

use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

use files::whole_file::remove_unfinished_and_exit;

use crate::messages::warn;

/// Exit code of a program ended by Ctrl-C, as used by shells.
pub const INTERRUPTED: i32 = 130;

/// Makes an interruption remove unfinished files and exit with [`INTERRUPTED`]. If the handler cannot be installed,
/// the files remain.
pub fn tidy_up_when_interrupted() {
    // The program also works without the handler.
    let _ = listen();
}

/// Time for an orderly end. A device that does not respond, or a reader that has stopped, may block it.
const GRACE: Duration = Duration::from_secs(5);

/// Makes the first interruption request an orderly end, reported by [`is_interrupted`]. The next interruption exits
/// at once, as does the program if it has not ended after some seconds.
pub fn finish_when_interrupted() {
    INTERRUPTION.store(FINISHES, Ordering::Relaxed);
}

/// Returns whether an orderly end was requested.
#[must_use]
pub fn is_interrupted() -> bool {
    INTERRUPTION.load(Ordering::Relaxed) == FINISHING
}

/// Effect of an interruption: exits at once; requests an orderly end; or, once requested, exits on the next
/// interruption.
static INTERRUPTION: AtomicU8 = AtomicU8::new(EXITS);
const EXITS: u8 = 0;
const FINISHES: u8 = 1;
const FINISHING: u8 = 2;

fn interrupt() {
    let request =
        INTERRUPTION.compare_exchange(FINISHES, FINISHING, Ordering::Relaxed, Ordering::Relaxed);
    if request.is_err() {
        remove_unfinished_and_exit(INTERRUPTED);
    }
    // The thread ends with the program.
    thread::spawn(|| {
        thread::sleep(GRACE);
        warn(format!(
            "the device or the reader of the output has blocked the end for {} s, so the program ends without it",
            GRACE.as_secs()
        ));
        remove_unfinished_and_exit(INTERRUPTED);
    });
}

#[cfg(not(unix))]
fn listen() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(interrupt)
}

#[cfg(unix)]
use signals::listen;

#[cfg(unix)]
mod signals {
    use std::{io, mem, ptr, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    use super::interrupt;

    pub(super) fn listen() -> io::Result<()> {
        let signals = [SIGINT, SIGTERM, SIGHUP];
        let mut signals = Signals::new(signals.iter().filter(|signal| !is_ignored(**signal)))?;
        let listener = thread::Builder::new().name("interruption".to_owned());
        listener.spawn(move || signals.forever().for_each(|_| interrupt()))?;
        Ok(())
    }

    fn is_ignored(signal: i32) -> bool {
        // SAFETY: a `sigaction` is plain data of C, of which all zeros are a value.
        let mut present: libc::sigaction = unsafe { mem::zeroed() };
        // SAFETY: without a new action the call changes nothing but `present`, which outlives it.
        let answer = unsafe { libc::sigaction(signal, ptr::null(), &raw mut present) };
        answer == 0 && present.sa_sigaction == libc::SIG_IGN
    }
}
