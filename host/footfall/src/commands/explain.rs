//! `footfall explain`: meaning of a fault, a flag, a refusal, a state, a finding or the address of a crash, and what to do.

use bootloader::layout::{JOURNAL, SLOT_SIZE, Slot};
use clap::Args;
use estimator_core::Phase;
use feet::decode::remedy::Trouble;
use recordings::plausible::FINDINGS;

use crate::error::Error;
use crate::report::print_text;

/// Arguments of `footfall explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// A code such as 0x7007, a name such as settling or "sensor frozen", or the address of a crash such as
    /// 0x08024F6A; all names are listed where none is given
    pub what: Vec<String>,
}

impl ExplainArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let wanted = self.what.join(" ");
        // Some refusals have codes that could be addresses in the bootloader.
        let explained = match Trouble::find(&wanted) {
            _ if self.what.is_empty() => Trouble::all()
                .map(line)
                .chain(words().map(word_line))
                .collect(),
            Some(trouble) => text(trouble),
            None => words()
                .find(|(_, name, _)| *name == wanted.to_lowercase().replace([' ', '-'], "_"))
                .map(|(kind, name, meaning)| format!("{kind} {name}\n  {meaning}\n"))
                .or_else(|| address_of_crash(&wanted).map(where_it_is))
                .ok_or(Error::NothingToExplain(wanted))?,
        };
        print_text(&explained).map_err(Error::Print)
    }
}

/// Meanings of the states of a foot.
const fn meaning(state: Phase) -> &'static str {
    match state {
        Phase::Unknown => {
            "there is no load signal, or the estimate rests on doubtful data; P and the decision still count"
        }
        Phase::Stance => "the foot is loaded and at rest: stable contact",
        Phase::Slip => "the foot is loaded and moves: unstable contact",
        Phase::Swing => "the foot is not loaded and moves",
        Phase::QuietSwing => "the foot is not loaded and at rest, as at the top of a slow swing",
    }
}

/// States and findings: kind, name, meaning.
fn words() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    let states = Phase::ALL.into_iter();
    let states = states.map(|state| ("state", state.name(), meaning(state)));
    let findings = FINDINGS.into_iter();
    states.chain(findings.map(|(name, condition)| ("finding", name, condition)))
}

fn word_line((kind, name, _): (&str, &str, &str)) -> String {
    format!("{kind:<8} {:<10} {name}\n", "")
}

/// End of the bootloader.
const SETTINGS: u32 = 0x0800_8000;

/// Flash and RAM of the chip (RM0090, 2.3).
const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0810_0000;
const RAM: std::ops::Range<u32> = 0x2000_0000..0x2002_0000;

/// Returns the address that the text is, as object 0x2113:2 and the log give it for a crash.
fn address_of_crash(text: &str) -> Option<u32> {
    let digits = text.strip_prefix("0x").or(text.strip_prefix("0X"))?;
    let address = u32::from_str_radix(digits, 16).ok()?;
    (FLASH.contains(&address) || RAM.contains(&address)).then_some(address)
}

/// Says what is at an address, and how the line of its source is found.
fn where_it_is(address: u32) -> String {
    let program = Slot::Running.start();
    let place = match address {
        _ if !FLASH.contains(&address) => {
            "RAM, which holds no program: the stack or a jump went wrong"
        }
        _ if address < SETTINGS => "the bootloader",
        _ if address < JOURNAL => "the settings, not a program",
        _ if address < program => "the journal of updates, not a program",
        _ if address < program + SLOT_SIZE => "the foot's program",
        _ => "a program that does not run from there: a new or the previous one",
    };
    let mut text = format!("address 0x{address:08X}: {place}\n");
    if (program..program + SLOT_SIZE).contains(&address) {
        text.push_str(&format!(
            "  its line: addr2line -f -C -i -e foot-VERSION-BOARD.elf 0x{address:08X}, with the ELF of the very program: footfall foot SOURCE info has its version and number, under which cargo xtask image keeps it in target/elf\n"
        ));
    }
    text
}

fn line(trouble: Trouble) -> String {
    let (kind, code) = (trouble.kind(), trouble.code_text());
    format!("{kind:<8} {code:<10} {}\n", trouble.name())
}

fn text(trouble: Trouble) -> String {
    let (kind, code) = (trouble.kind(), trouble.code_text());
    let mut text = format!("{kind} {code} {}", trouble.name());
    if let Trouble::Fault(fault) = trouble {
        text.push_str(&format!("\n  detail: {}", fault.detail()));
    }
    if !trouble.consequence().is_empty() {
        text.push_str(&format!("\n  meanwhile: {}", trouble.consequence()));
    }
    format!("{text}\n  what to do: {}\n", trouble.remedy()).replace("  \n", "\n")
}
