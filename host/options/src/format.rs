//! Formats of recordings, by name.

samples::named! {
    /// Format of a file. [`Self::help`] describes each.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Format {
        /// The simulated ATLAS of the method's authors.
        PceAtlas = "pce-atlas",
        /// The GO1 of the method's authors.
        PceGo1 = "pce-go1",
        /// The simulated robots of github.com/mrsp/lcd.
        Lcd = "lcd",
        /// A table with named columns.
        Csv = "csv",
        /// The columns of a csv in Parquet.
        Parquet = "parquet",
        /// A bag of ROS 2 in MCAP.
        Mcap = "mcap",
        /// A bag of ROS 2 in `SQLite`, or the folder of a bag.
        Rosbag2 = "rosbag2",
        /// A bag of ROS 1.
        Rosbag1 = "rosbag1",
    } or |name| {
        let known = Self::ALL.map(Self::name).join(", ");
        format!("there is no format `{name}`; known are {known}")
    }
}

/// Rate of the ATLAS recordings, Hz.
pub const ATLAS_SAMPLE_RATE: f32 = 1_000.0;

/// Nominal rate of the GO1 recordings' IMU columns, Hz.
pub const GO1_SAMPLE_RATE: f32 = 250.0;

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

    /// Returns whether files of this format are recognised by their first bytes, and read only from a disk.
    #[must_use]
    pub const fn is_container(self) -> bool {
        matches!(self, Self::Parquet | Self::Mcap | Self::Rosbag2 | Self::Rosbag1)
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
    fn unknown_format_error_lists_the_known_ones() {
        assert_eq!(
            "xls".parse::<Format>(),
            Err("there is no format `xls`; known are pce-atlas, pce-go1, lcd, csv, \
             parquet, mcap, rosbag2, rosbag1"
                .to_owned())
        );
    }
}
