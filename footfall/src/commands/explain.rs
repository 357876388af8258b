//! `footfall explain`: meaning of a fault, a flag or a refusal, and its remedy.

use clap::Args;
use decode::remedy::Trouble;

use crate::error::Error;
use crate::report::print_text;

/// Arguments of `footfall explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// A code such as 0x7007 or a name such as settling or "sensor frozen"; all are listed where none is
    /// given
    pub what: Vec<String>,
}

impl ExplainArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        if self.what.is_empty() {
            let list: String = Trouble::all().map(line).collect();
            return print_text(&list).map_err(Error::Print);
        }
        let wanted = self.what.join(" ");
        let trouble = Trouble::find(&wanted).ok_or(Error::NothingToExplain { wanted })?;
        print_text(&text(trouble)).map_err(Error::Print)
    }
}

fn line(trouble: Trouble) -> String {
    let (kind, code) = (trouble.kind(), trouble.code_text());
    format!("{kind:<8} {code:<10} {}\n", trouble.name())
}

fn text(trouble: Trouble) -> String {
    let mut text = format!(
        "{} {} {}",
        trouble.kind(),
        trouble.code_text(),
        trouble.name()
    );
    if let Trouble::Fault(fault) = trouble {
        text.push_str(&format!("\n  detail: {}", fault.detail()));
    }
    if !trouble.consequence().is_empty() {
        text.push_str(&format!("\n  meanwhile: {}", trouble.consequence()));
    }
    format!("{text}\n  what to do: {}\n", trouble.remedy()).replace("  \n", "\n")
}
