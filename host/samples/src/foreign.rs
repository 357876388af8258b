//! Kinds of files that are not read, their names and advice for each: one table for recordings and logs of frames.
//! [`magic`](crate::magic) has their first bytes.

use std::fmt;

/// A kind of file that is not supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    /// A bag of ROS 1.
    Ros1Bag,
    /// HDF5, also of pandas.
    Hdf5,
    /// MATLAB's MAT-file, except version 4, which has no magic bytes.
    Matlab,
    /// A single `NumPy` array.
    Numpy,
    /// Several `NumPy` arrays.
    NumpyArchive,
    /// A sheet of Excel.
    Excel,
    /// A ZIP archive.
    Zip,
    /// A tar archive.
    Tar,
    /// A network capture, pcap or pcapng.
    Capture,
    /// ASAM MDF, version 3 or 4.
    Mdf,
    /// A log of Vector's tools.
    Blf,
    /// Pickled Python objects.
    Pickle,
    /// Arrow's IPC file, also known as Feather.
    ArrowIpc,
    /// A log of PX4.
    ULog,
    /// A log of `ArduPilot`.
    DataFlash,
    /// `SQLite` without the tables of a rosbag2.
    Sqlite,
    /// JSON.
    Json,
    /// Log of `candump -l`.
    CanLog,
    /// PNG, JPEG or GIF.
    Picture,
    /// PDF.
    Pdf,
    /// A page of the web, as servers answer a request that they do not grant.
    Html,
    /// MCAP, to a reader of frame logs.
    Mcap,
    /// Parquet, to a reader of frame logs.
    Parquet,
    /// A log of PEAK's tools.
    Trc,
    /// A 7z archive.
    SevenZip,
    /// A file compressed with xz.
    Xz,
    /// A file compressed with bzip2.
    Bzip2,
    /// A file compressed with gzip or zstd twice.
    CompressedTwice,
    /// Text in UTF-16, as PowerShell's `>` writes it.
    Utf16,
}

/// Name of a kind, and advice for it.
struct Kind {
    /// Name, with its article.
    name: &'static str,
    /// Advice for a file that should be a recording; `None` if it is read.
    recording: Option<&'static str>,
    /// Advice for a file that should be a log, with `FILE` for its name; `None` if it is read, or if a recording
    /// of the serial line may have the same first bytes.
    log: Option<&'static str>,
}

/// Advice for frames that another program can write as a log.
const BY_PYTHON_CAN: &str =
    "convert it with python-can: pip install python-can, then can_logconvert FILE can.asc";

const UNPACK: &str = "unpack it";

impl Foreign {
    /// All kinds.
    pub const ALL: [Self; 29] = [
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
        Self::Html,
        Self::Mcap,
        Self::Parquet,
        Self::Trc,
        Self::SevenZip,
        Self::Xz,
        Self::Bzip2,
        Self::CompressedTwice,
        Self::Utf16,
    ];

    /// Name, with its article.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.kind().name
    }

    /// Advice for a file that should be a recording; `None` if it is read.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        self.kind().recording
    }

    /// Advice for the file of this name that should be a log; `None` if it may be one.
    #[must_use]
    pub fn log_advice(self, file: &str) -> Option<String> {
        self.kind().log.map(|advice| advice.replace("FILE", file))
    }

    const fn kind(self) -> Kind {
        const fn kind(
            name: &'static str,
            recording: Option<&'static str>,
            log: Option<&'static str>,
        ) -> Kind {
            Kind {
                name,
                recording,
                log,
            }
        }
        match self {
            Self::Ros1Bag => kind(
                "a ROS 1 bag",
                Some("it is read where rosbags-convert is installed: pip install rosbags"),
                Some("it holds topics, no frames: see footfall replay and docs/formats.md"),
            ),
            Self::Hdf5 => kind(
                "an HDF5 file",
                Some(
                    "write a table of it: pandas.read_hdf(…).to_parquet(\"walk.parquet\"), or h5py",
                ),
                Some("write it as CSV"),
            ),
            Self::Matlab => kind(
                "a MATLAB file",
                Some("write a table in MATLAB: writetable(walk, \"walk.csv\"), or parquetwrite"),
                None,
            ),
            Self::Numpy => kind(
                "a NumPy array",
                Some(
                    "write a table: numpy.savetxt(\"walk.csv\", walk, delimiter=\",\", \
                 header=\"t,ax,ay,az,wx,wy,wz\")",
                ),
                None,
            ),
            Self::NumpyArchive => kind(
                "an archive of NumPy arrays",
                Some(
                    "write a table: pandas.DataFrame(dict(numpy.load(…))).to_parquet(\"walk.parquet\")",
                ),
                Some(UNPACK),
            ),
            Self::Excel => kind("an Excel file", Some("save the sheet as CSV"), Some(UNPACK)),
            Self::Zip => kind("a ZIP archive", Some(UNPACK), Some(UNPACK)),
            Self::Tar => kind("a tar archive", Some(UNPACK), Some(UNPACK)),
            Self::Capture => kind(
                "a capture of network packets",
                Some("record the topics instead: ros2 bag record; or the CAN bus: candump -l"),
                Some("record with candump -l, which is read here"),
            ),
            Self::Mdf => kind(
                "an MDF file",
                Some(
                    "export it: asammdf.MDF(\"walk.mf4\").to_dataframe().to_parquet(\"walk.parquet\")",
                ),
                Some(
                    "convert it with python-can: pip install python-can[mf4], then can_logconvert FILE can.asc",
                ),
            ),
            Self::Blf => kind(
                "a BLF log of a CAN bus",
                Some(
                    "convert it with python-can: can_logconvert walk.blf walk.log; then footfall decode",
                ),
                Some(BY_PYTHON_CAN),
            ),
            Self::Pickle => kind(
                "a pickle of Python",
                Some("write a table: pandas.read_pickle(…).to_parquet(\"walk.parquet\")"),
                None,
            ),
            Self::ArrowIpc => kind(
                "an Arrow IPC or Feather file",
                Some("write Parquet: pandas.read_feather(…).to_parquet(\"walk.parquet\")"),
                None,
            ),
            Self::ULog => kind(
                "a ULog of PX4",
                Some("write tables of it: ulog2csv walk.ulg"),
                None,
            ),
            Self::DataFlash => kind(
                "a DataFlash log of ArduPilot",
                Some("write a table: mavlogdump.py --types IMU --format csv walk.bin"),
                None,
            ),
            Self::Sqlite => kind(
                "an SQLite database without the tables of a rosbag2",
                Some("write a table: sqlite3 -header -csv walk.db \"SELECT …\""),
                Some(BY_PYTHON_CAN),
            ),
            Self::Json => kind(
                "a JSON file",
                Some("write a table: pandas.read_json(…).to_csv(\"walk.csv\", index=False)"),
                None,
            ),
            Self::CanLog => kind("a CAN log", Some("decode it: footfall decode"), None),
            Self::Picture => kind("a picture", Some("the numbers behind it are needed"), None),
            Self::Html => kind(
                "an HTML page",
                Some(
                    "it may be a server's answer in the place of the file: download the file again",
                ),
                Some(
                    "it may be a server's answer in the place of the file: download the file again",
                ),
            ),
            Self::Pdf => kind("a PDF", Some("the numbers behind it are needed"), None),
            Self::Mcap => kind(
                "a recording in MCAP",
                None,
                Some("it holds topics, no frames: see footfall replay and docs/formats.md"),
            ),
            Self::Parquet => kind("a Parquet table", None, Some("write it as CSV")),
            Self::Trc => kind(
                "a PEAK TRC log of a CAN bus",
                Some(
                    "convert it with python-can: can_logconvert walk.trc walk.log; then footfall decode",
                ),
                Some(BY_PYTHON_CAN),
            ),
            Self::SevenZip => kind("a 7z archive", Some(UNPACK), Some(UNPACK)),
            Self::Xz => kind(
                "compressed with xz",
                Some("unpack it: xz -d"),
                Some("unpack it: xz -d"),
            ),
            Self::Bzip2 => kind(
                "compressed with bzip2",
                Some("unpack it: bzip2 -d"),
                Some("unpack it: bzip2 -d"),
            ),
            Self::CompressedTwice => kind(
                "compressed twice",
                Some("unpack it once: gzip -d, or zstd -d"),
                Some("unpack it once: gzip -d, or zstd -d"),
            ),
            Self::Utf16 => kind(
                "text in UTF-16",
                Some("write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8"),
                Some("write it as UTF-8, as PowerShell does with | Out-File -Encoding utf8"),
            ),
        }
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
