//! Bitwise comparison of targets and host: the self-check ELF runs on an emulated Cortex-M4F, and on a Cortex-M33, and must
//! print the digests that the same code gives here.

use std::path::{Path, PathBuf};
use std::process::Command;

use estimator_core::self_check;
use host_tests::committed::workspace;
use host_tests::qemu;

#[test]
fn the_estimator_gives_the_host_bits_on_an_emulated_m4f() {
    let Some(mut qemu) = qemu::stock_board() else {
        return;
    };
    assert_same_bits(qemu.arg("-kernel").arg(build_for_m4f()));
}

#[test]
#[ignore = "full: another target"]
fn the_estimator_gives_the_host_bits_on_an_emulated_m33() {
    let Some(mut qemu) = qemu::cortex_m33() else {
        return;
    };
    assert_same_bits(qemu.arg("-kernel").arg(build_for_m33()));
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
    for (preset, params, stream) in self_check::PRESETS {
        self_check::run(&params, stream, |samples, digest| {
            lines.push(format!("{preset} {samples} {digest:016x}"));
        })
        .expect("a preset is valid");
    }
    lines
}

/// Builds the self-check for a Cortex-M4F, and returns the path of its ELF.
fn build_for_m4f() -> PathBuf {
    build(
        "thumbv7em-none-eabihf",
        "firmware",
        &["--package", "foot-stm32f405"],
        &workspace(),
        &workspace().join("target"),
    )
}

/// Builds it for a Cortex-M33, the core of the RP2350.
fn build_for_m33() -> PathBuf {
    build(
        "thumbv8m.main-none-eabihf",
        "release",
        &["--no-default-features", "--features", "self-check"],
        &workspace().join("firmware/boards/rp"),
        &workspace().join("target/feather-rp2350"),
    )
}

/// Builds the self-check of the package that `options` choose in `folder`.
fn build(
    target: &str,
    profile: &str,
    options: &[&str],
    folder: &Path,
    target_folder: &Path,
) -> PathBuf {
    let status = Command::new(env!("CARGO"))
        .args(["build", "--locked", "--bin", "self-check", "--target", target])
        .args(["--profile", profile, "--target-dir"])
        .arg(target_folder)
        .args(options)
        .current_dir(folder)
        .status()
        .expect("cargo starts");
    assert!(status.success(), "it does not build; `rustup target add {target}` adds the target");
    target_folder.join(target).join(profile).join("self-check")
}
