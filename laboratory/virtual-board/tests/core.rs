//! Validation of the board's core: exceptions, masks, floats and faults, by the architecture.

use crate::common::{boot, image};
use board_proofs::{Misuse, Orbit, mailbox};
use virtual_board::emulator::core::cpu::Cpu;
use virtual_board::emulator::elf::ElfImage;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::time;

fn printed(cpu: &mut Cpu) -> String {
    String::from_utf8_lossy(&cpu.machine().semihosting.output).into_owned()
}

#[test]
#[ignore = "full: proofs of the emulator"]
fn nested_handlers_and_threads_keep_every_float_bit() {
    let image = image("stress");
    let mut cpu = boot(&image);
    cpu.run_until(10 * time::PER_SECOND).expect("it runs");
    let text = printed(&mut cpu);
    assert_eq!(cpu.machine().semihosting.exit, Some(true), "{text}");
    let mut total = 0;
    for context in 0..6 {
        let line = text
            .lines()
            .find(|line| line.starts_with(&format!("context {context} ")))
            .unwrap_or_else(|| panic!("no line for context {context}: {text}"));
        let words: Vec<&str> = line.split(' ').collect();
        let (runs, steps): (u32, u32) =
            (words[3].parse().expect("a number"), words[5].parse().expect("a number"));
        assert!(steps > 1000, "context {context} hardly ran: {line}");
        total += runs;
        let mut orbit = Orbit::new(context);
        orbit.advance(steps);
        let bits = format!("{:08x?}", orbit.bits());
        assert!(line.ends_with(&bits), "{line}, the host has {bits}");
    }
    let last = text.lines().last().expect("a summary");
    assert!(last.contains(&format!("shared {total} of {total} ")), "{last}");
    assert!(last.ends_with("violations 0"), "{last}");
    let nested: u32 = last.split(' ').nth(5).expect("a number").parse().expect("a number");
    assert!(nested > 1000, "hardly anything nested: {last}");
}

fn ready_to(image: &ElfImage, misuse: Misuse) -> Cpu {
    let mut cpu = boot(image);
    for address in [mailbox::STARTS, mailbox::PC, mailbox::CFSR, mailbox::HFSR, mailbox::HANDLER] {
        cpu.memory().write(address, &[0; 4]);
    }
    cpu.memory().write(mailbox::MISUSE, &(misuse as u32).to_le_bytes());
    cpu
}

fn misbehave(image: &ElfImage, misuse: Misuse) -> Cpu {
    let mut cpu = ready_to(image, misuse);
    cpu.run_until(3 * time::PER_SECOND).expect("nothing that is not modelled");
    cpu
}

fn noted(cpu: &mut Cpu, address: u32) -> u32 {
    cpu.memory().word(address).expect("CCM RAM")
}

#[test]
#[ignore = "full: proofs of the emulator"]
fn a_fault_reports_its_exact_instruction_and_status() {
    let image = image("faults");
    for (misuse, place, handler, cfsr) in [
        (Misuse::Undefined, "undefined_here", 3, 1 << 16),
        (Misuse::Load, "load_here", 3, 1 << 15 | 1 << 9),
        (Misuse::Float, "float_here", 6, 1 << 19),
    ] {
        let mut cpu = misbehave(&image, misuse);
        let here = image.symbol(place).expect("a global symbol") & !1;
        assert_eq!(noted(&mut cpu, mailbox::HANDLER), handler, "{misuse:?}");
        assert_eq!(noted(&mut cpu, mailbox::PC), here, "{misuse:?}");
        assert_eq!(noted(&mut cpu, mailbox::CFSR), cfsr, "{misuse:?}");
        let forced = if handler == 3 { 1 << 30 } else { 0 };
        assert_eq!(noted(&mut cpu, mailbox::HFSR), forced, "{misuse:?}");
    }
}

#[test]
#[ignore = "full: proofs of the emulator"]
fn an_unfed_watchdog_resets_the_chip_and_sets_its_flag() {
    let image = image("faults");
    let mut cpu = misbehave(&image, Misuse::Watchdog);
    assert_eq!(noted(&mut cpu, mailbox::STARTS), 2);
    // PINRSTF and IWDGRSTF; the flag of power-on has been cleared.
    assert_eq!(noted(&mut cpu, mailbox::RESET_FLAGS) >> 24, 0x24);
    let machine = cpu.machine();
    let [(time, ResetCause::Watchdog)] = machine.chip.resets[..] else {
        panic!("{:?}", machine.chip.resets);
    };
    // 100 steps of 4 cycles of 32 kHz after its start.
    let micros = time::to_us(time);
    assert!((12_500.0..12_700.0).contains(&micros), "{micros} µs");
}

#[test]
#[ignore = "full: proofs of the emulator"]
fn misuse_ends_the_run_and_names_instruction_and_address() {
    let image = image("faults");
    for (misuse, place, address, what) in [
        (Misuse::Unclocked, "store_here", 0x4002_0000, "GPIOA is not clocked"),
        (Misuse::Unmodelled, "load_here", 0x4000_2800, "not modelled"),
        (Misuse::Null, "load_here", 0, "null pointer"),
        (Misuse::WaitStates, "store_here", 0x4002_3808, "wait states"),
    ] {
        let mut cpu = ready_to(&image, misuse);
        let failure = cpu.run_until(time::PER_SECOND).expect_err("the board has to stop");
        let here = image.symbol(place).expect("a global symbol") & !1;
        assert_eq!(failure.pc, here, "{misuse:?}: {failure}");
        assert_eq!(failure.address, Some(address), "{misuse:?}: {failure}");
        assert!(failure.what.contains(what), "{misuse:?}: {failure}");
    }
}
