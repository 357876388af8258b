//! Kinds of files, recognised by their first bytes.

use crate::samples::foreign::Foreign;

/// Bytes required to recognise a file.
pub const LENGTH: usize = 512;

/// First bytes of each kind of file.
const BEGINNINGS: &[(&[u8], Foreign)] = &[
    // https://mcap.dev/spec#magic
    (b"\x89MCAP0\r\n", Foreign::Mcap),
    (b"SQLite format 3\0", Foreign::Sqlite),
    (b"PAR1", Foreign::Parquet),
    // Parquet with an encrypted footer.
    (b"PARE", Foreign::Parquet),
    (b"#ROSBAG V", Foreign::Ros1Bag),
    (b"\x89HDF\r\n\x1a\n", Foreign::Hdf5),
    (b"MATLAB 5.0 MAT-file", Foreign::Matlab),
    (b"MATLAB 7.3 MAT-file", Foreign::Matlab),
    (b"\x93NUMPY", Foreign::Numpy),
    // Old Office format.
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", Foreign::Excel),
    (b"LOGG", Foreign::Blf),
    (b";$FILEVERSION", Foreign::Trc),
    (b";##########", Foreign::Trc),
    // One compression has already been removed: such a file was compressed twice.
    (b"\x1f\x8b\x08", Foreign::CompressedTwice),
    (b"\x28\xb5\x2f\xfd", Foreign::CompressedTwice),
    // JSON, HTML and XML.
    (b"{\"", Foreign::Other),
    (b"{\n", Foreign::Other),
    (b"[{", Foreign::Other),
    (b"[[", Foreign::Other),
    (b"<!", Foreign::Other),
    (b"<?", Foreign::Other),
    (b"<html", Foreign::Other),
];

/// Kind of a file, by its first [`LENGTH`] bytes; `None` if it may be a table.
#[must_use]
pub fn known(first: &[u8]) -> Option<Foreign> {
    BEGINNINGS
        .iter()
        .find(|(beginning, _)| first.starts_with(beginning))
        .map(|(_, kind)| *kind)
        .or_else(|| zip(first))
        .or_else(|| other(first))
}

/// Kind of a file that should be a log of frames, by its first `LENGTH` bytes or more; `None` if it may be one.
#[must_use]
pub fn no_log(first: &[u8]) -> Option<Foreign> {
    known(first).filter(|kind| kind.log_advice("").is_some())
}

/// Kind of ZIP archive, by the names of its first members.
fn zip(first: &[u8]) -> Option<Foreign> {
    let has = |name: &[u8]| first.windows(name.len()).any(|part| part == name);
    first.starts_with(b"PK\x03\x04").then(|| {
        if has(b".npy") {
            Foreign::Numpy
        } else if has(b"[Content_Types].xml") || has(b"xl/") {
            Foreign::Excel
        } else {
            Foreign::Zip
        }
    })
}

/// Kind of a file by its first line, in which a table has no zero.
fn other(first: &[u8]) -> Option<Foreign> {
    let line = first.split(|byte| *byte == b'\n').next()?;
    match line.contains(&0) {
        true => Some(Foreign::Other),
        false => is_can_log(line).then_some(Foreign::CanLog),
    }
}

/// Returns whether a line is `(1700000000.123456) can0 191#0011` or a prefix of it.
fn is_can_log(line: &[u8]) -> bool {
    let mut words = line.split(|byte| *byte == b' ');
    let time = words.next().and_then(|word| word.strip_prefix(b"("));
    let time = time.and_then(|word| word.strip_suffix(b")"));
    let is_time = time.is_some_and(|time| time.iter().all(|b| b.is_ascii_digit() || *b == b'.'));
    is_time && words.nth(1).is_some_and(|frame| frame.contains(&b'#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_recognised_in_some_file() {
        let zip = |name: &str| {
            let mut zip = b"PK\x03\x04".to_vec();
            zip.resize(30, 0);
            zip[26] = name.len() as u8;
            zip.extend_from_slice(name.as_bytes());
            zip.extend_from_slice(b"content");
            zip
        };
        let others: [(Vec<u8>, Foreign); 9] = [
            (b"<!DOCTYPE html>\n<html>".to_vec(), Foreign::Other),
            (b"{\n \"t\": 0}".to_vec(), Foreign::Other),
            (b"[[0, 1], [2, 3]]".to_vec(), Foreign::Other),
            // UTF-16.
            (b"\xff\xfet\0,\0".to_vec(), Foreign::Other),
            (zip("arr_0.npy"), Foreign::Numpy),
            (zip("[Content_Types].xml"), Foreign::Excel),
            (zip("walk.csv"), Foreign::Zip),
            (b"(1700000000.123456) can0 191#0011\n".to_vec(), Foreign::CanLog),
            (b"(0.0) vcan0 191##1".to_vec(), Foreign::CanLog),
        ];
        for (first, foreign) in &others {
            assert_eq!(known(first), Some(*foreign), "{foreign}");
        }
        for foreign in Foreign::ALL {
            let by_beginning = BEGINNINGS.iter().any(|(_, known)| *known == foreign);
            let by_other = others.iter().any(|(_, known)| *known == foreign);
            assert!(by_beginning || by_other, "{foreign}");
        }
    }

    #[test]
    fn foreign_logs_are_recognised_only_by_complete_magic() {
        let kinds: Vec<_> =
            BEGINNINGS.iter().filter_map(|(first, _)| Some((*first, no_log(first)?))).collect();
        for (first, kind) in &kinds {
            assert_eq!(no_log(&[*first, b"more"].concat()), Some(*kind));
            assert_eq!(no_log(&first[..first.len() - 1]), None, "{kind}");
        }
        for kind in [Foreign::Blf, Foreign::Mcap, Foreign::Parquet, Foreign::Sqlite, Foreign::Trc] {
            assert!(kinds.iter().any(|(_, known)| *known == kind), "{kind}");
        }
        // A log, and possible first bytes of a recording of the serial line.
        for first in [
            &b"(1609459200.000114) can0 191#FF"[..],
            b"",
            b"\x80\x02",
            b"\xff\xfe\x05\0\x0b\x01",
            b"\xfe\xff\x41\x02\x7f\0",
        ] {
            assert_eq!(no_log(first), None, "{first:?}");
        }
    }

    #[test]
    fn tables_are_not_recognised_as_foreign() {
        for table in [
            "",
            "t,ax,ay,az,wx,wy,wz\n",
            "# made by x\nt,ax\n",
            "[t],[ax]\n",
            "(t),(ax)\n",
            "{t},ax\n",
            "0.1 0.2\n",
            "P",
            "PK,other\n",
        ] {
            assert_eq!(known(table.as_bytes()), None, "{table}");
        }
    }
}
