//! Rows of the decoded table, one per contact.

use std::io::{self, Write};
use std::sync::Arc;

use estimator_core::{
    ContactEstimate, Decision, Flag, Flags, ImuSample, PerAxis, Quaternion, Timestamp, Vec3,
};
use samples::space::components;
use wire::pdo::Status;
use wire::{Faults, NodeId};

/// Header of the table of decoded rows. Columns shared with `samples.csv` have the same names, units and
/// meaning; a cell is blank if no value was sent with the sample.
///
/// | columns | meaning | unit |
/// |---|---|---|
/// | `t` | time of the sample on the foot's clock; on CAN in steps of 10 µs | s |
/// | `t_received` | on CAN, time of reception on the log's clock: since 1970, or since the start of the log | s |
/// | `t_common` | on CAN, time on the log's clock, common to all feet: with `sync`, the time of the sample, if the foot has reported a SYNC whose number is also in the log; with `received`, `t_received` | s |
/// | `clock` | source of `t_common`: `sync` or `received` | |
/// | `interface` | CAN interface that received the frame; feet on two interfaces may share an id | |
/// | `foot` | name of the foot: that of its node id (0x11 `FL`, 0x12 `FR`, 0x13 `RL`, 0x14 `RR`, 0x15 `L`, 0x16 `R`), or a given name | |
/// | `node` | node id of the foot; on the serial line known from the first health message on | |
/// | `segment` | number of restarts of the foot so far; each resets `t` and `sequence` | |
/// | `sequence` | sequence number of the frame, modulo 2⁸ on CAN, 2¹⁶ on the serial line | |
/// | `p_stable` … `p_wz`, `qw` … `qz`, `lax` … `laz`, `bwx` … `bwz`, `state` | as in the rows of estimates (`tables::output`) | |
/// | `uwx`, `uwy`, `uwz` | angular rate without bias | rad/s |
/// | `temperature` | temperature of the sensor | °C |
/// | `decision` | debounced decision: 1 stable, 0 not stable | 0 or 1 |
/// | `flags` | names of the estimator's flags, and `fault`. Most frames on CAN are less specific: `saturated`, `starting` for a window that is not full or an unknown attitude, `doubtful` for the others; `time_not_known` if `t` may be wrong by a multiple of 0.65536 s, as no health frame was received since the start or a loss | |
pub const HEADER: &str = "t,t_received,t_common,clock,interface,foot,node,segment,sequence,p_stable,p_tangential,p_vertical,\
     p_ax,p_ay,p_az,p_wx,p_wy,p_wz,qw,qx,qy,qz,lax,lay,laz,uwx,uwy,uwz,bwx,bwy,bwz,\
     temperature,state,decision,flags";

samples::named! {
    /// Source of the common time of all feet, with its name in tables and reports.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum CommonClock {
        /// The foot's clock plus an offset obtained from numbered SYNCs.
        Sync = "sync",
        /// The log's clock at reception of the frame.
        Received = "received",
        /// The clock of the headers of messages, by which the time of a sample is known.
        Header = "header",
    }
}

/// Whether the turn of a foot's 16-bit clock is known, to which a contact on CAN belongs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClockTurn {
    /// Known, from a health frame or from the contacts since then. On a serial line the turn is always known.
    #[default]
    Known,
    /// Assumed by the time of reception, because no health frame was received since the start or a loss.
    NotYet,
}

/// Values sent for one sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactRow {
    /// Time of the sample.
    pub timestamp: Timestamp,
    /// Whether `timestamp` may be wrong by whole turns of the foot's 16-bit clock.
    pub turn: ClockTurn,
    /// Number of frames of the foot that are missing before this one, by their sequence numbers; negative if
    /// earlier rows counted too many.
    pub missing: i64,
    /// Time of reception on the log's clock.
    pub received: Option<Timestamp>,
    /// Time on the common clock of all feet, and its source.
    pub common: Option<(Timestamp, CommonClock)>,
    /// Time of the header of a message less the common time in µs, ns.
    pub rest_ns: i16,
    /// CAN interface that received the frame.
    pub interface: Option<Arc<str>>,
    /// Name of the foot, if any.
    pub foot: Option<Arc<str>>,
    /// Node id of the foot, if known.
    pub node: Option<NodeId>,
    /// Number of restarts of the foot so far.
    pub segment: u32,
    /// Sequence number of the frame.
    pub sequence: u16,
    /// Probability of stable contact.
    pub stable: f32,
    /// Probability of no motion along the ground.
    pub tangential: f32,
    /// Probability of no lifting.
    pub vertical: f32,
    /// Probability per axis.
    pub axes: Option<PerAxis<f32>>,
    /// Orientation, foot → world.
    pub orientation: Option<Quaternion>,
    /// Acceleration without gravity, m/s².
    pub acceleration: Option<Vec3>,
    /// Angular rate without bias, rad/s.
    pub rate: Option<Vec3>,
    /// Gyroscope bias, rad/s.
    pub bias: Option<Vec3>,
    /// Temperature of the sensor, °C.
    pub temperature: Option<f32>,
    /// Phase, decision and status bits.
    pub status: Status,
    /// The estimator's flags as bits.
    pub flags: Option<u8>,
    /// Standard deviation of the foot's velocity, m/s, of an estimate computed or recorded on a host.
    pub velocity_sigma: Option<f32>,
    /// Recorded sample, gravity included, that a recording has with this estimate. Its time is on the clock of
    /// [`Self::timestamp`], at or before it.
    pub measured: Option<ImuSample>,
    /// Load recorded with that sample, N or the unit of its recording; NaN once it is unknown.
    pub load: Option<f32>,
}

impl ContactRow {
    /// Creates the row of an estimate that was computed here.
    #[must_use]
    pub fn of_estimate(estimate: &ContactEstimate) -> Self {
        let (decision, phase, flags) = (estimate.decision, estimate.phase, estimate.flags);
        Self {
            timestamp: estimate.timestamp,
            stable: estimate.probabilities.stable,
            tangential: estimate.probabilities.tangential,
            vertical: estimate.probabilities.vertical,
            axes: Some(estimate.probabilities.axes),
            orientation: Some(estimate.orientation),
            acceleration: Some(estimate.linear_acceleration.0),
            rate: Some(estimate.angular_rate.0),
            bias: Some(estimate.gyro_bias.0),
            velocity_sigma: Some(estimate.velocity_sigma.0),
            status: Status::new(decision, phase, flags, Faults::NONE),
            flags: Some(flags.bits()),
            ..Self::default()
        }
    }

    /// Names in the column `flags`.
    #[must_use]
    pub fn flag_names(&self) -> Vec<&'static str> {
        let (status, flags) = (self.status, self.flags.map(Flags::from_bits));
        let of_status = [
            (flags.is_none() && status.is_saturated(), Flag::Saturated.name()),
            (flags.is_none() && status.is_starting(), "starting"),
            (status.has_fault(), "fault"),
        ];
        let of_status = of_status.into_iter().filter(|(is_set, _)| *is_set);
        let flags = flags.iter().flat_map(|flags| flags.iter()).map(Flag::name);
        let mut names: Vec<_> = flags.chain(of_status.map(|(_, name)| name)).collect();
        if names.is_empty() && !status.is_valid() {
            names.push("doubtful");
        }
        if self.turn == ClockTurn::NotYet {
            names.push("time_not_known");
        }
        names
    }
}

/// Writes a row of the table.
///
/// # Errors
/// The writer fails.
pub fn write_row(row: &ContactRow, to: &mut dyn Write) -> io::Result<()> {
    let (common, clock) = row.common.unzip();
    for time in [Some(row.timestamp), row.received, common] {
        if let Some(micros) = time.map(Timestamp::as_micros) {
            write!(to, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)?;
        }
        write!(to, ",")?;
    }
    write!(to, "{}", clock.map_or("", CommonClock::name))?;
    for name in [&row.interface, &row.foot] {
        write!(to, ",{}", name.as_deref().unwrap_or_default())?;
    }
    write!(to, ",")?;
    if let Some(node) = row.node {
        write!(to, "{}", node.get())?;
    }
    write!(to, ",{},{}", row.segment, row.sequence)?;
    cells(to, Some([row.stable, row.tangential, row.vertical]))?;
    cells(to, row.axes.map(PerAxis::to_array))?;
    cells(to, row.orientation.map(|q| [q.w, q.x, q.y, q.z]))?;
    for vector in [row.acceleration, row.rate, row.bias] {
        cells(to, vector.map(components))?;
    }
    cells(to, row.temperature.map(|celsius| [celsius]))?;
    let decision = u8::from(row.status.decision() == Decision::Stable);
    let state = row.status.phase().name();
    writeln!(to, ",{state},{decision},{}", row.flag_names().join("|"))
}

/// Writes numbers, or the same number of blank cells; a NaN is blank too.
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

    fn written(row: &ContactRow) -> Vec<String> {
        let mut bytes = Vec::new();
        write_row(row, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let row = text.trim_end();
        row.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn every_column_has_a_cell_blank_if_no_value_was_sent() {
        let bare = ContactRow {
            timestamp: Timestamp::from_micros(1_000_010),
            stable: 0.5,
            ..ContactRow::default()
        };
        let full = ContactRow {
            timestamp: Timestamp::from_micros(2_345_678),
            turn: ClockTurn::NotYet,
            missing: 0,
            received: Some(Timestamp::from_micros(7_000_001)),
            common: Some((Timestamp::from_micros(6_900_001), CommonClock::Sync)),
            rest_ns: 0,
            interface: Some("can1".into()),
            foot: Some("FL".into()),
            node: NodeId::new(17),
            segment: 2,
            sequence: 300,
            stable: 0.5,
            tangential: 0.25,
            vertical: 0.75,
            axes: Some(PerAxis { ax: 0.1, ay: 0.2, az: 0.3, wx: 0.4, wy: 0.5, wz: 0.6 }),
            orientation: Some(Quaternion { w: 0.91, x: 0.92, y: 0.93, z: 0.94 }),
            acceleration: Some(Vec3::new(1.0, f32::NAN, 3.0)),
            rate: Some(Vec3::new(4.0, 5.0, 6.0)),
            bias: Some(Vec3::new(7.0, 8.0, 9.0)),
            temperature: Some(25.5),
            // Stance, stable, valid.
            status: Status::from_bits(0x19),
            flags: Some(Flags::NONE.with(Flag::TimeGap).bits()),
            velocity_sigma: None,
            measured: None,
            load: None,
        };
        let (bare, full) = (written(&bare), written(&full));
        let columns = HEADER.split(',').count();
        assert_eq!((bare.len(), full.len()), (columns, columns));
        assert_eq!(bare[..12], ["1.000010", "", "", "", "", "", "", "0", "0", "0.5", "0", "0"]);
        assert!(bare[12..32].iter().all(String::is_empty));
        assert_eq!(bare[32..], ["unknown", "0", "doubtful"]);
        let cells: Vec<_> = HEADER.split(',').zip(full.iter().map(String::as_str)).collect();
        assert_eq!(
            cells,
            [
                ("t", "2.345678"),
                ("t_received", "7.000001"),
                ("t_common", "6.900001"),
                ("clock", "sync"),
                ("interface", "can1"),
                ("foot", "FL"),
                ("node", "17"),
                ("segment", "2"),
                ("sequence", "300"),
                ("p_stable", "0.5"),
                ("p_tangential", "0.25"),
                ("p_vertical", "0.75"),
                ("p_ax", "0.1"),
                ("p_ay", "0.2"),
                ("p_az", "0.3"),
                ("p_wx", "0.4"),
                ("p_wy", "0.5"),
                ("p_wz", "0.6"),
                ("qw", "0.91"),
                ("qx", "0.92"),
                ("qy", "0.93"),
                ("qz", "0.94"),
                ("lax", "1"),
                ("lay", ""),
                ("laz", "3"),
                ("uwx", "4"),
                ("uwy", "5"),
                ("uwz", "6"),
                ("bwx", "7"),
                ("bwy", "8"),
                ("bwz", "9"),
                ("temperature", "25.5"),
                ("state", "stance"),
                ("decision", "1"),
                ("flags", "time_gap|time_not_known"),
            ]
        );
    }

    #[test]
    fn flags_are_as_precise_as_the_frames_received() {
        let names = |status: u8, flags: Option<u8>| {
            let status = Status::from_bits(status);
            ContactRow { status, flags, ..ContactRow::default() }.flag_names().join("|")
        };
        assert_eq!(names(0x10, None), "");
        assert_eq!(names(0xA0, None), "saturated|starting");
        assert_eq!(names(0x80, Some(0b11)), "window_not_full|attitude_not_initialised");
        assert_eq!(names(0x40, Some(0)), "fault");
        assert_eq!(names(0x00, None), "doubtful");
    }
}
