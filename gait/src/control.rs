//! The control of a simulated robot: which feet it has, how they follow one another, and its frames on
//! their bus. At 100 Hz it sends a numbered SYNC, and to each foot its load.

use wire::foot::cob_id;
use wire::pdo::{LastSync, Load};
use wire::{CanFrame, Foot, NodeId, Value};

/// The most feet of a robot.
pub const MOST_FEET: usize = 6;

/// The phase between one foot and the next, s: a quarter of a stride of a walk.
pub const PHASE_S: f64 = 0.225;

/// The value of a foot's setting for the source of its load that is these reports.
pub const LOAD_OVER_CAN: Value = Value::U8(2);

/// From one SYNC to the next, and from one report of loads to the next, ms.
const PERIOD_MS: u64 = 10;

/// The places of a robot's feet, 1 to [`MOST_FEET`]; two are those of a biped.
#[must_use]
pub fn feet(count: usize) -> &'static [Foot] {
    match count {
        2 => &[Foot::Left, Foot::Right],
        _ => &Foot::ALL[..count.clamp(1, MOST_FEET)],
    }
}

/// The frame with which a robot reports a load, N, to a foot.
#[must_use]
pub fn load_frame(node: NodeId, load_n: f32) -> Option<CanFrame> {
    CanFrame::new(node.cob_id(Load::BASE), &Load(load_n).encode())
}

/// The control of a robot.
#[derive(Clone, Debug, Default)]
pub struct Control {
    sync: u8,
}

impl Control {
    /// The frames that it sends in a millisecond since it was switched on, with the load of each foot, N.
    pub fn frames(
        &mut self,
        ms: u64,
        loads: impl IntoIterator<Item = (NodeId, f64)>,
    ) -> Vec<CanFrame> {
        if !ms.is_multiple_of(PERIOD_MS) {
            return Vec::new();
        }
        self.sync = LastSync::number_after(self.sync);
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
    fn syncs_are_numbered_from_1_to_240_and_again() {
        let mut control = Control::default();
        let numbers: Vec<u8> = (0..2410)
            .flat_map(|ms| control.frames(ms, []))
            .filter_map(|frame| frame.data().first().copied())
            .collect();
        let expected: Vec<u8> = (1..=240).chain([1]).collect();
        assert_eq!(numbers, expected);
    }
}
