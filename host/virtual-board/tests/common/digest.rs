//! Digests of the programs that generated blocks of the pages come from.

use bootloader::image::HEADER;
use bootloader::layout::Slot;
use bootloader::verify::Hash;
use host_tests::committed::assert_block;
use virtual_board::emulator::elf::ElfImage;
use virtual_board::emulator::wiring::Wiring;

use super::{build_bootloader, is_built_here, product, products};

/// Page with the generated blocks but those of faults.
pub const README: &str = "host/virtual-board/README.md";

/// Page with the generated blocks of faults.
const FAULTS: &str = "host/virtual-board/faults.md";

/// Page of a generated block.
pub fn page_of(block: &str) -> &'static str {
    match block {
        "faults" | "corners" | "pairs" => FAULTS,
        _ => README,
    }
}

/// Beginning of the last line of a block that tests outside of the default run generate.
pub const RUN_ON: &str = "Run on ";

/// Digest of an ELF: the first bytes of the SHA-256 of addresses and contents that are loaded. The header in front of a
/// program is left out, as it contains the commit.
pub fn digest(elf: &[u8]) -> String {
    let mut segments = ElfImage::parse(elf).expect("it is an ELF").segments;
    segments.sort();
    let header = Slot::Running.start()..Slot::Running.start() + HEADER as u32;
    let mut hash = Hash::new();
    for (start, bytes) in segments {
        let loaded = (start..).zip(bytes);
        for (address, byte) in loaded.filter(|(address, _)| !header.contains(address)) {
            hash.update(&address.to_le_bytes());
            hash.update(&[byte]);
        }
    }
    let first = hash.finish().into_iter().take(8);
    first.map(|byte| format!("{byte:02x}")).collect()
}

/// Digest of the program that is built now under this name; `None` if its source is absent.
pub fn digest_of(name: &str) -> Option<String> {
    let reference = Wiring::reference();
    if name == reference.program {
        return Some(digest(&product()?));
    }
    let board = Wiring::all().iter().find(|board| name == format!("bootloader-{}", board.name));
    if let Some(board) = board {
        let elf = std::fs::read(build_bootloader(board)).expect("it was built");
        return Some(digest(&elf));
    }
    let mut products = products().into_iter();
    let (_, elf) = products.find(|(board, _)| board.program == name)?;
    Some(digest(&elf))
}

/// Checks a block that a test outside of the default run generates on these programs. Its last line names their digests,
/// which `tests/digests.rs` compares with those of the programs that are built.
pub fn assert_block_of(programs: &[&str], block: &str, content: &str) {
    if !is_built_here() {
        return;
    }
    let named = programs.iter().map(|name| {
        let digest = digest_of(name).unwrap_or_else(|| panic!("there is no {name}"));
        format!("`{name}` {digest}")
    });
    let named: Vec<String> = named.collect();
    // A line behind a table needs a blank one before it, or it would be a row.
    let content = format!("{content}\n{RUN_ON}{}.\n", named.join(", "));
    assert_block(page_of(block), block, &content);
}
