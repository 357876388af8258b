//! What interrupts a program: SIGINT, SIGTERM and SIGHUP, and Ctrl-C where there are no signals.
//!
//! A signal that is ignored when the program starts stays so: `nohup` ignores SIGHUP, and shells without job
//! control ignore SIGINT for what they start in the background. The others must work all the same: `kill` sends
//! SIGTERM. `ctrlc` listens to all or none of them, so it does for systems without them alone.

/// From now on, an interrupted program leaves no unfinished file behind: it removes them and ends with
/// [`INTERRUPTED`]. Where the system does not let it, they stay.
///
/// [`INTERRUPTED`]: crate::files::INTERRUPTED
pub fn tidy_up_when_interrupted() {
    // Without it the program works all the same.
    let _ = listen();
}

#[cfg(not(unix))]
fn listen() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(crate::files::interrupt)
}

#[cfg(unix)]
use signals::listen;

#[cfg(unix)]
mod signals {
    use std::{io, mem, ptr, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    use crate::files::interrupt;

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
