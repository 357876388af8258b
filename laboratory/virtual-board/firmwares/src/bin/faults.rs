//! Provokes one fault, and records how the processor reports it.

#![no_std]
#![no_main]

use board_proofs::{Misuse, mailbox};
use core::arch::global_asm;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use cortex_m_semihosting::debug;

global_asm!(
    ".syntax unified",
    ".thumb",
    ".global undefined_here, load_here, store_here, float_here",
    ".thumb_func",
    ".global do_undefined",
    "do_undefined: nop",
    "undefined_here: udf #1",
    "bx lr",
    ".thumb_func",
    ".global do_load",
    "do_load: movs r1, #1",
    "adds r1, r1, #1",
    "load_here: ldr r2, [r0]",
    "adds r1, r1, #1",
    "bx lr",
    ".thumb_func",
    ".global do_store",
    "do_store: nop",
    "store_here: str r1, [r0]",
    "bx lr",
    ".thumb_func",
    ".global do_float",
    "do_float: movs r1, #1",
    "adds r1, r1, #1",
    "float_here: vadd.f32 s0, s0, s1",
    "bx lr",
);

unsafe extern "C" {
    fn do_undefined();
    fn do_load(address: u32);
    fn do_store(address: u32, value: u32);
    fn do_float();
}

fn put(address: u32, value: u32) {
    // SAFETY: the mailbox is CCM RAM that nothing else uses.
    unsafe { (address as *mut u32).write_volatile(value) };
}

fn get(address: u32) -> u32 {
    // SAFETY: a word of CCM RAM, or a register of RCC whose reading has no effect.
    unsafe { (address as *const u32).read_volatile() }
}

const RCC: u32 = 0x4002_3800;
const RCC_CSR: u32 = 0x4002_3874;
const IWDG: u32 = 0x4000_3000;

#[entry]
fn main() -> ! {
    put(mailbox::STARTS, get(mailbox::STARTS).wrapping_add(1));
    let misuse = get(mailbox::MISUSE);
    if misuse == Misuse::Watchdog as u32 {
        put(mailbox::RESET_FLAGS, get(RCC_CSR));
        // RMVF clears the flags, so that the next start does not see those of this one.
        put(RCC_CSR, 1 << 24);
        if get(mailbox::STARTS) > 1 {
            end();
        }
    }
    // SAFETY: the only user of the core's peripherals.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    match Misuse::ALL.into_iter().find(|&one| one as u32 == misuse) {
        // SAFETY: each of these is meant to fault.
        Some(Misuse::Undefined) => unsafe { do_undefined() },
        // SAFETY: as above.
        Some(Misuse::Load) => unsafe { do_load(0x6000_0000) },
        Some(Misuse::Float) => {
            core.SCB.enable(cortex_m::peripheral::scb::Exception::UsageFault);
            // SAFETY: switches the floating-point unit off, whose use then faults.
            unsafe {
                core.SCB.cpacr.write(0);
                cortex_m::asm::isb();
                do_float();
            }
        }
        Some(Misuse::Watchdog) => {
            put(IWDG, 0x5555);
            put(IWDG + 4, 0);
            put(IWDG + 8, 99);
            put(IWDG, 0xCCCC);
        }
        // SAFETY: the board stops here.
        Some(Misuse::Unclocked) => unsafe { do_store(0x4002_0000, 1) },
        // SAFETY: as above.
        Some(Misuse::Unmodelled) => unsafe { do_load(0x4000_2800) },
        // SAFETY: as above.
        Some(Misuse::Null) => unsafe { do_load(0) },
        Some(Misuse::WaitStates) => {
            // The PLL from HSI: 16 MHz / 8 × 120 / 2 = 120 MHz, APB1 a quarter, APB2 half.
            put(RCC + 4, 8 | 120 << 6);
            put(RCC, get(RCC) | 1 << 24);
            while get(RCC) & 1 << 25 == 0 {}
            // SAFETY: the board stops here.
            unsafe { do_store(RCC + 8, 2 | 5 << 10 | 4 << 13) }
        }
        None => {}
    }
    loop {
        cortex_m::asm::nop();
    }
}

fn end() -> ! {
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

fn note(handler: u32, pc: u32) {
    // SAFETY: reading status registers.
    let (cfsr, hfsr) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).hfsr.read()) };
    put(mailbox::PC, pc);
    put(mailbox::CFSR, cfsr);
    put(mailbox::HFSR, hfsr);
    put(mailbox::HANDLER, handler);
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    note(3, frame.pc());
    end()
}

#[exception]
fn UsageFault() -> ! {
    let frame: *const ExceptionFrame;
    // SAFETY: the frame lies above what this function has pushed; its own pushes are skipped by
    // looking for the program counter that must be there.
    unsafe { core::arch::asm!("mov {}, sp", out(reg) frame) };
    let words = frame.cast::<u32>();
    let target = do_float as *const () as u32 & !1;
    let mut pc = 0;
    for index in 0..64 {
        // SAFETY: the stack goes on for longer than this.
        let word = unsafe { words.add(index).read_volatile() };
        if word.wrapping_sub(target) < 16 {
            pc = word;
            break;
        }
    }
    note(6, pc);
    end()
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::nop();
    }
}
