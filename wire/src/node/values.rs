//! Values that the application publishes, and objects show.

use estimator_core::Learnt;

use super::{Crash, Node, Program};
use crate::stage::Stage;

impl Node {
    /// Publishes the name of the board.
    pub const fn set_hardware(&mut self, name: &'static str) {
        self.device.hardware = name;
    }

    /// Publishes the period of the ticks, µs.
    pub const fn set_tick(&mut self, tick_us: u16) {
        self.device.tick_us = tick_us;
    }

    /// Publishes the board's stage.
    pub const fn set_stage(&mut self, stage: Stage) {
        self.device.stage = stage;
    }

    /// Publishes the last crash.
    pub const fn set_crash(&mut self, crash: Crash) {
        self.device.crash = Some(crash);
    }

    /// Publishes the brown-out level at the start, 0 to 3.
    pub const fn set_brown_out_level(&mut self, level: u8) {
        self.device.brown_out_level = level;
    }

    /// Publishes the program that runs.
    pub const fn set_program(&mut self, program: Program) {
        self.device.program = program;
    }

    /// Publishes the values learnt by the estimator. Required before a request is handled: objects are
    /// encoded when they are read.
    pub const fn set_learnt(&mut self, learnt: Learnt) {
        self.device.learnt = learnt;
    }

    /// Publishes the largest costs so far: time to the mailbox and to the end of a tick's work, µs, and depth of the stack,
    /// bytes. Required before a request is handled.
    pub const fn set_costs(&mut self, costs: [u16; 3]) {
        self.device.costs = costs;
    }
}
