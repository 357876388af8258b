//! Digests of the programs that results come from.

use results::{Measurement, digest};
use virtual_board::emulator::wiring::Wiring;

use super::{build_bootloader, is_built_here, product, products};

/// Digest of the program that is built now under this name.
///
/// # Panics
/// If there is no such program, or its source is absent.
pub fn digest_of(name: &str) -> String {
    let elf = if name == Wiring::reference().program {
        product()
    } else if let Some(board) = name.strip_prefix("bootloader-").and_then(board_named) {
        Some(std::fs::read(build_bootloader(board)).expect("it was built"))
    } else {
        products().into_iter().find(|(board, _)| board.program == name).map(|(_, elf)| elf)
    };
    let elf = elf.unwrap_or_else(|| panic!("there is no {name}"));
    digest(&elf).expect("an ELF")
}

fn board_named(name: &str) -> Option<&'static Wiring> {
    Wiring::all().iter().find(|board| board.name == name)
}

/// Compares a result that was measured on these programs with the stored one, or writes it. Programs from elsewhere,
/// which `FOOTFALL_ELF` names, are not compared.
pub fn assert_reproduced_on<T: AsRef<str>>(programs: &[T], mut result: Measurement) {
    if !is_built_here() {
        return;
    }
    for name in programs {
        result = result.on_elf(name.as_ref(), digest_of(name.as_ref()));
    }
    result.assert_reproduced();
}
