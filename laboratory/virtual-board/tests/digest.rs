//! Digests of the programs that results come from.

use results::{Measurement, digest};
use virtual_board::emulator::wiring::Wiring;

use crate::common::{build_bootloader, is_built_here, product, products};

/// Digest of the program that is built now under this name.
///
/// # Panics
/// If there is no such program.
pub fn digest_of(name: &str) -> String {
    let elf = if name == Wiring::reference().program {
        product()
    } else if let Some(board) = name.strip_prefix("bootloader-").and_then(board_named) {
        std::fs::read(build_bootloader(board)).expect("it was built")
    } else {
        let found = products().into_iter().find(|(board, _)| board.program == name);
        found.unwrap_or_else(|| panic!("there is no {name}")).1
    };
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
