//! Faults of the settings and the flash that stores them.

use wire::Fault;
use wire::node::NmtCommand;

use super::{LASTING, LOAD_SCALE, NEW_SCALE, OLD_AND_NEW, OLD_SCALE, PLAIN};
use crate::emulator::board::Injection::{
    CutInFlash, Reset, SettingsDamaged, SettingsErased, SettingsGarbage, Supply, WornFlash,
};
use crate::emulator::part::rcc::ResetCause;
use crate::product::scenario::ScenarioStep::{
    CutInErase, Inject, Nmt, Restore, Store, StoreStopped, Wait,
};
use crate::product::scenario::{Pages, Reports, Scenario};

/// Rows in the order of the table.
#[rustfmt::skip]
pub(super) const ROWS: &[Scenario] = &[
    Scenario { name: "flash-blank", what: "stored settings erased, then a reset", before: &[Store],
        steps: |_| vec![Inject(SettingsErased), Inject(Reset)], reports: Reports::BootUp,
        note: "as on a new board: defaults apply", resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "flash-corrupted", what: "stored settings damaged, then a reset", before: &[Store],
        steps: |_| vec![Inject(SettingsDamaged), Inject(Reset)], reports: Reports::Fault(Fault::ConfigCorrupted),
        note: "defaults apply; remains reported until settings are stored", resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "power-cut", what: "supply cut while settings are stored, at every fourth of 115 writes",
        before: &[OLD_SCALE, Store, NEW_SCALE], steps: |write| vec![Inject(CutInFlash(write)), Store],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), variants: (3, 115, 4), reports: Reports::BootUp,
        resets: &[ResetCause::PowerOn], ..PLAIN },
    Scenario { name: "garbage-at-power-up", what: "arbitrary bytes in the settings pages at power-up: twelve seeds",
        steps: |seed| vec![Inject(SettingsGarbage(seed))], variants: (1, 12, 1), at_power_up: true,
        reports: Reports::Any, note: "defaults apply where no valid record is found", ..PLAIN },
    Scenario { name: "reload-damaged", what: "stored settings damaged, then NMT reset communication",
        before: &[Store],
        steps: |_| vec![Inject(SettingsDamaged), Nmt(NmtCommand::ResetCommunication), Wait(50_000),
            Nmt(NmtCommand::StartRemoteNode)],
        reports: Reports::Fault(Fault::ConfigCorrupted),
        note: "defaults apply; remains reported until settings are stored", ..PLAIN },
    Scenario { name: "load-defaults", what: "0x1011 \"load\" restores the defaults", before: &[Store],
        steps: |_| vec![Restore], reports: Reports::Any, ..PLAIN },
    Scenario { name: "store-erases", what: "a store that has to erase a page, in pre-operational",
        pages: Pages::BeforeAnErase, steps: |_| vec![StoreStopped],
        // The erase may begin at any moment of a tick.
        phases: 16, reports: Reports::Any, ..PLAIN },
    Scenario { name: "store-would-erase", what: "a store that has to erase a page, in operational",
        pages: Pages::BeforeAnErase, steps: |_| vec![Store], reports: Reports::Any, ..PLAIN },
    Scenario { name: "power-cut-erasing", what: "supply cut in a store that has to erase, at 16 of its operations",
        pages: Pages::BeforeAnErase, before: &[NEW_SCALE], steps: |part| vec![CutInErase(part as u32), StoreStopped],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), variants: (0, 31, 2), reports: Reports::BootUp,
        resets: &[ResetCause::PowerOn], ..PLAIN },
    Scenario { name: "worn-flash",
        what: "a bit cleared in the record that is stored, at every twelfth word, then a reset",
        before: &[OLD_SCALE, Store, NEW_SCALE],
        steps: |write| vec![Inject(WornFlash(write)), StoreStopped, Wait(100_000), Inject(Reset)],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), keeps_new: true, variants: (2, 110, 12), reports: Reports::BootUp,
        resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "supply-low-store", what: "settings stored at 2.6 V, brown-out level 1",
        board: |options, _| options.chip.brown_out_level = 1, steps: |_| vec![Inject(Supply(2_600)), StoreStopped],
        lasts_ms: LASTING, reports: Reports::Fault(Fault::ConfigStore), note: "refused below 2.7 V", ..PLAIN },
];
