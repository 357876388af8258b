//! Parser for an ELF, as a programmer writes it to flash.

use crate::emulator::memory::FLASH;
use object::{Object, ObjectSegment, ObjectSymbol};
use thiserror::Error;

/// The parts of an ELF that the board needs.
#[derive(Clone, Debug, Default)]
pub struct ElfImage {
    /// Load addresses and their bytes.
    pub segments: Vec<(u32, Vec<u8>)>,
    /// Names and addresses.
    pub symbols: Vec<(String, u32)>,
    /// Functions: address, size and name, in order of addresses.
    pub functions: Vec<(u32, u32, String)>,
}

/// Reason why an ELF cannot be loaded.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the ELF cannot be loaded: {0}")]
pub struct ElfError(pub String);

impl ElfImage {
    /// Parses an ELF.
    ///
    /// # Errors
    /// If it is not an ELF for a 32-bit Arm.
    pub fn parse(elf: &[u8]) -> Result<Self, ElfError> {
        use object::read::elf::{FileHeader, ProgramHeader};
        let refused = |error: object::Error| ElfError(error.to_string());
        let header =
            object::elf::FileHeader32::<object::Endianness>::parse(elf).map_err(refused)?;
        let endian = header.endian().map_err(refused)?;
        if header.e_machine(endian) != object::elf::EM_ARM {
            return Err(ElfError("it is not for Arm".into()));
        }
        let mut image = Self::default();
        // Load addresses, not those at run time: .data lies in flash until the start-up copies it.
        for segment in header.program_headers(endian, elf).map_err(refused)? {
            let bytes = segment
                .data(endian, elf)
                .map_err(|()| ElfError("a segment lies outside the file".into()))?;
            if segment.p_type(endian) == object::elf::PT_LOAD && !bytes.is_empty() {
                image.segments.push((segment.p_paddr(endian), bytes.to_vec()));
            }
        }
        let file = object::File::parse(elf).map_err(refused)?;
        debug_assert!(file.segments().all(|segment| segment.address() <= u64::from(u32::MAX)));
        for symbol in file.symbols() {
            if let Ok(name) = symbol.name()
                && !name.is_empty()
            {
                let address = symbol.address() as u32;
                image.symbols.push((name.to_owned(), address));
                if symbol.kind() == object::SymbolKind::Text && symbol.size() > 0 {
                    let size = symbol.size() as u32;
                    image.functions.push((address & !1, size, name.to_owned()));
                }
            }
        }
        image.functions.sort();
        Ok(image)
    }

    /// Address of the vector table: the start of the flash, or later for a program that a bootloader starts.
    #[must_use]
    pub fn vectors(&self) -> u32 {
        self.symbol("__vector_table").unwrap_or(FLASH.start)
    }

    /// Name of the function that contains an address.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&str> {
        let index = self.functions.partition_point(|(start, _, _)| *start <= address);
        let (start, size, name) = self.functions.get(index.checked_sub(1)?)?;
        (address - start < *size).then_some(name.as_str())
    }

    /// Address of a symbol.
    #[must_use]
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.iter().find_map(|(other, address)| (other == name).then_some(*address))
    }
}
