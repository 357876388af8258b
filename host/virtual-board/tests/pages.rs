//! The settings pages: arbitrary bytes in them at power-up, and a store cut off at each of its
//! operations. In the default run `tests/settings.rs` has a few of both.

mod common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use common::{boot_product, product};
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::time;
use virtual_board::product::scenario::{Scenario, ScenarioStep};

const MILLISECOND: u64 = time::PER_SECOND / 1000;
const ESTIMATE: u32 = 0x191;

/// Seeds of garbage.
const SEEDS: u64 = 40;

/// Runs `act` for each number on all cores. Returns its violations, in order.
fn on_all_cores(numbers: &[u64], act: impl Fn(u64) -> Vec<String> + Sync) -> Vec<String> {
    let next = AtomicU64::new(0);
    let all = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(&number) = numbers.get(next.fetch_add(1, Ordering::Relaxed) as usize)
                {
                    let found = act(number);
                    let found = found.into_iter().map(|text| format!("{number}: {text}"));
                    all.lock().expect("no thread panicked").extend(found);
                }
            });
        }
    });
    let mut all = all.into_inner().expect("no thread panicked");
    all.sort();
    all
}

#[test]
#[ignore = "full: 40 starts with arbitrary settings pages"]
fn the_board_starts_with_arbitrary_bytes_in_settings_pages() {
    let Some(elf) = product() else { return };
    let seeds: Vec<u64> = (1..=SEEDS).collect();
    let wrong = on_all_cores(&seeds, |seed| {
        let mut board = boot_product(&elf);
        board.inject(Injection::SettingsGarbage(seed));
        let mut wrong = Vec::new();
        // Both pages may have to be erased.
        if let Err(failure) = board.run_for(2_500 * MILLISECOND) {
            return vec![failure.to_string()];
        }
        board.take_can();
        if let Err(failure) = board.run_for(500 * MILLISECOND) {
            return vec![failure.to_string()];
        }
        let frames = board.take_can();
        let estimates = frames.iter().filter(|sent| sent.frame.id == ESTIMATE);
        let estimates = estimates.count();
        if estimates < 495 {
            wrong.push(format!("{estimates} estimates in half a second"));
        }
        if !board.resets().is_empty() || !board.faults().is_empty() {
            wrong.push(format!("{:?} {:x?}", board.resets(), board.faults()));
        }
        wrong
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "full: power cuts at every operation of a store"]
fn an_erasing_store_may_be_cut_off_at_any_operation() {
    let Some(elf) = product() else { return };
    let row = Scenario::named("power-cut-erasing").expect("a row");
    let operations = row.erasing_operations(&elf).expect("a store erases");
    let cuts: Vec<u64> = (1..=operations).collect();
    let wrong = on_all_cores(&cuts, |operation| {
        let cut = ScenarioStep::Inject(Injection::CutInFlash(operation));
        match row.run_steps(&elf, &[cut, ScenarioStep::StoreStopped], 0, Corner::Typical) {
            Ok(outcome) => outcome.violations,
            Err(problem) => vec![problem.to_string()],
        }
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}
