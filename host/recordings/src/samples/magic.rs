//! Kinds of files, recognised by their first bytes.

use crate::samples::foreign::Foreign;

/// Bytes required to recognise a file: the mark of a tar archive comes last.
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
    // pcap in both byte orders, with µs and ns; pcapng.
    (b"\xd4\xc3\xb2\xa1", Foreign::Capture),
    (b"\xa1\xb2\xc3\xd4", Foreign::Capture),
    (b"\x4d\x3c\xb2\xa1", Foreign::Capture),
    (b"\xa1\xb2\x3c\x4d", Foreign::Capture),
    (b"\x0a\x0d\x0d\x0a", Foreign::Capture),
    (b"MDF     ", Foreign::Mdf),
    (b"UnFinMF ", Foreign::Mdf),
    (b"LOGG", Foreign::Blf),
    // Protocols of pickle since Python 2.3; earlier ones are text.
    (b"\x80\x02", Foreign::Pickle),
    (b"\x80\x03", Foreign::Pickle),
    (b"\x80\x04", Foreign::Pickle),
    (b"\x80\x05", Foreign::Pickle),
    (b"ARROW1", Foreign::ArrowIpc),
    (b"FEA1", Foreign::ArrowIpc),
    (b"ULog\x01\x12\x35", Foreign::ULog),
    // Message that describes the messages.
    (b"\xa3\x95\x80", Foreign::DataFlash),
    (b"\x89PNG\r\n\x1a\n", Foreign::Picture),
    (b"\xff\xd8\xff", Foreign::Picture),
    (b"GIF8", Foreign::Picture),
    (b"%PDF-", Foreign::Pdf),
    (b";$FILEVERSION", Foreign::Trc),
    (b";##########", Foreign::Trc),
    (b"7z\xbc\xaf\x27\x1c", Foreign::SevenZip),
    (b"\xfd7zXZ\0", Foreign::Xz),
    (b"BZh", Foreign::Bzip2),
    // One compression has already been removed: such a file was compressed twice.
    (b"\x1f\x8b\x08", Foreign::CompressedTwice),
    (b"\x28\xb5\x2f\xfd", Foreign::CompressedTwice),
    // Byte order marks.
    (b"\xff\xfe", Foreign::Utf16),
    (b"\xfe\xff", Foreign::Utf16),
];

/// Position and content of the mark of a tar archive.
const TAR: (usize, &[u8]) = (257, b"ustar");

/// Header of a member of a ZIP archive, and its length without the member's name.
const ZIP: (&[u8], usize) = (b"PK\x03\x04", 30);

/// Kind of a file, by its first [`LENGTH`] bytes; `None` if it may be a table.
#[must_use]
pub fn known(first: &[u8]) -> Option<Foreign> {
    BEGINNINGS
        .iter()
        .find(|(beginning, _)| first.starts_with(beginning))
        .map(|(_, kind)| *kind)
        .or_else(|| zip(first))
        .or_else(|| tar(first))
        .or_else(|| text(first))
}

/// Kind of a file that should be a log of frames, by its first `LENGTH` bytes or more; `None` if it may be one.
#[must_use]
pub fn no_log(first: &[u8]) -> Option<Foreign> {
    let kind = known(first)?;
    // A recording of the serial line may begin inside a frame, and a reading of −2 has the bytes of this mark.
    if kind == Foreign::Utf16 && !begins_with_ascii_in_utf16(first) {
        return None;
    }
    kind.log_advice("").is_some().then_some(kind)
}

/// Returns whether the first four characters after a byte order mark, or all of a shorter text, are ASCII in UTF-16.
fn begins_with_ascii_in_utf16(first: &[u8]) -> bool {
    let character: fn([u8; 2]) -> u16 = match first {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        _ => u16::from_be_bytes,
    };
    let (characters, _) = first.get(2..).unwrap_or_default().as_chunks();
    let mut start = characters.iter().take(4);
    start.all(|bytes| (1..0x80).contains(&character(*bytes)))
}

/// Kind of ZIP archive, by the name of its first member.
fn zip(first: &[u8]) -> Option<Foreign> {
    let (beginning, length) = ZIP;
    if !first.starts_with(beginning) {
        return None;
    }
    let name_length = first.get(26..28).map_or(0, |bytes| {
        usize::from(bytes[0]) | usize::from(bytes[1]) << 8
    });
    let name = first.get(length..).unwrap_or_default();
    let name = &name[..name_length.min(name.len())];
    Some(if name.ends_with(b".npy") {
        Foreign::NumpyArchive
    } else if name == b"[Content_Types].xml" || name.starts_with(b"xl/") {
        Foreign::Excel
    } else {
        Foreign::Zip
    })
}

fn tar(first: &[u8]) -> Option<Foreign> {
    let (at, name) = TAR;
    let is_tar = first.get(at..).is_some_and(|rest| rest.starts_with(name));
    is_tar.then_some(Foreign::Tar)
}

/// Returns whether a text after its first `<` is HTML.
fn is_html(rest: &[u8]) -> bool {
    let begins = |word: &[u8]| {
        let beginning = rest.get(..word.len()).unwrap_or_default();
        beginning.eq_ignore_ascii_case(word)
    };
    [&b"!doctype html"[..], b"html", b"head"]
        .into_iter()
        .any(begins)
}

/// A text that is not a table.
fn text(first: &[u8]) -> Option<Foreign> {
    let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first);
    let text = text.trim_ascii_start();
    let (beginning, rest) = text.split_first()?;
    let second = rest.trim_ascii_start().first().copied();
    match (beginning, second) {
        (b'{', Some(b'"' | b'}')) => Some(Foreign::Json),
        (b'[', Some(b'{' | b'[' | b'"' | b'-' | b'0'..=b'9')) => Some(Foreign::Json),
        (b'<', _) if is_html(rest) => Some(Foreign::Html),
        (b'(', _) => is_can_log(rest).then_some(Foreign::CanLog),
        _ => None,
    }
}

/// Returns whether the text is `1700000000.123456) can0 191#0011` or a prefix of it.
fn is_can_log(after_bracket: &[u8]) -> bool {
    let line = after_bracket.split(|byte| *byte == b'\n').next();
    let mut words = line.unwrap_or_default().split(|byte| *byte == b' ');
    let time = words.next().and_then(|word| word.strip_suffix(b")"));
    let is_time = time.is_some_and(|time| time.iter().all(|b| b.is_ascii_digit() || *b == b'.'));
    is_time && words.nth(1).is_some_and(|frame| frame.contains(&b'#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_recognised_in_some_file() {
        let mut tar = vec![b'a'; 257];
        tar.extend_from_slice(b"ustar\x0000");
        let zip = |name: &str| {
            let mut zip = b"PK\x03\x04".to_vec();
            zip.resize(30, 0);
            zip[26] = name.len() as u8;
            zip.extend_from_slice(name.as_bytes());
            zip.extend_from_slice(b"content");
            zip
        };
        let others: [(Vec<u8>, Foreign); 10] = [
            (b"\n<!DOCTYPE html>\n<html>".to_vec(), Foreign::Html),
            (b"<HTML lang=\"en\"><body>".to_vec(), Foreign::Html),
            (tar, Foreign::Tar),
            (zip("arr_0.npy"), Foreign::NumpyArchive),
            (zip("[Content_Types].xml"), Foreign::Excel),
            (zip("walk.csv"), Foreign::Zip),
            (b"\xef\xbb\xbf{\n \"t\": 0}".to_vec(), Foreign::Json),
            (b"[[0, 1], [2, 3]]".to_vec(), Foreign::Json),
            (
                b"(1700000000.123456) can0 191#0011\n".to_vec(),
                Foreign::CanLog,
            ),
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
        let kinds: Vec<_> = BEGINNINGS
            .iter()
            .filter_map(|(first, _)| Some((*first, no_log(first)?)))
            .collect();
        for (first, kind) in &kinds {
            let more: &[u8] = match *first {
                b"\xff\xfe" => b"(\x001\0",
                b"\xfe\xff" => b"\0(\x001",
                _ => b"more",
            };
            assert_eq!(no_log(&[*first, more].concat()), Some(*kind));
            assert_eq!(no_log(&first[..first.len() - 1]), None, "{kind}");
        }
        for kind in [
            Foreign::Blf,
            Foreign::Mcap,
            Foreign::Parquet,
            Foreign::Sqlite,
            Foreign::Trc,
            Foreign::Utf16,
        ] {
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
