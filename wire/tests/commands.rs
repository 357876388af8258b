//! The `cansend` lines of `README.md` have the effect described in their comments.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use estimator_core::{Learnt, Timestamp};
use wire::node::{Finished, NmtState, Published};
use wire::{BootCause, CanFrame, Event, Node, Settings};

const NOW: Timestamp = Timestamp::from_micros(5_000_000);

/// A foot with default settings.
fn foot() -> Node {
    let mut node = Node::new(Settings::default(), 0xC0FFEE);
    node.boot(BootCause::PowerUp);
    node
}

/// Values of a foot that has walked for a while.
fn walked() -> Published {
    let learnt = Learnt::from_array([-1.0, 2.0, -4.5, 4.0, 3.0]);
    Published { learnt, ..Published::default() }
}

/// Frame in `cansend`'s notation, and its comment.
fn command(line: &str) -> Option<(CanFrame, &str)> {
    let (frame, comment) = line.strip_prefix("cansend can0 ")?.split_once(" # ")?;
    let (id, data) = frame.trim().split_once('#').expect("a frame");
    let hex = |text| u16::from_str_radix(text, 16).expect("hexadecimal");
    let data: Vec<u8> = (0..data.len()).step_by(2).map(|i| hex(&data[i..i + 2]) as u8).collect();
    Some((CanFrame::new(hex(id), &data).expect("a frame"), comment))
}

fn as_text(frame: &CanFrame) -> String {
    let mut text = format!("{:03X}#", frame.id());
    for byte in frame.data() {
        let _ = write!(text, "{byte:02X}");
    }
    text
}

/// Frame announced in the comment, after `words`.
fn announced<'a>(comment: &'a str, words: &str) -> Option<&'a str> {
    let (_, frame) = comment.split_once(words)?;
    frame.split(['…', ' ', ',']).next()
}

/// Sends the commands of a block; the node's response must be that of the comment.
fn run(node: &mut Node, block: &str) {
    let mut published = walked();
    for line in block.lines() {
        let Some((frame, comment)) = command(line) else {
            continue;
        };
        let outcome = node.receive(&frame, NOW, &mut published);
        let answer = match outcome.event {
            Some(Event::ResetCommunication) => node.boot(BootCause::Commanded),
            _ => outcome.reply.or_else(|| match node.finish(Ok(())) {
                Some(Finished::Can(frame)) => Some(frame),
                _ => None,
            }),
        };
        let expected =
            announced(comment, "the answer is ").or_else(|| announced(comment, "boots as "));
        let is_request = frame.id() & 0x780 == 0x600;
        match (answer.as_ref().map(as_text), expected) {
            (Some(answer), Some(expected)) => {
                assert!(answer.starts_with(expected), "{line}: {answer}");
            }
            (Some(answer), None) => assert_eq!(&answer[4..6], "60", "{line}: {answer}"),
            (None, expected) => assert!(expected.is_none() && !is_request, "{line}: no answer"),
        }
    }
}

/// Blocks of `README.md` in which frames are sent.
fn blocks() -> Vec<String> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(readme).expect("wire/README.md is there");
    let mut blocks: Vec<String> = readme
        .split("```sh\n")
        .skip(1)
        .filter_map(|part| Some(part.split_once("```")?.0.to_string()))
        .collect();
    blocks.retain(|block| block.contains("cansend"));
    blocks
}

#[test]
fn every_command_is_answered_and_leaves_the_foot_streaming() {
    let blocks = blocks();
    assert_eq!(blocks.len(), 3);
    for block in blocks {
        let mut node = foot();
        run(&mut node, &block);
        assert_eq!(node.state(), NmtState::Operational, "{block}");
    }
}

#[test]
fn a_foot_gets_another_id_over_sdo() {
    let mut node = foot();
    let blocks = blocks();
    let block = blocks.iter().find(|block| block.contains("0x2000 = 2"));
    run(&mut node, block.expect("the block is there"));
    let mut first = None;
    node.tick(&walked(), |_, frame| {
        first.get_or_insert(frame.id());
    });
    assert_eq!(first, Some(0x192));
}
