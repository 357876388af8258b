//! Memory of a long replay. It takes a minute of processor time: `.ci/run` runs it.

#![cfg(target_os = "linux")]

mod common;

use std::fs;
use std::io::{Read, Write};
use std::process::Stdio;

use common::{AXES, Bench};

/// Returns the peak memory of a replay of `rows` rows from a pipe, KiB.
fn peak_memory(rows: u32, options: &str) -> u64 {
    let bench = Bench::new();
    let mut child = bench
        .command(&format!("replay - {options}"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command that was just built");
    let status = format!("/proc/{}/status", child.id());
    let mut stdin = std::io::BufWriter::new(child.stdin.take().expect("a pipe"));
    writeln!(stdin, "t,{AXES},force,label").expect("a pipe");
    for k in 0..rows {
        let phase = f64::from(k % 1000) / 1000.0;
        let swing = if phase < 0.5 { 0.0 } else { (40.0 * phase).sin() };
        let (force, label) = if phase < 0.5 { (80, 1) } else { (0, 0) };
        let time = f64::from(k) / 1000.0;
        writeln!(
            stdin,
            "{time:.3},{:.2},0,{:.2},0,{:.2},0,{force},{label}",
            5.0 * swing,
            9.81 + 3.0 * swing,
            4.0 * swing
        )
        .expect("a pipe");
    }
    stdin.flush().expect("a pipe");
    let memory = || -> u64 {
        let status = fs::read_to_string(&status).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
        kib.unwrap_or(0)
    };
    // The command waits for the end of its input.
    let mut peak = memory();
    drop(stdin);
    while child.try_wait().expect("a child").is_none() {
        peak = peak.max(memory());
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let mut summary = String::new();
    let mut stdout = child.stdout.take().expect("a pipe");
    stdout.read_to_string(&mut summary).expect("text");
    assert!(summary.contains(&format!("{rows} samples")), "{summary}");
    peak
}

#[test]
fn long_replay_needs_less_than_64_mb() {
    // Each buffer has a part in memory, which is full after about 860,000 rows. Measured once: 45 MB, or 57 MB in
    // a program with all features. If all rows stayed in memory, it would be 70 MB.
    let peak_kib = peak_memory(1_200_000, "--output out.csv --plot out.svg");
    assert!((1000..64_000).contains(&peak_kib), "{peak_kib} KiB");
}
