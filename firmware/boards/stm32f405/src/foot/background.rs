//! Thread level: settings, watchdog, LED.

use core::sync::atomic::Ordering;

use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Timer};
use firmware::costs::Cost;
use firmware::ports::{Input, Reloaded, Request};
use firmware::supervision::StackDepth;
use wire::Stage;

use super::{FAULT, LIGHT, PORTS, REQUESTED, Store, UART_RATE};

/// Interval of feeding the watchdog.
const FEEDING: Duration = Duration::from_millis(crate::watchdog::FEEDING_MILLIS as u64);

/// Time in which the answer to a stop leaves: some frames at 125 kbit/s.
const ANSWERING: Duration = Duration::from_millis(20);

/// Number of feedings of the watchdog, without a gap, before a new program is confirmed: ten seconds.
const CONFIRMED: u32 = 10_000 / crate::watchdog::FEEDING_MILLIS;

/// Serves requests of the foot that take longer than a tick.
#[embassy_executor::task]
pub(super) async fn serve_requests(mut storage: Store, mut can: Option<crate::can::Control>) {
    loop {
        match PORTS.next_request().await {
            Request::Store(settings, erase) => {
                let stored = storage.store(&settings, erase);
                PORTS.put(Input::Stored(stored)).await;
            }
            Request::Restore(erase) => {
                let forgotten = storage.restore(erase);
                PORTS.put(Input::Stored(forgotten)).await;
            }
            Request::ProtectSupply => {
                let protected = storage.flash().protect();
                PORTS.put(Input::Protected(protected)).await;
            }
            Request::ConfirmProgram => {
                PORTS.put(Input::Protected(crate::update::confirm())).await;
            }
            Request::StopProgram => {
                Timer::after(ANSWERING).await;
                crate::update::ask_for_bootloader();
                cortex_m::peripheral::SCB::sys_reset();
            }
            Request::Reload => {
                let (settings, origin) = storage.load();
                if let Some(can) = &mut can {
                    can.set_bit_rate(settings.can_bit_rate());
                }
                UART_RATE.signal(settings.uart_rate());
                PORTS.reload(Reloaded { settings, origin });
            }
            Request::Reset => cortex_m::peripheral::SCB::sys_reset(),
        }
    }
}

/// Returns whether the foot can be reached over one of its lines, and so be updated again: another node has
/// acknowledged a frame, or has sent a request. The serial line sends without a receiver, too, which shows nothing.
fn is_reachable() -> bool {
    REQUESTED.load(Ordering::Relaxed) || crate::can::has_sent()
}

/// Feeds the watchdog while all workers are alive, confirms a new program, and measures the depth of the stack.
#[embassy_executor::task]
pub(super) async fn feed_watchdog() {
    let mut depth = StackDepth::default();
    let (mut feedings, mut is_confirmed) = (0, false);
    loop {
        PORTS.call();
        Timer::after(FEEDING).await;
        if PORTS.liveness.all_alive() {
            crate::watchdog::feed();
            crate::crash::forget_watchdog_resets();
            feedings += 1;
            if !is_confirmed && feedings >= CONFIRMED && is_reachable() {
                is_confirmed = crate::update::confirm().is_ok();
                if !is_confirmed {
                    defmt::error!("the new program could not be confirmed");
                    // The supply may be low now: again in ten seconds.
                    feedings = 0;
                }
            }
        }
        if let Some(used) = crate::stack::look(&mut depth) {
            PORTS.costs.take(Cost::Stack, used as u32);
            defmt::info!("stack: {} of {} bytes", used, crate::stack::size());
        }
    }
}

/// Shows the stage: duration of the LED on and then off, ms.
#[embassy_executor::task]
pub(super) async fn blink(mut led: Output<'static>) {
    loop {
        let light = LIGHT.load(Ordering::Relaxed);
        let stage = Stage::from_code(light & !FAULT).unwrap_or(Stage::Starting);
        let (on, off) = match stage {
            Stage::Starting | Stage::SelfTest => (50, 50),
            Stage::HoldStill => (250, 250),
            Stage::Recovering => (50, 150),
            Stage::Running if light & FAULT != 0 => (900, 100),
            Stage::Running => (50, 950),
        };
        led.set_high();
        Timer::after_millis(on).await;
        led.set_low();
        Timer::after_millis(off).await;
    }
}
