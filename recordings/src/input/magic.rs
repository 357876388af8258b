//! What a file is, by its first bytes.

use std::fmt;

use super::format::Format;

/// As many of a file's first bytes as it takes to know it: an archive of tar shows itself last.
pub(super) const LENGTH: usize = 512;

/// A kind of file that is not read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// A bag of ROS 1.
    Ros1Bag,
    /// HDF5, also of pandas.
    Hdf5,
    /// MATLAB's MAT-file, version 4 excepted, which has no first bytes of its own.
    Matlab,
    /// One array of `NumPy`.
    Numpy,
    /// Several arrays of `NumPy`.
    NumpyArchive,
    /// A sheet of Excel.
    Excel,
    /// A ZIP archive.
    Zip,
    /// A tar archive.
    Tar,
    /// A capture of a network, old or new.
    Capture,
    /// ASAM MDF, version 3 or 4.
    Mdf,
    /// A log of Vector's tools.
    Blf,
    /// Pickled objects of Python.
    Pickle,
    /// Arrow's IPC file, which is Feather, too.
    ArrowIpc,
    /// A log of PX4.
    ULog,
    /// A log of `ArduPilot`.
    DataFlash,
    /// `SQLite` without the tables of a rosbag2.
    Sqlite,
    /// JSON.
    Json,
    /// What `candump -l` writes.
    CanLog,
    /// PNG, JPEG or GIF.
    Picture,
    /// PDF.
    Pdf,
}

impl Foreign {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::Ros1Bag,
        Self::Hdf5,
        Self::Matlab,
        Self::Numpy,
        Self::NumpyArchive,
        Self::Excel,
        Self::Zip,
        Self::Tar,
        Self::Capture,
        Self::Mdf,
        Self::Blf,
        Self::Pickle,
        Self::ArrowIpc,
        Self::ULog,
        Self::DataFlash,
        Self::Sqlite,
        Self::Json,
        Self::CanLog,
        Self::Picture,
        Self::Pdf,
    ];

    /// What it is called, with its article.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.row().0
    }

    /// What to do with it.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        self.row().1
    }

    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Ros1Bag => (
                "a ROS 1 bag",
                "convert it: rosbags-convert --src walk.bag --dst walk",
            ),
            Self::Hdf5 => (
                "an HDF5 file",
                "write a table of it: pandas.read_hdf(…).to_parquet(\"walk.parquet\"), or h5py",
            ),
            Self::Matlab => (
                "a MATLAB file",
                "write a table in MATLAB: writetable(walk, \"walk.csv\"), or parquetwrite",
            ),
            Self::Numpy => (
                "a NumPy array",
                "write a table: numpy.savetxt(\"walk.csv\", walk, delimiter=\",\", \
                 header=\"t,ax,ay,az,wx,wy,wz\")",
            ),
            Self::NumpyArchive => (
                "an archive of NumPy arrays",
                "write a table: pandas.DataFrame(dict(numpy.load(…))).to_parquet(\"walk.parquet\")",
            ),
            Self::Excel => ("an Excel file", "save the sheet as CSV"),
            Self::Zip => ("a ZIP archive", "unpack it"),
            Self::Tar => ("a tar archive", "unpack it"),
            Self::Capture => (
                "a capture of network packets",
                "record the topics instead: ros2 bag record; or the CAN bus: candump -l",
            ),
            Self::Mdf => (
                "an MDF file",
                "export it: asammdf.MDF(\"walk.mf4\").to_dataframe().to_parquet(\"walk.parquet\")",
            ),
            Self::Blf => (
                "a BLF log of a CAN bus",
                "convert it with python-can: can_logconvert walk.blf walk.log; then footfall decode",
            ),
            Self::Pickle => (
                "a pickle of Python",
                "write a table: pandas.read_pickle(…).to_parquet(\"walk.parquet\")",
            ),
            Self::ArrowIpc => (
                "an Arrow IPC or Feather file",
                "write Parquet: pandas.read_feather(…).to_parquet(\"walk.parquet\")",
            ),
            Self::ULog => ("a ULog of PX4", "write tables of it: ulog2csv walk.ulg"),
            Self::DataFlash => (
                "a DataFlash log of ArduPilot",
                "write a table: mavlogdump.py --types IMU --format csv walk.bin",
            ),
            Self::Sqlite => (
                "an SQLite database without the tables of a rosbag2",
                "write a table: sqlite3 -header -csv walk.db \"SELECT …\"",
            ),
            Self::Json => (
                "a JSON file",
                "write a table: pandas.read_json(…).to_csv(\"walk.csv\", index=False)",
            ),
            Self::CanLog => ("a CAN log", "decode it: footfall decode"),
            Self::Picture => ("a picture", "the numbers behind it are needed"),
            Self::Pdf => ("a PDF", "the numbers behind it are needed"),
        }
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A file that is no table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// It can be read.
    Container(Format),
    Foreign(Foreign),
}

/// The first bytes of kinds of files.
const BEGINNINGS: &[(&[u8], Known)] = &[
    // https://mcap.dev/spec#magic
    (b"\x89MCAP0\r\n", Known::Container(Format::Mcap)),
    (b"SQLite format 3\0", Known::Container(Format::Rosbag2)),
    (b"PAR1", Known::Container(Format::Parquet)),
    // The same with an encrypted footer.
    (b"PARE", Known::Container(Format::Parquet)),
    (b"#ROSBAG V", Known::Foreign(Foreign::Ros1Bag)),
    (b"\x89HDF\r\n\x1a\n", Known::Foreign(Foreign::Hdf5)),
    (b"MATLAB 5.0 MAT-file", Known::Foreign(Foreign::Matlab)),
    (b"MATLAB 7.3 MAT-file", Known::Foreign(Foreign::Matlab)),
    (b"\x93NUMPY", Known::Foreign(Foreign::Numpy)),
    // The old format of Office.
    (
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
        Known::Foreign(Foreign::Excel),
    ),
    // pcap in both byte orders, with µs and with ns; pcapng.
    (b"\xd4\xc3\xb2\xa1", Known::Foreign(Foreign::Capture)),
    (b"\xa1\xb2\xc3\xd4", Known::Foreign(Foreign::Capture)),
    (b"\x4d\x3c\xb2\xa1", Known::Foreign(Foreign::Capture)),
    (b"\xa1\xb2\x3c\x4d", Known::Foreign(Foreign::Capture)),
    (b"\x0a\x0d\x0d\x0a", Known::Foreign(Foreign::Capture)),
    (b"MDF     ", Known::Foreign(Foreign::Mdf)),
    (b"UnFinMF ", Known::Foreign(Foreign::Mdf)),
    (b"LOGG", Known::Foreign(Foreign::Blf)),
    // The protocols of pickle since Python 2.3; those before are text.
    (b"\x80\x02", Known::Foreign(Foreign::Pickle)),
    (b"\x80\x03", Known::Foreign(Foreign::Pickle)),
    (b"\x80\x04", Known::Foreign(Foreign::Pickle)),
    (b"\x80\x05", Known::Foreign(Foreign::Pickle)),
    (b"ARROW1", Known::Foreign(Foreign::ArrowIpc)),
    (b"FEA1", Known::Foreign(Foreign::ArrowIpc)),
    (b"ULog\x01\x12\x35", Known::Foreign(Foreign::ULog)),
    // A message that describes the messages.
    (b"\xa3\x95\x80", Known::Foreign(Foreign::DataFlash)),
    (b"\x89PNG\r\n\x1a\n", Known::Foreign(Foreign::Picture)),
    (b"\xff\xd8\xff", Known::Foreign(Foreign::Picture)),
    (b"GIF8", Known::Foreign(Foreign::Picture)),
    (b"%PDF-", Known::Foreign(Foreign::Pdf)),
];

/// Where an archive of tar has its name.
const TAR: (usize, &[u8]) = (257, b"ustar");

/// The header of a member of a ZIP archive, and how long it is without the member's name.
const ZIP: (&[u8], usize) = (b"PK\x03\x04", 30);

/// What a file is, by its first [`LENGTH`] bytes; `None` where it may be a table.
pub(super) fn known(first: &[u8]) -> Option<Known> {
    let by_beginning = BEGINNINGS
        .iter()
        .find(|(beginning, _)| first.starts_with(beginning))
        .map(|(_, known)| *known);
    by_beginning.or_else(|| {
        let foreign = zip(first).or_else(|| tar(first)).or_else(|| text(first));
        foreign.map(Known::Foreign)
    })
}

/// What kind of ZIP archive it is, by the name of its first member.
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

/// A text that is no table.
fn text(first: &[u8]) -> Option<Foreign> {
    let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first);
    let text = text.trim_ascii_start();
    let (beginning, rest) = text.split_first()?;
    let second = rest.trim_ascii_start().first().copied();
    match (beginning, second) {
        (b'{', Some(b'"' | b'}')) => Some(Foreign::Json),
        (b'[', Some(b'{' | b'[' | b'"' | b'-' | b'0'..=b'9')) => Some(Foreign::Json),
        (b'(', _) => is_can_log(rest).then_some(Foreign::CanLog),
        _ => None,
    }
}

/// Whether this is `1700000000.123456) can0 191#0011` or the beginning of it.
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
    fn every_kind_is_known_by_some_file() {
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
        let others: [(Vec<u8>, Foreign); 8] = [
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
            assert_eq!(known(first), Some(Known::Foreign(*foreign)), "{foreign}");
        }
        for foreign in Foreign::ALL {
            let by_beginning = BEGINNINGS
                .iter()
                .any(|(_, known)| *known == Known::Foreign(foreign));
            let by_other = others.iter().any(|(_, known)| *known == foreign);
            // What a database is only its tables tell.
            assert!(
                by_beginning || by_other || foreign == Foreign::Sqlite,
                "{foreign}"
            );
        }
    }

    #[test]
    fn tables_are_none_of_them() {
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
