//! Stock QEMU as an independent check of target programs.

use std::process::Command;

use crate::requirements::unmet;

const QEMU: &str = "qemu-system-arm";

/// QEMU's machine with an STM32F405 and semihosting. The test programs use only the core of the chip. `None`
/// if QEMU is not installed.
#[must_use]
pub fn stock_board() -> Option<Command> {
    machine("netduinoplus2")
}

/// QEMU's machine with a Cortex-M33 with a floating-point unit, as above.
#[must_use]
pub fn cortex_m33() -> Option<Command> {
    machine("mps2-an505")
}

fn machine(name: &str) -> Option<Command> {
    if Command::new(QEMU).arg("--version").output().is_err() {
        unmet("qemu-system-arm is not installed (Debian: apt-get install qemu-system-arm)");
        return None;
    }
    let mut command = Command::new(QEMU);
    command
        .args(["-machine", name])
        .args(["-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"]);
    Some(command)
}
