//! Start: reports of the previous run, the log's first lines, the foot.

use embassy_executor::{SpawnError, SpawnToken};
use embassy_stm32::gpio::Output;
use firmware::{Foot, Start};
use static_cell::StaticCell;
use storage::Origin;
use wire::node::Crash;
use wire::{Fault, Settings};

use crate::crash::Reset;

/// Previous crash, if it caused this start.
pub(super) fn reason_for_start(crash: Option<crate::crash::Crash>, reset: Reset) -> Option<Crash> {
    if let Some(crash) = crash {
        defmt::error!(
            "previous crash at {=u32:#010x}: reason {=u32}, detail {=u32:#x}",
            crash.record.program_counter,
            crash.record.reason as u32,
            crash.detail
        );
        return Some(crash.record.into());
    }
    (reset == Reset::Watchdog).then_some(Crash { fault: Fault::WatchdogReset, program_counter: 0 })
}

pub(super) fn log_boot(start: &Start) {
    defmt::info!(
        "footfall {=str}, program {=u32:08x}, serial {=u32:08x}, {=str} settings, {=str} oscillator",
        env!("CARGO_PKG_VERSION"),
        start.program.identification,
        start.serial,
        match start.origin {
            Origin::Stored => "stored",
            Origin::Blank => "default",
            Origin::Corrupted | Origin::Incompatible | Origin::NotRead => "unreadable",
        },
        if start.unused_crystal_khz.is_some() { "internal" } else { "crystal" },
    );
    if let Some(khz) = start.unused_crystal_khz {
        defmt::error!("crystal: {=u32} kHz", khz);
    }
}

/// Creates the foot in its static place, with defaults instead of unusable settings.
pub(super) fn make_foot(settings: Settings, start: Start) -> Option<&'static mut Foot> {
    static FOOT: StaticCell<Foot> = StaticCell::new();
    let origin = Origin::Incompatible;
    let foot = Foot::new(settings, start)
        .or_else(|_| Foot::new(Settings::default(), Start { origin, ..start }));
    foot.ok().map(|foot| FOOT.init(foot))
}

/// Spawns a task that exists once.
pub(super) fn once<S>(task: Result<SpawnToken<S>, SpawnError>, spawn: impl FnOnce(SpawnToken<S>)) {
    match task {
        Ok(task) => spawn(task),
        Err(_) => defmt::error!("a task was spawned twice"),
    }
}

/// Ends a start with an inconsistency: LED on, a line in the log, and finally the watchdog's reset.
pub(super) fn halt(led: &mut Output<'static>, why: &str) -> ! {
    led.set_high();
    defmt::error!("cannot start: {=str}", why);
    loop {
        cortex_m::asm::wfi();
    }
}
