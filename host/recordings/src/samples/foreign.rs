//! Kinds of files other than tables, their names and advice for each: one table for recordings and logs of frames.
//! [`magic`](crate::samples::magic) has their first bytes.

use std::fmt;

/// Name of a kind, and advice for it.
struct Kind {
    /// Name, with its article.
    name: &'static str,
    /// Advice for a file that should be a recording and cannot be read; `None` if every file of the kind is read.
    recording: Option<&'static str>,
    /// Advice for a file that should be a log, with `FILE` for its name; `None` if it is read, or if a recording
    /// of the serial line may have the same first bytes.
    log: Option<&'static str>,
}

/// Advice for frames that another program can write as a log.
const BY_PYTHON_CAN: &str =
    "convert it with python-can: pip install python-can, then can_logconvert FILE can.log";

const UNPACK: &str = "unpack it";

/// Defines the kinds by name, advice for a recording and advice for a log, as in [`Kind`].
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $recording:expr, $log:expr;)+) => {
        /// A kind of file other than a table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Foreign {
            $($(#[$doc])* $kind),+
        }

        impl Foreign {
            /// All kinds.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$kind),+];

            const fn kind(self) -> Kind {
                match self {
                    $(Self::$kind => Kind { name: $name, recording: $recording, log: $log }),+
                }
            }
        }
    };
}

kinds! {
    /// A bag of ROS 1.
    Ros1Bag = "a ROS 1 bag",
        Some("convert it: pip install rosbags, then rosbags-convert --src walk.bag --dst walk"),
        Some("it holds topics, no frames: see footfall replay and docs/formats.md");
    /// HDF5, also of pandas.
    Hdf5 = "an HDF5 file",
        Some("write a table of it: pandas.read_hdf(…).to_parquet(\"walk.parquet\"), or h5py"),
        Some("write it as CSV");
    /// MATLAB's MAT-file, except version 4, which has no magic bytes.
    Matlab = "a MATLAB file",
        Some("write a table in MATLAB: writetable(walk, \"walk.csv\"), or parquetwrite"),
        None;
    /// A single `NumPy` array.
    Numpy = "a NumPy array",
        Some("write a table: numpy.savetxt(\"walk.csv\", walk, delimiter=\",\", \
             header=\"t,ax,ay,az,wx,wy,wz\")"),
        None;
    /// Several `NumPy` arrays.
    NumpyArchive = "an archive of NumPy arrays",
        Some("write a table: pandas.DataFrame(dict(numpy.load(…))).to_parquet(\"walk.parquet\")"),
        Some(UNPACK);
    /// A sheet of Excel.
    Excel = "an Excel file", Some("save the sheet as CSV"), Some(UNPACK);
    /// A ZIP archive.
    Zip = "a ZIP archive", Some(UNPACK), Some(UNPACK);
    /// A tar archive.
    Tar = "a tar archive", Some(UNPACK), Some(UNPACK);
    /// A network capture, pcap or pcapng.
    Capture = "a capture of network packets",
        Some("record the topics instead: ros2 bag record; or the CAN bus: candump -l"),
        Some("record with candump -l, which is read here");
    /// ASAM MDF, version 3 or 4.
    Mdf = "an MDF file",
        Some("export it: asammdf.MDF(\"walk.mf4\").to_dataframe().to_parquet(\"walk.parquet\")"),
        Some("convert it with python-can: pip install python-can[mf4], then can_logconvert FILE can.log");
    /// A log of Vector's tools.
    Blf = "a BLF log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.blf walk.log; then footfall decode"),
        Some(BY_PYTHON_CAN);
    /// Pickled Python objects.
    Pickle = "a pickle of Python",
        Some("write a table: pandas.read_pickle(…).to_parquet(\"walk.parquet\")"),
        None;
    /// Arrow's IPC file, also known as Feather.
    ArrowIpc = "an Arrow IPC or Feather file",
        Some("write Parquet: pandas.read_feather(…).to_parquet(\"walk.parquet\")"),
        None;
    /// A log of PX4.
    ULog = "a ULog of PX4", Some("write tables of it: ulog2csv walk.ulg"), None;
    /// A log of `ArduPilot`.
    DataFlash = "a DataFlash log of ArduPilot",
        Some("write a table: mavlogdump.py --types IMU --format csv walk.bin"),
        None;
    /// Database of `SQLite`, which is read if it has the tables of a rosbag2.
    Sqlite = "an SQLite database without the tables of a rosbag2",
        Some("write a table: sqlite3 -header -csv walk.db \"SELECT …\""),
        Some(BY_PYTHON_CAN);
    /// JSON.
    Json = "a JSON file",
        Some("write a table: pandas.read_json(…).to_csv(\"walk.csv\", index=False)"),
        None;
    /// Log of `candump -l`.
    CanLog = "a CAN log", Some("decode it: footfall decode"), None;
    /// PNG, JPEG or GIF.
    Picture = "a picture", Some("the numbers behind it are needed"), None;
    /// PDF.
    Pdf = "a PDF", Some("the numbers behind it are needed"), None;
    /// A page of the web, as servers answer a request that they do not grant.
    Html = "an HTML page",
        Some("it may be a server's answer in the place of the file: download the file again"),
        Some("it may be a server's answer in the place of the file: download the file again");
    /// MCAP.
    Mcap = "a recording in MCAP",
        None,
        Some("it holds topics, no frames: see footfall replay and docs/formats.md");
    /// Parquet.
    Parquet = "a Parquet table", None, Some("write it as CSV");
    /// A log of PEAK's tools.
    Trc = "a PEAK TRC log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.trc walk.log; then footfall decode"),
        Some(BY_PYTHON_CAN);
    /// A 7z archive.
    SevenZip = "a 7z archive", Some(UNPACK), Some(UNPACK);
    /// A file compressed with xz.
    Xz = "compressed with xz", Some("unpack it: xz -d"), Some("unpack it: xz -d");
    /// A file compressed with bzip2.
    Bzip2 = "compressed with bzip2", Some("unpack it: bzip2 -d"), Some("unpack it: bzip2 -d");
    /// A file compressed with gzip or zstd twice.
    CompressedTwice = "compressed twice",
        Some("unpack it once: gzip -d, or zstd -d"),
        Some("unpack it once: gzip -d, or zstd -d");
    /// Text in UTF-16, as PowerShell's `>` writes it.
    Utf16 = "text in UTF-16",
        Some("write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8"),
        Some("write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8");
}

impl Foreign {
    /// Name, with its article.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.kind().name
    }

    /// Advice for a file that should be a recording and cannot be read; `None` if every file of the kind is read.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        self.kind().recording
    }

    /// Advice for the file of this name that should be a log; `None` if it may be one.
    #[must_use]
    pub fn log_advice(self, file: &str) -> Option<String> {
        self.kind().log.map(|advice| advice.replace("FILE", file))
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
