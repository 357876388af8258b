//! The table of latencies in `README.md` adds up, and matches values measured elsewhere.

use std::fs;
use std::path::Path;

use wire::settings::longest_frame;

/// Bits per ms.
const BIT_RATE: f64 = 1.0e3;

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(path).expect("the document is there")
}

/// Cells of the first row after `section` that begins with `name`.
fn row(document: &str, section: &str, name: &str) -> Vec<String> {
    let (_, text) = document.split_once(section).expect("the section is there");
    let row = text.lines().find_map(|line| {
        let cells = line.strip_prefix("| ")?;
        cells.starts_with(name).then_some(cells)
    });
    let row = row.unwrap_or_else(|| panic!("{section}: {name}"));
    row.split('|').map(|cell| cell.trim().trim_matches('*').to_string()).collect()
}

/// Typical and maximum latency, ms.
fn latency(part: &str) -> [f64; 2] {
    let cells = row(&read("README.md"), "## Latency", part);
    [&cells[1], &cells[2]].map(|cell| cell.parse().expect("a number"))
}

/// Budget of a row of `host/virtual-board/README.md`, ms.
fn budget(block: &str, name: &str) -> f64 {
    let cells = row(&read("../host/virtual-board/README.md"), block, name);
    cells[2].parse::<f64>().expect("µs") / 1.0e3
}

fn assert_close(part: &str, expected: [f64; 2], tolerance: f64) {
    for (found, expected) in latency(part).into_iter().zip(expected) {
        assert!((found - expected).abs() < tolerance, "{part}: {found} ms instead of {expected}");
    }
}

#[test]
fn the_parts_add_up_to_the_total() {
    let parts = ["filters", "until the next sample", "reading", "until the bus", "the frame"];
    let sum = |parts: &[&str]| {
        let zero = [0.0; 2];
        parts.iter().fold(zero, |sum, part| {
            let [typical, longest] = latency(part);
            [sum[0] + typical, sum[1] + longest]
        })
    };
    assert_close("**sum**", sum(&parts), 0.006);
    // The age of the sample is in the text below the table.
    let [typical, longest] = sum(&parts[2..]);
    let age = format!("{:.0} µs, at most {:.0} µs", typical * 1.0e3, longest * 1.0e3);
    assert!(read("README.md").contains(&age), "{age}");
}

#[test]
fn the_share_of_the_firmware_is_its_budget() {
    let edge = "data-ready edge to CAN mailbox";
    let typical = budget("<!-- begin budgets-reference -->", &format!("{edge}, median"));
    let longest = budget("<!-- begin full-load-reference -->", &format!("{edge}, longest"));
    assert_close("reading", [typical, longest], 1.0e-9);
}

#[test]
fn the_share_of_the_bus_is_that_of_the_longest_frames() {
    let longest = |bytes| f64::from(longest_frame(bytes)) / BIT_RATE;
    // 44 bits around the data, and 3 until the next frame.
    let unstuffed = f64::from(8 * 8 + 44 + 3) / BIT_RATE;
    assert_close("the frame", [unstuffed, longest(8)], 1.0e-9);
    // One in progress, three of other feet; SYNC with its counter.
    assert_close("until the bus", [0.0, 4.0 * longest(8) + longest(1)], 1.0e-9);
}
