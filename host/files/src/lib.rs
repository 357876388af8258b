//! Files: their kinds by their first bytes, their compressions and encodings, and writing them completely or not at all.

pub mod compressed;
pub mod file_kind;
pub mod utf16;
pub mod whole_file;
