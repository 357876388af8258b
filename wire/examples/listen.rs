//! Prints each foot's probability of stable contact from the output of candump:
//! `candump -L can0 | cargo run -p footfall-wire --example listen`

use std::io::{self, BufRead, Write};

use wire::pdo::Contact;
use wire::{CanFrame, Foot, Pdo};

/// Frame of a line such as `(1.000000) can0 191#FFBFFF8040E2C819`.
fn frame(line: &str) -> Option<CanFrame> {
    let (id, hex) = line.split_whitespace().nth(2)?.split_once('#')?;
    let bytes = (0..hex.len()).step_by(2).map(|i| hex.get(i..i + 2));
    let data: Option<Vec<u8>> = bytes.map(|two| u8::from_str_radix(two?, 16).ok()).collect();
    CanFrame::new(u16::from_str_radix(id, 16).ok()?, &data?)
}

/// Writes a line for each contact: foot, P, phase.
pub fn print(log: impl BufRead, mut to: impl Write) -> io::Result<()> {
    for line in log.lines() {
        let Some(frame) = frame(&line?) else { continue };
        let sent = (Pdo::from_cob_id(frame.id()), frame.data8());
        if let (Some((Pdo::Contact, node)), Some(bytes)) = sent {
            let contact = Contact::decode(bytes);
            let foot = Foot::ALL.iter().find(|foot| foot.default_node_id() == node);
            let foot = foot.map_or("?", |foot| foot.name());
            let (p, phase) = (contact.stable.probability(), contact.status.phase());
            writeln!(to, "{foot} {p:.4} {}", phase.name())?;
        }
    }
    Ok(())
}

fn main() -> io::Result<()> {
    print(io::stdin().lock(), io::stdout().lock())
}
