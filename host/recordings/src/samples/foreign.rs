//! Kinds of files other than tables, their names and advice for each: one table for recordings and logs of frames.
//! [`magic`](crate::samples::magic) has their first bytes.

/// Advice for frames that another program can write as a log.
const BY_PYTHON_CAN: &str =
    "convert it with python-can: pip install python-can, then can_logconvert FILE can.log";

const UNPACK: &str = "unpack it";

/// Defines the kinds by name, with its article, advice for a file that should be a recording and cannot be read, and advice
/// for one that should be a log, with `FILE` for its name: `None` if it is read, or if a recording of the serial line may
/// have the same first bytes.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $recording:expr, $log:expr;)+) => {
        crate::named! {
            /// A kind of file other than a table.
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub enum Foreign {
                $($(#[$doc])* $kind = $name),+
            }
        }

        impl Foreign {
            /// Advice for a recording, and for a log.
            const fn advices(self) -> [Option<&'static str>; 2] {
                match self {
                    $(Self::$kind => [$recording, $log]),+
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
    /// One or several `NumPy` arrays.
    Numpy = "a file of NumPy",
        Some("write a table: numpy.savetxt(\"walk.csv\", walk, delimiter=\",\", \
             header=\"t,ax,ay,az,wx,wy,wz\")"),
        None;
    /// A sheet of Excel.
    Excel = "an Excel file", Some("save the sheet as CSV"), Some(UNPACK);
    /// A ZIP archive.
    Zip = "a ZIP archive", Some(UNPACK), Some(UNPACK);
    /// A log of Vector's tools.
    Blf = "a BLF log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.blf walk.log; then footfall decode"),
        Some(BY_PYTHON_CAN);
    /// A log of PEAK's tools.
    Trc = "a PEAK TRC log of a CAN bus",
        Some("convert it with python-can: can_logconvert walk.trc walk.log; then footfall decode"),
        Some(BY_PYTHON_CAN);
    /// Log of `candump -l`.
    CanLog = "a CAN log", Some("decode it: footfall decode"), None;
    /// Database of `SQLite`, which is read if it has the tables of a rosbag2.
    Sqlite = "an SQLite database without the tables of a rosbag2",
        Some("write a table: sqlite3 -header -csv walk.db \"SELECT …\""),
        Some(BY_PYTHON_CAN);
    /// MCAP.
    Mcap = "a recording in MCAP",
        None,
        Some("it holds topics, no frames: see footfall replay and docs/formats.md");
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

impl Foreign {
    /// Advice for a file that should be a recording and cannot be read; `None` if every file of the kind is read.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        let [recording, _] = self.advices();
        recording
    }

    /// Advice for the file of this name that should be a log; `None` if it may be one.
    #[must_use]
    pub fn log_advice(self, file: &str) -> Option<String> {
        let [_, log] = self.advices();
        log.map(|advice| advice.replace("FILE", file))
    }
}
