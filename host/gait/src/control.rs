//! Control of a simulated robot: its feet, their phases, and its frames on their bus. At 100 Hz it sends a
//! numbered SYNC, and to each foot its load.

use wire::foot::cob_id;
use wire::pdo::{ClockReading, Load};
use wire::{CanFrame, Foot, NodeId, Value};

/// Largest number of feet of a robot.
pub const MOST_FEET: usize = 6;

/// Phase between one foot and the next, s: a quarter of a stride of a walk.
pub const PHASE_S: f64 = 0.225;

/// Value of a foot's load-source setting that selects load reports over CAN.
pub const LOAD_OVER_CAN: Value = Value::U8(2);

/// Period of SYNCs and of load reports, ms.
const PERIOD_MS: u64 = 10;

/// Returns the places of a robot's feet, 1 to [`MOST_FEET`]. A robot with two feet is a biped.
#[must_use]
pub fn feet(count: usize) -> &'static [Foot] {
    match count {
        2 => &[Foot::Left, Foot::Right],
        _ => &Foot::ALL[..count.clamp(1, MOST_FEET)],
    }
}

/// Returns the frame that reports a load, N, to a foot.
#[must_use]
pub fn load_frame(node: NodeId, load_n: f32) -> Option<CanFrame> {
    CanFrame::new(node.cob_id(Load::BASE), &Load(load_n).encode())
}

/// The control of a robot.
#[derive(Clone, Debug, Default)]
pub struct RobotControl {
    sync: u8,
}

impl RobotControl {
    /// Returns the frames sent in a millisecond since power-up, with the load of each foot, N.
    pub fn frames(
        &mut self,
        ms: u64,
        loads: impl IntoIterator<Item = (NodeId, f64)>,
    ) -> Vec<CanFrame> {
        if !ms.is_multiple_of(PERIOD_MS) {
            return Vec::new();
        }
        self.sync = ClockReading::sync_after(self.sync);
        let sync = CanFrame::new(cob_id::SYNC, &[self.sync]);
        let loads = loads.into_iter();
        let loads = loads.filter_map(|(node, load)| load_frame(node, load as f32));
        sync.into_iter().chain(loads).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sync_numbers_run_from_1_to_240_and_repeat() {
        let mut control = RobotControl::default();
        let numbers: Vec<u8> = (0..2410)
            .flat_map(|ms| control.frames(ms, []))
            .filter_map(|frame| frame.data().first().copied())
            .collect();
        let expected: Vec<u8> = (1..=240).chain([1]).collect();
        assert_eq!(numbers, expected);
    }
}
