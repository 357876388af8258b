//! `footfall explain`: meaning of a fault, a flag, a refusal, a state or a finding, and what to do.

use clap::Args;
use estimator_core::Phase;
use feet::remedy::Trouble;
use plausible::FindingKind;

use crate::error::{Error, Worded};
use crate::report::print_text;

/// Arguments of `footfall explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// Code such as 0x7007, or name such as settling or "sensor frozen"; without one, all are listed
    pub what: Vec<String>,
}

/// No fault, flag, refusal, state or finding has this name.
#[derive(Debug, thiserror::Error)]
#[error(
    "{0:?} is unknown; footfall explain lists all faults, flags, refusals, states and findings"
)]
struct NothingToExplain(String);

impl Worded for NothingToExplain {}

impl ExplainArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let wanted = self.what.join(" ");
        let explained = if self.what.is_empty() {
            Trouble::all().map(line).chain(words().map(word_line)).collect()
        } else if let Some(trouble) = Trouble::find(&wanted) {
            text(trouble)
        } else {
            let name = wanted.to_lowercase().replace([' ', '-'], "_");
            words()
                .find(|(_, word, _)| *word == name)
                .map(|(kind, word, meaning)| format!("{kind} {word}\n  {meaning}\n"))
                .ok_or(NothingToExplain(wanted))?
        };
        print_text(&explained).map_err(Error::Print)
    }
}

/// Meanings of the states of a foot.
const fn meaning(state: Phase) -> &'static str {
    match state {
        Phase::Unknown => {
            "there is no load signal, or the data are in doubt; P and the decision are still valid"
        }
        Phase::Stance => "the foot is loaded and at rest: stable contact",
        Phase::Slip => {
            "the foot is loaded and moves, after it was stable or for longer than a landing: unstable contact"
        }
        Phase::Swing => "the foot is not loaded and moves",
        Phase::QuietSwing => "the foot is not loaded and at rest, as at the top of a slow swing",
        Phase::Landing => {
            "the foot has touched down and is not yet at rest, for 150 ms at most; it does not slip"
        }
    }
}

/// States and findings: kind, name, meaning.
fn words() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    let states = Phase::ALL.into_iter();
    let states = states.map(|state| ("state", state.name(), meaning(state)));
    let findings = FindingKind::ALL.into_iter();
    states.chain(findings.map(|kind| ("finding", kind.name(), kind.condition())))
}

fn word_line((kind, name, _): (&str, &str, &str)) -> String {
    format!("{kind:<8} {:<10} {name}\n", "")
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
