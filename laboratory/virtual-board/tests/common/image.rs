//! Images of the product for updates.

use bootloader::flash::Slot;
use bootloader::image::{HEADER, Header, Sources, USED};
use program_images::{DEVELOPMENT_KEY, ProgramOrigin, image};
use virtual_board::emulator::elf::ElfImage;

/// Version of the product, and of its image with another version in its texts.
pub const OLD: &str = "0.1.0";
pub const NEW: &str = "0.1.9";

/// Number of a program that a probe has written, by the header in its ELF.
pub fn number_of(elf: &[u8]) -> u32 {
    let parsed = ElfImage::parse(elf).expect("an ELF");
    let header = parsed
        .segments
        .iter()
        .find_map(|(start, bytes)| (*start == Slot::Running.start()).then_some(bytes));
    let mut bytes = [0xFF; HEADER];
    bytes[..USED].copy_from_slice(&header.expect("a header")[..USED]);
    let header = Header::decode(&bytes).expect("a header");
    header.identification()
}

/// Origin of an image, with this sequence.
pub const fn origin(sequence: u32) -> ProgramOrigin {
    ProgramOrigin { version: [0, 1, 1], commit: [1; 20], sources: Sources::Committed, sequence }
}

/// Image of the product after a change.
pub fn changed_image(elf: &[u8], change: impl FnOnce(&mut [u8])) -> Vec<u8> {
    let mut elf = elf.to_vec();
    change(&mut elf);
    image(&elf, &origin(100), DEVELOPMENT_KEY).expect("a program")
}

/// Image of the product with another version.
pub fn new_image(elf: &[u8]) -> Vec<u8> {
    changed_image(elf, other_version)
}

fn find(bytes: &[u8], wanted: &[u8]) -> usize {
    let mut places = bytes.windows(wanted.len());
    places.position(|at| at == wanted).expect("it is there")
}

/// Changes the version that object 0x100A shows.
fn other_version(elf: &mut [u8]) {
    let at = find(elf, OLD.as_bytes());
    elf[at..at + NEW.len()].copy_from_slice(NEW.as_bytes());
}

/// Image of a program that begins with these instructions.
pub fn image_beginning_with(elf: &[u8], code: &[u8]) -> Vec<u8> {
    changed_image(elf, |elf| {
        let parsed = ElfImage::parse(elf).expect("an ELF");
        let reset = parsed.symbol("Reset").expect("a handler") & !1;
        let holds_it = |(start, bytes): &&(u32, Vec<u8>)| {
            (*start..*start + bytes.len() as u32).contains(&reset)
        };
        let (start, bytes) = parsed.segments.iter().find(holds_it).expect("its segment");
        let at = find(elf, bytes) + (reset - start) as usize;
        elf[at..at + code.len()].copy_from_slice(code);
    })
}

/// Number of an image, as object 0x1F56 shows it.
pub fn identification(image: &[u8]) -> u32 {
    let header = Header::decode(image.first_chunk().expect("a header"));
    header.expect("a header").identification()
}
