//! Runs the self-check on an emulated core. Prints one line per checkpoint over semihosting: `preset samples digest`. The
//! program of each family of chips includes this file beside its vector table.

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use estimator_core::any::AnyParams;
use estimator_core::{ParamsError, Stream, self_check};

#[entry]
fn main() -> ! {
    let outcome = self_check::PRESETS.iter().try_for_each(check);
    match outcome {
        Ok(()) => debug::exit(debug::EXIT_SUCCESS),
        Err(error) => {
            hprintln!("{}", error);
            debug::exit(debug::EXIT_FAILURE);
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

fn check((preset, params, stream): &(&str, AnyParams, Stream)) -> Result<(), ParamsError> {
    self_check::run(params, *stream, |samples, digest| {
        hprintln!("{} {} {:016x}", preset, samples, digest);
    })
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}
