//! Formats of files, by name.

use crate::file_kind::FileKind;

crate::named! {
    /// Layout of a file.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Format {
        /// Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed.
        PceAtlas = "pce-atlas",
        /// Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz.
        PceGo1 = "pce-go1",
        /// Simulated ATLAS and NAO of github.com/mrsp/lcd: 13 columns, no header, 100 Hz, gravity
        /// removed.
        Lcd = "lcd",
        /// A header naming any of t,ax,ay,az,wx,wy,wz,force,label,validity (s, m/s², rad/s, N, 0/1).
        Csv = "csv",
        /// The columns of a csv in Parquet.
        Parquet = "parquet",
        /// `sensor_msgs/msg/Imu` of ROS 2 in MCAP.
        Mcap = "mcap",
        /// The same in the `SQLite` database of a rosbag2, or the folder of a rosbag2.
        Rosbag2 = "rosbag2",
        /// `sensor_msgs/Imu` of ROS 1 in a `.bag`.
        Rosbag1 = "rosbag1",
    } or |name| {
        let known = Self::ALL.map(Self::name).join(", ");
        format!("there is no format `{name}`; known are {known}")
    }
}

/// Kind of content, which determines the applicable options.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Columns at fixed places with fixed units.
    Fixed,
    /// Columns identified by name.
    Columns,
    /// Messages by topic.
    Messages,
}

impl Format {
    /// Description in one line, for the help of an option.
    #[must_use]
    pub const fn help(self) -> &'static str {
        match self {
            Self::PceAtlas => {
                "Simulated ATLAS of the method's authors: 13 columns, no header, 1 kHz, gravity removed"
            }
            Self::PceGo1 => {
                "Real GO1 of the method's authors: force and IMU in g and °/s, no header, 250 Hz"
            }
            Self::Lcd => {
                "Simulated ATLAS and NAO of github.com/mrsp/lcd: 13 columns, no header, 100 Hz, gravity removed"
            }
            Self::Csv => {
                "A header naming any of t,ax,ay,az,wx,wy,wz,force,label,validity (s, m/s², rad/s, N, 0/1)"
            }
            Self::Parquet => "The columns of a csv in Parquet",
            Self::Mcap => "sensor_msgs/msg/Imu of ROS 2 in MCAP; known by its first bytes",
            Self::Rosbag2 => {
                "The same in a .db3 of rosbag2, or the folder of a rosbag2; known by its first bytes"
            }
            Self::Rosbag1 => "sensor_msgs/Imu of ROS 1 in a .bag; known by its first bytes",
        }
    }

    /// Kind of content.
    #[must_use]
    pub const fn content(self) -> Content {
        match self {
            Self::PceAtlas | Self::PceGo1 | Self::Lcd => Content::Fixed,
            Self::Csv | Self::Parquet => Content::Columns,
            Self::Mcap | Self::Rosbag2 | Self::Rosbag1 => Content::Messages,
        }
    }

    /// Returns whether its files are recognised by their first bytes and read from a disk only.
    #[must_use]
    pub const fn is_container(self) -> bool {
        matches!(self, Self::Parquet | Self::Mcap | Self::Rosbag2 | Self::Rosbag1)
    }

    /// Format of a kind of file that is recognised by its first bytes; `None` if it is not read.
    pub(super) const fn of_kind(kind: FileKind) -> Option<Self> {
        match kind {
            FileKind::Mcap => Some(Self::Mcap),
            FileKind::Sqlite => Some(Self::Rosbag2),
            FileKind::Ros1Bag => Some(Self::Rosbag1),
            FileKind::Parquet => Some(Self::Parquet),
            _ => None,
        }
    }

    /// Feature of this crate that reads its files, if missing in this build.
    #[must_use]
    pub const fn missing_feature(self) -> Option<&'static str> {
        match self {
            Self::Parquet if !cfg!(feature = "parquet") => Some("parquet"),
            Self::Mcap | Self::Rosbag2 | Self::Rosbag1 if !cfg!(feature = "bags") => Some("bags"),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_is_found_by_its_name() {
        for format in Format::ALL {
            assert_eq!(format.to_string().parse(), Ok(format));
        }
    }

    #[test]
    fn kinds_that_are_read_have_a_format() {
        for kind in FileKind::ALL {
            // Other databases than those of a rosbag2 are refused by their tables.
            let is_read = kind.advice().is_none() || kind == FileKind::Sqlite;
            assert_eq!(Format::of_kind(kind).is_some(), is_read, "{kind}");
        }
    }

    #[test]
    fn unknown_format_error_lists_the_known_ones() {
        assert_eq!(
            "xls".parse::<Format>(),
            Err("there is no format `xls`; known are pce-atlas, pce-go1, lcd, csv, \
             parquet, mcap, rosbag2, rosbag1"
                .to_owned())
        );
    }
}
