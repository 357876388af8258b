//! Bitwise comparison of targets and host: the self-check ELF runs on an emulated Cortex-M4F, and on a Cortex-M33, and must
//! print the digests that the same code gives here.

use std::path::PathBuf;
use std::process::Command;

use estimator_core::{Params, self_check};
use host_tests::committed::workspace;
use host_tests::qemu;

#[test]
fn the_estimator_gives_the_host_bits_on_an_emulated_m4f() {
    let Some(mut qemu) = qemu::stock_board() else {
        return;
    };
    assert_same_bits(qemu.arg("-kernel").arg(build_self_check()));
}

#[test]
#[ignore = "full: another target"]
fn the_estimator_gives_the_host_bits_on_an_emulated_m33() {
    let Some(mut qemu) = qemu::cortex_m33() else {
        return;
    };
    assert_same_bits(qemu.arg("-kernel").arg(build_self_check_of_m33()));
}

fn assert_same_bits(qemu: &mut Command) {
    let output = qemu.output().expect("QEMU starts");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "the self-check failed: {printed}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let on_target: Vec<&str> = printed.lines().collect();
    assert_eq!(on_target, digests_on_host());
}

fn digests_on_host() -> Vec<String> {
    let mut lines = Vec::new();
    for (preset, params) in [("default", Params::DEFAULT), ("paper", Params::PAPER)] {
        self_check::run(&params, |samples, digest| {
            lines.push(format!("{preset} {samples} {digest:016x}"));
        })
        .expect("a preset is valid");
    }
    lines
}

/// Builds the release ELF for the target and returns its path.
fn build_self_check() -> PathBuf {
    let target_dir = workspace().join("target");
    let status = Command::new(env!("CARGO"))
        .args(["build", "--profile", "firmware", "-p", "foot-stm32f405", "--bin", "self-check"])
        .args(["--target", "thumbv7em-none-eabihf", "--target-dir"])
        .arg(&target_dir)
        .current_dir(workspace())
        .status()
        .expect("cargo starts");
    assert!(
        status.success(),
        "the firmware does not build; `rustup target add thumbv7em-none-eabihf` adds the target"
    );
    target_dir.join("thumbv7em-none-eabihf/firmware/self-check")
}

/// Builds the ELF for a Cortex-M33, the core of the RP2350, and returns its path.
fn build_self_check_of_m33() -> PathBuf {
    const TARGET: &str = "thumbv8m.main-none-eabihf";
    let target_dir = workspace().join("target/feather-rp2350");
    let status = Command::new(env!("CARGO"))
        .args(["build", "--locked", "--release", "--bin", "self-check", "--target", TARGET])
        .args(["--no-default-features", "--features", "self-check", "--target-dir"])
        .arg(&target_dir)
        .current_dir(workspace().join("firmware/boards/rp2040"))
        .status()
        .expect("cargo starts");
    assert!(status.success(), "it does not build; `rustup target add {TARGET}` adds the target");
    target_dir.join(TARGET).join("release/self-check")
}
