//! Files that are no log that can be read here, known by their first bytes, and what to do.

/// A kind of file, and what to do with one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Foreign {
    /// What it is.
    pub what: &'static str,
    /// What to do, in the imperative; `FILE` stands for its name.
    advice: &'static str,
    /// Where the bytes below stand.
    at: usize,
    /// What it begins with, or has there.
    magic: &'static [u8],
}

impl Foreign {
    /// What to do with the file of this name.
    #[must_use]
    pub fn advice_on(&self, file: &str) -> String {
        self.advice.replace("FILE", file)
    }
}

const fn foreign(magic: &'static [u8], what: &'static str, advice: &'static str) -> Foreign {
    Foreign {
        what,
        advice,
        at: 0,
        magic,
    }
}

/// For frames that another program can write as a log.
const BY_PYTHON_CAN: &str =
    "convert it with python-can: pip install python-can, then can_logconvert FILE can.asc";

/// For captures of a network.
const BY_WIRESHARK: &str = "record with candump -l, which is read here";

/// For recordings of topics.
const BY_TOPIC: &str = "it holds topics, no frames: see footfall replay and docs/formats.md";

/// For tables in another coding.
const BY_TABLE: &str = "write it as CSV";

const KNOWN: &[Foreign] = &[
    foreign(b"LOGG", "a Vector BLF log", BY_PYTHON_CAN),
    foreign(
        b"MDF     ",
        "a measurement in MDF (MF4)",
        "convert it with python-can: pip install python-can[mf4], then can_logconvert FILE can.asc",
    ),
    foreign(b"SQLite format 3\0", "an SQLite database", BY_PYTHON_CAN),
    foreign(b";$FILEVERSION", "a PEAK TRC log", BY_PYTHON_CAN),
    foreign(b";##########", "a PEAK TRC log", BY_PYTHON_CAN),
    foreign(b"\xd4\xc3\xb2\xa1", "a capture in PCAP", BY_WIRESHARK),
    foreign(b"\xa1\xb2\xc3\xd4", "a capture in PCAP", BY_WIRESHARK),
    foreign(b"\x4d\x3c\xb2\xa1", "a capture in PCAP", BY_WIRESHARK),
    foreign(b"\xa1\xb2\x3c\x4d", "a capture in PCAP", BY_WIRESHARK),
    foreign(b"\x0a\x0d\x0d\x0a", "a capture in PCAPNG", BY_WIRESHARK),
    foreign(b"\x89MCAP0\r\n", "a recording in MCAP", BY_TOPIC),
    foreign(b"#ROSBAG V", "a bag of ROS 1", BY_TOPIC),
    foreign(b"PAR1", "a Parquet table", BY_TABLE),
    foreign(b"\x89HDF\r\n\x1a\n", "a file of HDF5", BY_TABLE),
    foreign(b"PK\x03\x04", "a ZIP archive", "unpack it first"),
    foreign(b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it first"),
    foreign(
        b"\xfd7zXZ\0",
        "compressed with xz",
        "unpack it first: xz -d",
    ),
    foreign(b"BZh", "compressed with bzip2", "unpack it first: bzip2 -d"),
    foreign(
        b"\xff\xfe",
        "text in UTF-16",
        "write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8",
    ),
    foreign(
        b"\xfe\xff",
        "text in UTF-16",
        "write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8",
    ),
    Foreign {
        what: "a tar archive",
        advice: "unpack it first",
        at: 257,
        magic: b"ustar",
    },
];

/// What a file is that begins with these bytes; `None` where it may be a log.
#[must_use]
pub fn find(head: &[u8]) -> Option<&'static Foreign> {
    KNOWN.iter().find(|known| {
        let there = head.get(known.at..).unwrap_or_default();
        there.starts_with(known.magic)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_found_by_its_first_bytes_and_not_by_fewer() {
        for known in KNOWN {
            let file = [&vec![b' '; known.at], known.magic, b"more"].concat();
            assert_eq!(find(&file).map(|found| found.what), Some(known.what));
            assert_eq!(find(&file[..known.at + known.magic.len() - 1]), None);
        }
        assert_eq!(find(b"(1609459200.000114) can0 191#FF"), None);
        assert_eq!(find(b""), None);
    }
}
