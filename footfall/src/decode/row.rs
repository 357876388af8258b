//! One row per contact: what is known of the foot at a sample.

use std::io::{self, Write};

use estimator_core::{Decision, Flag, Flags, PerAxis, Quaternion, Timestamp, Vec3};
use wire::NodeId;
use wire::pdo::Status;

/// The header of the table of decoded rows. Columns that `samples.csv` has too have its names,
/// its units and its meaning; a cell is blank where nothing was sent with that sample.
///
/// | columns | meaning | unit |
/// |---|---|---|
/// | `t` | time of the sample: on the serial line as the foot says it; on CAN in steps of 10 µs, counted from the start of the turn of the 16-bit clock in which the log begins | s |
/// | `node` | the foot's node id; on the serial line from the first health message on | |
/// | `sequence` | the frame's sequence number, modulo 2⁸ on CAN, 2¹⁶ on the serial line | |
/// | `p_stable` … `p_wz`, `qw` … `qz`, `lax` … `laz`, `bwx` … `bwz`, `state` | as in [`HEADER`](crate::output::HEADER) | |
/// | `uwx`, `uwy`, `uwz` | angular rate without bias | rad/s |
/// | `temperature` | the sensor's | °C |
/// | `decision` | `stable` or `not_stable`, debounced | |
/// | `flags` | names of the estimator's flags, and `fault`. Most frames on CAN say less: `saturated`, `settling` for a window that is not full or an attitude that is not known, `doubtful` for the others | |
pub const HEADER: &str = "t,node,sequence,p_stable,p_tangential,p_vertical,\
     p_ax,p_ay,p_az,p_wx,p_wy,p_wz,qw,qx,qy,qz,lax,lay,laz,uwx,uwy,uwz,bwx,bwy,bwz,\
     temperature,state,decision,flags";

/// What was sent of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// When the sample was acquired.
    pub timestamp: Timestamp,
    /// The foot's node id, where it is known.
    pub node: Option<NodeId>,
    /// The frame's sequence number.
    pub sequence: u16,
    /// Probability of stable contact.
    pub stable: f32,
    /// Probability of no motion along the ground.
    pub tangential: f32,
    /// Probability of no lifting and tilting.
    pub vertical: f32,
    /// Probability per axis.
    pub axes: Option<PerAxis<f32>>,
    /// Orientation, sensor → world.
    pub orientation: Option<Quaternion>,
    /// Acceleration without gravity, m/s².
    pub acceleration: Option<Vec3>,
    /// Angular rate without bias, rad/s.
    pub rate: Option<Vec3>,
    /// Gyroscope bias, rad/s.
    pub bias: Option<Vec3>,
    /// The sensor's temperature, °C.
    pub temperature: Option<f32>,
    /// Phase, decision and what they rest on.
    pub status: Status,
    /// The estimator's flags as bits.
    pub flags: Option<u8>,
}

impl Row {
    /// The names in the column `flags`.
    #[must_use]
    pub fn flag_names(&self) -> Vec<&'static str> {
        let status = self.status;
        let mut names: Vec<_> = match self.flags {
            Some(bits) => Flag::ALL
                .into_iter()
                .filter(|flag| bits & Flags::NONE.with(*flag).bits() != 0)
                .map(Flag::name)
                .collect(),
            None => [
                (status.is_saturated(), Flag::Saturated.name()),
                (status.is_settling(), "settling"),
            ]
            .into_iter()
            .filter_map(|(is_set, name)| is_set.then_some(name))
            .collect(),
        };
        if status.has_fault() {
            names.push("fault");
        }
        if names.is_empty() && !status.is_valid() {
            names.push("doubtful");
        }
        names
    }
}

/// Writes the table of decoded rows.
///
/// # Errors
/// What the writer reports.
pub fn write_rows(rows: &[Row], to: &mut dyn Write) -> io::Result<()> {
    writeln!(to, "{HEADER}")?;
    for row in rows {
        let micros = row.timestamp.as_micros();
        write!(to, "{}.{:06},", micros / 1_000_000, micros % 1_000_000)?;
        if let Some(node) = row.node {
            write!(to, "{}", node.get())?;
        }
        write!(to, ",{}", row.sequence)?;
        cells(to, Some([row.stable, row.tangential, row.vertical]))?;
        cells(to, row.axes.map(PerAxis::to_array))?;
        cells(to, row.orientation.map(|q| [q.w, q.x, q.y, q.z]))?;
        for vector in [row.acceleration, row.rate, row.bias] {
            cells(to, vector.map(|v| [v.x, v.y, v.z]))?;
        }
        cells(to, row.temperature.map(|celsius| [celsius]))?;
        let decision = match row.status.decision() {
            Decision::Stable => "stable",
            Decision::NotStable => "not_stable",
        };
        let state = row.status.phase().name();
        writeln!(to, ",{state},{decision},{}", row.flag_names().join("|"))?;
    }
    Ok(())
}

/// Numbers, or as many blank cells; a number that the foot did not have is blank too.
fn cells<const N: usize>(to: &mut dyn Write, numbers: Option<[f32; N]>) -> io::Result<()> {
    for number in numbers.unwrap_or([f32::NAN; N]) {
        if number.is_nan() {
            write!(to, ",")?;
        } else {
            write!(to, ",{number}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(row: Row) -> Vec<String> {
        let mut bytes = Vec::new();
        write_rows(&[row], &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let row = text.lines().nth(1).unwrap();
        row.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn a_row_has_a_cell_for_every_name_in_the_header_blank_where_nothing_was_sent() {
        let bare = Row {
            timestamp: Timestamp::from_micros(1_000_010),
            stable: 0.5,
            ..Row::default()
        };
        let full = Row {
            node: NodeId::new(17),
            axes: Some(PerAxis::splat(0.25)),
            orientation: Some(Quaternion::IDENTITY),
            acceleration: Some(Vec3::new(1.0, f32::NAN, 3.0)),
            rate: Some(Vec3::ZERO),
            bias: Some(Vec3::ZERO),
            temperature: Some(25.5),
            ..bare
        };
        let (bare, full) = (written(bare), written(full));
        let columns = HEADER.split(',').count();
        assert_eq!((bare.len(), full.len()), (columns, columns));
        assert_eq!(bare[..7], ["1.000010", "", "0", "0.5", "0", "0", ""]);
        assert_eq!(full[1], "17");
        assert_eq!(full[16..19], ["1", "", "3"]);
        assert_eq!(full[25..], ["25.5", "unknown", "not_stable", "doubtful"]);
    }

    #[test]
    fn flags_are_as_precise_as_what_was_sent() {
        let names = |status: u8, flags: Option<u8>| {
            let status = Status::from_bits(status);
            Row {
                status,
                flags,
                ..Row::default()
            }
            .flag_names()
            .join("|")
        };
        assert_eq!(names(0x10, None), "");
        assert_eq!(names(0xA0, None), "saturated|settling");
        assert_eq!(
            names(0x80, Some(0b11)),
            "window_not_full|attitude_not_initialised"
        );
        assert_eq!(names(0x40, Some(0)), "fault");
        assert_eq!(names(0x00, None), "doubtful");
    }
}
