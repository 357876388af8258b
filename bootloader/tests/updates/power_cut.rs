//! Updates whose supply fails in each operation of the flash: the old or the new program is started, whole.

use crate::STRIDE;
use crate::flash::{CUTS, Chip, Cut, image, probed};
use bootloader::flash::{Flash as _, JOURNAL, JOURNAL_SIZE, SLOT_SIZE, Slot};
use bootloader::image::{HEADER, Refusal};
use bootloader::journal::{Event, MOST_STARTS, Progress, State};
use bootloader::update::{Start, settle};
use bootloader::verify::KEY;

/// Starts a chip that runs `old` and has received `new`, with the supply failing in operation `at` of the start.
/// Returns whether it failed.
fn cut_in(chip: &mut Chip, at: u32, cut: Cut) -> bool {
    chip.operations = 0;
    chip.cut = Some((at, cut));
    let _ = settle(chip, KEY);
    chip.power_up();
    chip.operations >= at
}

/// Asserts that a chip starts one of the programs, and returns its index.
fn starts_one_of(chip: &mut Chip, programs: [&[u8]; 2], context: &str) -> usize {
    assert_eq!(settle(chip, KEY), Ok(Start::Program), "{context}");
    programs
        .iter()
        .position(|program| chip.holds(Slot::Running, program))
        .unwrap_or_else(|| panic!("{context}: the running program is neither"))
}

/// Returns whether an operation is cut. For a short program all operations are cut. For a program of 128 KiB these are
/// the first and the last ones, where slots change, and one in 199 of the others.
fn is_tried(at: u32, operations: u32) -> bool {
    const ENDS: u32 = 150;
    operations < 2_000 || at < ENDS || at + ENDS > operations || at.is_multiple_of(199)
}

/// Starts a chip with a power cut in one operation of each `step`, and then with a second cut in the start that follows.
fn cut_every(step: u32, before: &Chip, programs: [&[u8]; 2], expected: usize) {
    let mut chip = before.clone();
    let found = starts_one_of(&mut chip, programs, "without a cut");
    assert_eq!(found, expected, "without a cut");
    let operations = chip.operations;
    assert!(operations > 100, "{operations}");
    for cut in CUTS {
        let tried = (1..=operations).filter(|at| is_tried(*at, operations));
        for at in tried.step_by(step as usize) {
            let mut chip = before.clone();
            assert!(cut_in(&mut chip, at, cut), "{at} {cut:?}");
            // The second cut comes after half as many operations, when the start after the first cut is copying.
            let mut twice = chip.clone();
            if cut_in(&mut twice, at / 2 + 1, cut) {
                let context = format!("{at} {cut:?}, then {} once more", at / 2 + 1);
                starts_one_of(&mut twice, programs, &context);
            }
            let context = format!("{at} {cut:?}");
            starts_one_of(&mut chip, programs, &context);
            // Without confirmation the old program is back, as whole as before.
            for _ in 0..MOST_STARTS {
                starts_one_of(&mut chip, programs, &context);
            }
            assert!(chip.holds(Slot::Running, programs[0]), "{context}");
        }
    }
}

/// Chip that has received `new`.
fn received(old: &[u8], previous: Option<&[u8]>, new: &[u8]) -> Chip {
    let mut chip = Chip::running(old).with(Slot::New, new);
    if let Some(previous) = previous {
        chip = chip.with(Slot::Previous, previous);
    }
    chip.log(Event::Install);
    chip.operations = 0;
    chip
}

/// One operation in this many is cut by default. It is a product of primes, so that cuts of all kinds occur.
const SPARSE: u32 = 11 * STRIDE as u32;

fn cut_updates(step: u32) {
    let (older, old, new) = (image(1, 1), image(2, 2), image(3, 3));
    cut_every(step, &received(&old, Some(&older), &new), [&old, &new], 1);
    cut_every(step, &received(&old, None, &new), [&old, &new], 1);
    let probed = probed(2);
    cut_every(step, &received(&probed, None, &new), [&probed, &new], 1);
}

#[test]
fn update_survives_cuts_of_the_supply() {
    cut_updates(SPARSE);
}

#[test]
#[ignore = "full: cuts each operation"]
fn update_survives_a_cut_in_any_operation() {
    cut_updates(1);
}

fn cut_returns(step: u32) {
    let (old, new) = (image(2, 2), image(3, 3));
    for old in [old, probed(2)] {
        let mut chip = received(&old, None, &new);
        for _ in 0..MOST_STARTS {
            chip.runs(&new);
        }
        chip.operations = 0;
        cut_every(step, &chip, [&old, &new], 0);
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
        let state = State::read(&chip);
        assert_eq!(state.progress, Progress::Settled);
        assert_eq!(state.refusal, Some(Refusal::NotConfirmed));
    }
}

#[test]
fn return_to_the_previous_program_survives_cuts() {
    cut_returns(SPARSE);
}

#[test]
#[ignore = "full: cuts each operation"]
fn return_to_the_previous_program_survives_any_cut() {
    cut_returns(1);
}

#[test]
fn confirmed_program_stays() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut chip = received(&old, None, &new);
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    let blank = vec![0xFF; SLOT_SIZE as usize];
    assert!(chip.holds(Slot::New, &blank), "for the next download");
    let mut state = State::read(&chip);
    assert_eq!(state.progress, Progress::Trial(1));
    state.append(Event::Confirmed, &mut chip).expect("room");
    for _ in 0..10 {
        chip.operations = 0;
        chip.runs(&new);
        assert_eq!(chip.operations, 0);
    }
}

#[test]
fn decayed_program_is_replaced_by_the_previous() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut damaged = new.clone();
    damaged[700] ^= 1;
    let mut chip = Chip::blank().with(Slot::Running, &damaged).with(Slot::Previous, &old);
    chip.runs(&old);
    assert_eq!(State::read(&chip).refusal, Some(Refusal::Decayed));
    let mut alone = Chip::blank().with(Slot::Running, &damaged);
    assert_eq!(settle(&mut alone, KEY), Ok(Start::Nothing(Some(Refusal::Decayed))));
    assert_eq!(settle(&mut Chip::blank(), KEY), Ok(Start::Nothing(None)));
}

/// If one bit decays, a program that was sent looks like a program of a probe, which is started unchecked.
#[test]
fn program_whose_kind_has_decayed_is_replaced() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut damaged = new.clone();
    damaged[700] ^= 1;
    for program in [&new, &damaged] {
        let mut chip = Chip::blank().with(Slot::Running, program).with(Slot::Previous, &old);
        chip.decay_kind(Slot::Running);
        chip.runs(&old);
        assert_eq!(State::read(&chip).refusal, Some(Refusal::Decayed));
        // Nor does it look like a program that a probe has written in place of the program on trial.
        let mut chip = received(&old, None, &new);
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
        chip.decay_kind(Slot::Running);
        chip.runs(&old);
    }
}

#[test]
fn image_that_decays_before_its_install_is_refused() {
    let (old, mut new) = (image(2, 2), image(3, 3));
    new[650] ^= 4;
    let mut chip = received(&old, None, &new);
    chip.runs(&old);
    assert_eq!(chip.erases.get(), 0);
    assert_eq!(State::read(&chip).refusal, Some(Refusal::WrongHash));
    // The hash of the header is changed with the program, but not the signature.
    let program = crate::flash::program(9, 400);
    let forged = crate::flash::sign(crate::flash::header(&program, 9), &program, &[1; 32]);
    let mut chip = received(&old, None, &forged);
    chip.runs(&old);
    assert_eq!(State::read(&chip).refusal, Some(Refusal::WrongSignature));
}

#[test]
fn full_journal_keeps_its_state_over_a_cut() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut chip = received(&old, None, &new);
    let mut state = State::read(&chip);
    // Fills the journal, so that the start erases it. The last record leaves the old program settled.
    for k in 1..=8_170 {
        let event = match k % 64 {
            63 => Event::Install,
            _ => Event::Ended(Refusal::WrongHash),
        };
        state.append(event, &mut chip).expect("room");
    }
    let mut whole = chip.clone();
    whole.operations = 0;
    assert_eq!(settle(&mut whole, KEY), Ok(Start::Program));
    let last = whole.operations;
    // The start marks the program, and sets all words of the journal to zero before it erases them. The cuts are in the
    // mark and the first words, and around the erase.
    for cut in CUTS {
        for at in (1..6).chain(last - 8..=last) {
            let mut chip = chip.clone();
            assert!(cut_in(&mut chip, at, cut), "{at} {cut:?}");
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
            assert!(chip.holds(Slot::Running, &old), "{at} {cut:?}");
            // The mark in its image keeps the program confirmed while the journal is blank.
            assert_eq!(State::read(&chip).progress, Progress::Settled, "{at} {cut:?}");
        }
    }
    chip.runs(&old);
    assert_eq!(State::read(&chip).progress, Progress::Settled);
    chip.log(Event::Install);
}

#[test]
fn copy_that_was_interrupted_is_no_program() {
    let (old, new) = (probed(2), image(3, 3));
    let mut chip = received(&old, None, &new);
    // The cut is in the copy of the running program, whose header has no hash.
    assert!(cut_in(&mut chip, 150, Cut::After));
    chip.decay(Slot::New.start() + 600);
    chip.decay(Slot::Running.start());
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Nothing(Some(Refusal::Decayed))));
}

#[test]
fn failed_trial_without_a_previous_program_stays_in_the_bootloader() {
    let new = image(3, 3);
    let mut chip = Chip::blank().with(Slot::New, &new);
    chip.log(Event::Install);
    for _ in 0..MOST_STARTS {
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    }
    chip.operations = 0;
    for _ in 0..10 {
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Nothing(Some(Refusal::NotConfirmed))));
    }
    assert_eq!(chip.operations, 0, "the journal does not grow");
    // Another program is installed as on a new board.
    let mut chip = chip.with(Slot::New, &image(4, 4));
    chip.log(Event::Install);
    chip.runs(&image(4, 4));
    // The second program fails as well. The first one is not restored, because it has never worked.
    for _ in 1..MOST_STARTS {
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    }
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Nothing(Some(Refusal::NotConfirmed))));
    assert!(!chip.holds(Slot::Previous, &new));
}

#[test]
fn program_of_a_probe_replaces_one_on_trial() {
    for previous in [None, Some(image(1, 1))] {
        let mut chip = received(&image(2, 2), previous.as_deref(), &image(3, 3));
        for _ in 0..MOST_STARTS {
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
        }
        let mut chip = chip.with(Slot::Running, &probed(4));
        for _ in 0..5 {
            chip.runs(&probed(4));
        }
        assert_eq!(State::read(&chip).progress, Progress::Settled);
    }
}

#[test]
fn program_whose_return_failed_is_not_kept_as_the_previous_one() {
    let (old, bad, new) = (image(2, 2), image(3, 3), image(4, 4));
    let mut chip = received(&old, None, &bad);
    for _ in 0..MOST_STARTS {
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    }
    chip.log(Event::Restore(Refusal::NotConfirmed));
    // The flash does not take the copy, and a master sends another image.
    let mut chip = chip.with(Slot::New, &new);
    chip.log(Event::Install);
    chip.runs(&new);
    assert!(chip.holds(Slot::Previous, &old));
}

/// Chip whose flash reports an error in each operation of the install of `new` in turn, without a power cut.
fn failed(old: &[u8], new: &[u8]) -> impl Iterator<Item = (u32, Chip)> {
    let before = received(old, None, new);
    let mut whole = before.clone();
    assert_eq!(settle(&mut whole, KEY), Ok(Start::Program));
    (1..=whole.operations).filter_map(move |at| {
        let mut chip = before.clone();
        chip.cut = Some((at, Cut::Before));
        let is_error = settle(&mut chip, KEY).is_err();
        chip.power_up();
        is_error.then_some((at, chip))
    })
}

#[test]
fn program_of_a_failed_start_is_not_kept_as_the_previous_one() {
    let (old, untried, new) = (image(2, 2), image(3, 3), image(4, 4));
    let mut count = 0;
    for (at, mut chip) in failed(&old, &untried) {
        bootloader::program::clear(&mut chip, Slot::New).expect("a flash that works");
        let mut chip = chip.with(Slot::New, &new);
        chip.log(Event::Install);
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{at}");
        assert!(chip.holds(Slot::Running, &new), "{at}");
        assert!(chip.holds(Slot::Previous, &old), "{at}");
        count += 1;
    }
    assert!(count > 100, "{count}");
}

#[test]
fn program_of_a_failed_start_does_not_run_without_a_trial() {
    let (old, untried) = (image(2, 2), image(3, 3));
    for (at, mut chip) in failed(&old, &untried) {
        bootloader::program::clear(&mut chip, Slot::New).expect("a flash that works");
        // The supply fails in the return, too.
        for cut in CUTS {
            cut_in(&mut chip, at / 2 + 1, cut);
        }
        assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{at}");
        assert!(chip.holds(Slot::Running, &old), "{at}");
        assert_eq!(State::read(&chip).progress, Progress::Settled, "{at}");
    }
    // Without a program to return to, the bootloader stays.
    let mut chip = Chip::blank().with(Slot::New, &untried);
    let mut state = State::read(&chip);
    for event in [Event::Install, Event::Kept] {
        state.append(event, &mut chip).expect("room");
    }
    let mut chip = chip.with(Slot::Running, &untried);
    bootloader::program::clear(&mut chip, Slot::New).expect("a flash that works");
    let stays = Ok(Start::Nothing(Some(Refusal::NotConfirmed)));
    assert_eq!(settle(&mut chip, KEY), stays);
}

#[test]
fn own_image_after_a_failed_start_keeps_the_confirmed_program() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut chip = received(&old, None, &new);
    chip.cut = Some((1, Cut::Before));
    chip.runs(&old);
    chip.power_up();
    bootloader::program::clear(&mut chip, Slot::New).expect("a flash that works");
    let mut chip = chip.with(Slot::New, &old);
    chip.log(Event::Install);
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    assert_eq!(State::read(&chip).progress, Progress::Settled);
}

fn cut_on_trial(step: u32) {
    let (old, trial, new) = (image(2, 2), image(3, 3), image(4, 4));
    let mut chip = received(&old, None, &trial);
    assert_eq!(settle(&mut chip, KEY), Ok(Start::Program));
    let mut chip = chip.with(Slot::New, &new);
    chip.log(Event::Install);
    let mut refused = chip.clone();
    chip.operations = 0;
    cut_every(step, &chip, [&old, &new], 1);
    // A refused image leaves the trial as it was.
    refused.decay(Slot::New.start() + 700);
    assert_eq!(settle(&mut refused, KEY), Ok(Start::Program));
    assert!(refused.holds(Slot::Running, &trial));
    assert_eq!(State::read(&refused).progress, Progress::Trial(2));
}

#[test]
fn program_on_trial_does_not_replace_the_previous_one() {
    cut_on_trial(5 * SPARSE);
}

#[test]
#[ignore = "full: cuts one in five operations"]
fn program_on_trial_does_not_replace_the_previous_one_in_cuts() {
    cut_on_trial(5);
}

#[test]
fn trial_survives_any_cut_in_the_erase_of_a_full_journal() {
    let (old, untried) = (image(2, 2), image(3, 3));
    for starts in 1..MOST_STARTS {
        let mut full = received(&old, None, &untried);
        for _ in 0..starts {
            assert_eq!(settle(&mut full, KEY), Ok(Start::Program));
        }
        // Records that power cuts have interrupted.
        for at in (JOURNAL..JOURNAL + JOURNAL_SIZE).step_by(8) {
            if full.read(at) == u32::MAX {
                full.program(at, 0).expect("an erased word");
            }
        }
        for cut in CUTS {
            // Before the erase, one word of each record is set to zero. The cuts are in some of these operations.
            let words = JOURNAL_SIZE / 8;
            for at in (1..).filter(|at| is_tried(*at, words) || *at > words - 150) {
                let mut chip = full.clone();
                if !cut_in(&mut chip, at, cut) {
                    assert!(at > words + 4, "the erase and records behind it");
                    let progress = State::read(&chip).progress;
                    assert_eq!(progress, Progress::Trial(starts + 1));
                    break;
                }
                let context = format!("{starts} {at} {cut:?}");
                let progress = State::read(&chip).progress;
                assert!(matches!(progress, Progress::Trial(_)), "{context}");
                for _ in 0..=MOST_STARTS {
                    assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{context}");
                }
                assert!(chip.holds(Slot::Running, &old), "{context}");
            }
        }
    }
}

/// The copy of `old` sets bit 8 of its first word, which `new` clears; that of `new` sets bit 0, which `old` clears.
#[test]
fn install_that_the_flash_does_not_take_ends_with_the_reason() {
    let (old, new) = (image(2, 2), image(3, 3));
    for (slot, bit) in [(Slot::Previous, 1 << 8), (Slot::Running, 1)] {
        let mut chip = received(&old, None, &new);
        chip.bad_cell = Some((slot.start() + HEADER as u32, bit));
        for _ in 0..2 {
            assert_eq!(settle(&mut chip, KEY), Ok(Start::Program), "{slot:?}");
            assert!(chip.holds(Slot::Running, &old), "{slot:?}");
            let state = State::read(&chip);
            assert_eq!(state.progress, Progress::Settled, "{slot:?}");
            assert_eq!(state.refusal, Some(Refusal::FlashFailed), "{slot:?}");
        }
    }
}

#[test]
fn bad_cell_of_the_journal_costs_a_record_and_no_erase() {
    let mut chip = Chip::running(&image(2, 2));
    let at = JOURNAL + 10 * 8;
    chip.bad_cell = Some((at, 1));
    chip.program(at, !1).expect("a blank word");
    for _ in 0..20 {
        chip.runs(&image(2, 2));
        chip.log(Event::Ended(Refusal::WrongHash));
    }
    assert_eq!(chip.erases.get(), 0);
    assert_eq!(State::read(&chip).refusal, Some(Refusal::WrongHash));
}

#[test]
fn flash_that_takes_nothing_keeps_no_whole_program_from_running() {
    let (old, new) = (image(2, 2), image(3, 3));
    let mut full = Chip::running(&old);
    let mut state = State::read(&full);
    for _ in 0..8_180 {
        state.append(Event::Confirmed, &mut full).expect("room");
    }
    let unrecorded = Chip::blank().with(Slot::Running, &old);
    let received = received(&old, None, &new);
    for mut chip in [full, unrecorded, received] {
        chip.operations = 0;
        chip.cut = Some((1, Cut::Before));
        for _ in 0..2 {
            chip.runs(&old);
        }
    }
    // A trial that is not counted would never end.
    let mut tried = Chip::running(&old).with(Slot::Running, &new);
    tried.log(Event::Started);
    tried.operations = 0;
    tried.cut = Some((1, Cut::Before));
    assert!(settle(&mut tried, KEY).is_err());
}
