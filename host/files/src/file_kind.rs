//! Kinds of files other than tables: their first bytes, their names, and advice for each. One table serves recordings
//! and logs of frames.

use std::path::Path;

use wire::uart::Decoder;

/// Advice for frames that another program can write as a log.
const BY_PYTHON_CAN: &str =
    "convert it with python-can: pip install python-can, then can_logconvert FILE can.log";

const UNPACK: &str = "unpack it";

/// Advice for a file of a kind.
struct Advice {
    /// Advice for a file given as a recording that cannot be read; `None` if every file of the kind is read.
    recording: Option<&'static str>,
    /// Advice for a file given as a log, with `FILE` for its name; `None` if it is read, or if a recording of the
    /// serial line may have the same first bytes.
    log: Option<&'static str>,
}

/// Defines the kinds by name, with its article, advice for a recording and advice for a log, as in [`Advice`].
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $recording:expr, $log:expr;)+) => {
        samples::named! {
            /// A kind of file other than a table.
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub enum FileKind {
                $($(#[$doc])* $kind = $name),+
            }
        }

        impl FileKind {
            const fn advice_for(self) -> Advice {
                match self {
                    $(Self::$kind => Advice { recording: $recording, log: $log }),+
                }
            }
        }
    };
}

kinds! {
    /// A bag of ROS 1.
    Ros1Bag = "a ROS 1 bag",
        None,
        Some("it holds topics, no frames: replay it, see docs/reference/formats.md");
    /// A bag of ROS 1 before 2010.
    OldRos1Bag = "a ROS 1 bag of a version before 2.0",
        Some("write it again with ROS 1: rosbag filter walk.bag new.bag True"),
        Some("it holds topics, no frames: replay it, see docs/reference/formats.md");
    /// HDF5, also of pandas.
    Hdf5 = "an HDF5 file",
        Some("write a table of it: pandas.read_hdf(…).to_parquet(\"walk.parquet\"), or h5py"),
        Some("write it as CSV");
    /// MATLAB's MAT-file, except version 4, which has no magic bytes.
    Matlab = "a MATLAB file",
        Some("write a table in MATLAB: writetable(walk, \"walk.csv\"), or in Python: \
             m = scipy.io.loadmat(\"walk.mat\"), then numpy.savetxt(\"walk.csv\", numpy.column_stack([m[\"t\"].ravel(), \
             m[\"acc\"], m[\"gyr\"]]), delimiter=\",\", header=\"t,ax,ay,az,wx,wy,wz\") with the names in m"),
        None;
    /// An archive of `NumPy` arrays.
    Npz = "an archive of NumPy arrays",
        Some("write a table: m = numpy.load(\"walk.npz\"), then numpy.savetxt(\"walk.csv\", \
             numpy.column_stack([m[\"t\"], m[\"acc\"], m[\"gyr\"]]), delimiter=\",\", \
             header=\"t,ax,ay,az,wx,wy,wz\") with the names in m.files"),
        None;
    /// A `NumPy` array.
    Numpy = "a file of NumPy",
        Some("write a table: numpy.savetxt(\"walk.csv\", walk, delimiter=\",\", \
             header=\"t,ax,ay,az,wx,wy,wz\")"),
        None;
    /// A sheet of Excel.
    Excel = "an Excel file",
        Some("save the sheet as CSV, or pip install pandas openpyxl, then \
             pandas.read_excel(\"walk.xlsx\").to_csv(\"walk.csv\", index=False)"),
        Some(UNPACK);
    /// A log of PX4.
    Ulog = "a ULog of PX4",
        Some("convert it: pip install pyulog, then ulog2csv -m sensor_combined walk.ulg, whose times are in us"),
        Some("it holds topics, no frames: see docs/reference/formats.md");
    /// A table in the format of Arrow, also of `to_feather`.
    Feather = "a Feather table",
        Some("write it as Parquet: pandas.read_feather(\"walk.feather\").to_parquet(\"walk.parquet\")"),
        Some("write it as CSV");
    /// An object of Python.
    Pickle = "a pickle of Python",
        Some("write a table, if you trust its source, since loading a pickle runs its code: \
             pandas.read_pickle(\"walk.pkl\").to_parquet(\"walk.parquet\")"),
        None;
    /// A ZIP archive.
    Zip = "a ZIP archive", Some(UNPACK), Some(UNPACK);
    /// A log of Vector's tools.
    Blf = "a BLF log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.blf walk.log; then decode that"),
        Some(BY_PYTHON_CAN);
    /// A log of PEAK's tools.
    Trc = "a PEAK TRC log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.trc walk.log; then decode that"),
        Some(BY_PYTHON_CAN);
    /// Log of `candump -l`.
    CanLog = "a CAN log", Some("decode it: it holds frames, no samples"), None;
    /// Frames of a foot's serial line.
    SerialLog = "a recording of a foot's serial line", Some("decode it: it holds frames, no samples"), None;
    /// A file compressed with brotli, which has no magic bytes.
    Brotli = "compressed with brotli", Some("unpack it: brotli -d"), Some("unpack it: brotli -d");
    /// Database of `SQLite`. A database with the tables of a rosbag2 is read as a bag; the advice is for all others.
    Sqlite = "an SQLite database without the tables of a rosbag2",
        Some("write a table: sqlite3 -header -csv walk.db \"SELECT …\""),
        Some(BY_PYTHON_CAN);
    /// MCAP.
    Mcap = "a recording in MCAP",
        None,
        Some("it holds topics, no frames: replay it, see docs/reference/formats.md");
    /// Parquet.
    Parquet = "a Parquet table", None, Some("write it as CSV");
    /// A file compressed with gzip or zstd twice.
    CompressedTwice = "compressed twice",
        Some("unpack it once: gzip -d, or zstd -d"),
        Some("unpack it once: gzip -d, or zstd -d");
    /// Any other file that is not a table in UTF-8.
    Other = "no table in UTF-8",
        Some("write one: pandas.DataFrame(…).to_csv(\"walk.csv\", index=False)"),
        None;
}

impl FileKind {
    /// Kind of a file, by its first [`LENGTH`] bytes; `None` if it may be a table.
    #[must_use]
    pub fn of_first_bytes(first: &[u8]) -> Option<Self> {
        BEGINNINGS
            .iter()
            .find(|(beginning, _)| first.starts_with(beginning))
            .map(|(_, kind)| *kind)
            .or_else(|| zip(first))
            .or_else(|| serial_log(first))
            .or_else(|| other(first))
    }

    /// Kind of a file that only its name shows, if its first bytes do not.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension().unwrap_or_default();
        extension.eq_ignore_ascii_case("br").then_some(Self::Brotli)
    }

    /// Advice for a file given as a recording that cannot be read; `None` if every file of the kind is read.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        self.advice_for().recording
    }

    /// Advice for a file of this name given as a log; `None` if it may be one.
    #[must_use]
    pub fn log_advice(self, file: &str) -> Option<String> {
        self.advice_for().log.map(|advice| advice.replace("FILE", file))
    }
}

/// Bytes required to recognise a file.
pub const LENGTH: usize = 512;

/// First bytes of each kind of file.
const BEGINNINGS: &[(&[u8], FileKind)] = &[
    // https://mcap.dev/spec#magic
    (b"\x89MCAP0\r\n", FileKind::Mcap),
    (b"SQLite format 3\0", FileKind::Sqlite),
    (b"PAR1", FileKind::Parquet),
    // Parquet with an encrypted footer.
    (b"PARE", FileKind::Parquet),
    // http://wiki.ros.org/Bags/Format/2.0
    (b"#ROSBAG V2.0\n", FileKind::Ros1Bag),
    (b"#ROSRECORD V1.", FileKind::OldRos1Bag),
    (b"\x89HDF\r\n\x1a\n", FileKind::Hdf5),
    (b"MATLAB 5.0 MAT-file", FileKind::Matlab),
    (b"MATLAB 7.3 MAT-file", FileKind::Matlab),
    (b"\x93NUMPY", FileKind::Numpy),
    // Old Office format.
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", FileKind::Excel),
    // https://docs.px4.io/main/en/dev_log/ulog_file_format.html
    (b"ULog\x01\x12\x35", FileKind::Ulog),
    // https://arrow.apache.org/docs/format/Columnar.html#ipc-file-format, and its forerunner.
    (b"ARROW1\0\0", FileKind::Feather),
    (b"FEA1", FileKind::Feather),
    // Protocols 2 to 5: https://docs.python.org/3/library/pickle.html#data-stream-format
    (b"\x80\x02", FileKind::Pickle),
    (b"\x80\x03", FileKind::Pickle),
    (b"\x80\x04\x95", FileKind::Pickle),
    (b"\x80\x05\x95", FileKind::Pickle),
    (b"LOGG", FileKind::Blf),
    (b";$FILEVERSION", FileKind::Trc),
    (b";##########", FileKind::Trc),
    // One compression has already been removed, so such a file was compressed twice.
    (b"\x1f\x8b\x08", FileKind::CompressedTwice),
    (b"\x28\xb5\x2f\xfd", FileKind::CompressedTwice),
    // JSON, HTML and XML.
    (b"{\"", FileKind::Other),
    (b"{\n", FileKind::Other),
    (b"[{", FileKind::Other),
    (b"[[", FileKind::Other),
    (b"<!", FileKind::Other),
    (b"<?", FileKind::Other),
    (b"<html", FileKind::Other),
];

/// Kind of a file given as a log of frames, by its first `LENGTH` bytes or more; `None` if it may be one.
#[must_use]
pub fn no_log(first: &[u8]) -> Option<FileKind> {
    FileKind::of_first_bytes(first).filter(|kind| kind.log_advice("").is_some())
}

/// Kind of ZIP archive, by the names of its first members.
fn zip(first: &[u8]) -> Option<FileKind> {
    let has = |name: &[u8]| first.windows(name.len()).any(|part| part == name);
    first.starts_with(b"PK\x03\x04").then(|| {
        if has(b".npy") {
            FileKind::Npz
        } else if has(b"[Content_Types].xml") || has(b"xl/") {
            FileKind::Excel
        } else {
            FileKind::Zip
        }
    })
}

/// Number of frames that show a recording of the serial line.
const FRAMES: usize = 3;

/// Recording of the serial line, by its first frames.
fn serial_log(first: &[u8]) -> Option<FileKind> {
    let mut decoder = Decoder::new();
    let frames = first.iter().filter_map(|byte| decoder.push(*byte)).filter(Result::is_ok);
    (frames.take(FRAMES).count() == FRAMES).then_some(FileKind::SerialLog)
}

/// Kind of a file by its first line, in which a table has no zero.
fn other(first: &[u8]) -> Option<FileKind> {
    let line = first.split(|byte| *byte == b'\n').next()?;
    if line.contains(&0) {
        Some(FileKind::Other)
    } else {
        is_can_log(line).then_some(FileKind::CanLog)
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
    use wire::uart::{LogMessage, Message, encode};

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
        let others: [(Vec<u8>, FileKind); 9] = [
            (b"<!DOCTYPE html>\n<html>".to_vec(), FileKind::Other),
            (b"{\n \"t\": 0}".to_vec(), FileKind::Other),
            (b"[[0, 1], [2, 3]]".to_vec(), FileKind::Other),
            // UTF-16.
            (b"\xff\xfet\0,\0".to_vec(), FileKind::Other),
            (zip("arr_0.npy"), FileKind::Npz),
            (zip("[Content_Types].xml"), FileKind::Excel),
            (zip("walk.csv"), FileKind::Zip),
            (b"(1700000000.123456) can0 191#0011\n".to_vec(), FileKind::CanLog),
            (b"(0.0) vcan0 191##1".to_vec(), FileKind::CanLog),
        ];
        for (first, foreign) in &others {
            assert_eq!(FileKind::of_first_bytes(first), Some(*foreign), "{foreign}");
        }
        for foreign in FileKind::ALL {
            let by_beginning = BEGINNINGS.iter().any(|(_, known)| *known == foreign);
            let by_other = others.iter().any(|(_, known)| *known == foreign);
            let by_name = FileKind::of_path(Path::new("walk.csv.br")) == Some(foreign);
            let by_frames = foreign == FileKind::SerialLog;
            assert!(by_beginning || by_other || by_name || by_frames, "{foreign}");
        }
    }

    #[test]
    fn recording_of_the_serial_line_is_to_be_decoded() {
        let frame = |sequence| {
            let message = Message::Log(LogMessage::new(2, "tick"));
            encode(sequence, &message).as_bytes().to_vec()
        };
        let log: Vec<u8> = (0..5).flat_map(frame).collect();
        assert_eq!(FileKind::of_first_bytes(&log), Some(FileKind::SerialLog));
        assert_eq!(no_log(&log), None);
        assert!(FileKind::SerialLog.advice().is_some_and(|advice| advice.starts_with("decode it")));
    }

    #[test]
    fn foreign_logs_are_recognised_only_by_complete_magic() {
        let kinds: Vec<_> =
            BEGINNINGS.iter().filter_map(|(first, _)| Some((*first, no_log(first)?))).collect();
        for (first, kind) in &kinds {
            assert_eq!(no_log(&[*first, b"more"].concat()), Some(*kind));
            assert_eq!(no_log(&first[..first.len() - 1]), None, "{kind}");
        }
        for kind in
            [FileKind::Blf, FileKind::Mcap, FileKind::Parquet, FileKind::Sqlite, FileKind::Trc]
        {
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
            assert_eq!(FileKind::of_first_bytes(table.as_bytes()), None, "{table}");
        }
    }
}
