//! A pure kernel: no interrupts, no peripherals; its instructions are counted.

#![no_std]
#![no_main]

use board_proofs::Orbit;
use core::hint::black_box;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[entry]
fn main() -> ! {
    let mut orbit = Orbit::new(black_box(3));
    orbit.advance(black_box(20_000));
    let mut words = [0_u32; 64];
    for round in 0..500_u32 {
        for (index, word) in words.iter_mut().enumerate() {
            let mixed = word.rotate_left(5) ^ (index as u32).wrapping_mul(0x9E37_79B9) ^ round;
            *word = if mixed & 4 == 0 { mixed / 7 } else { mixed };
        }
        black_box(&mut words);
    }
    let sum = words
        .iter()
        .fold(0_u32, |sum, word| sum.wrapping_add(*word));
    hprintln!("{:08x?} {:08x}", orbit.bits(), sum);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::nop();
    }
}
