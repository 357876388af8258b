//! `footfall foot … update`: sends the image of a program to one foot or to several on a line.

use std::fs;
use std::mem::discriminant;
use std::path::Path;

use feet::decode::live::LiveDecoder;
use feet::foot::update::{self, FootProgram, Image, UpdateError, UpdateStage, Updated};
use feet::foot::{Client, RequestError, scan};
use feet::link::Link;
use feet::usb;
use indicatif::ProgressBar;
use serde_json::{Value as Json, json};
use wire::NodeId;

use super::error::FootError;
use super::{FootArguments, hex, to_json};
use crate::Source;
use crate::error::Error;
use crate::messages;
use crate::progress::Bars;
use crate::report::print_text;
use crate::words::with_hint;

/// Feet that are to be updated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Which<'a> {
    One,
    All,
    /// Boards with these serial numbers.
    Numbered(&'a [u32]),
}

/// File with a program.
pub(super) struct ImageFile<'a> {
    name: &'a Path,
    bytes: Vec<u8>,
}

impl<'a> ImageFile<'a> {
    pub(super) fn read(name: &'a Path) -> Result<Self, Error> {
        let bytes = fs::read(name).map_err(|error| refused(name, &error.to_string()))?;
        Ok(Self { name, bytes })
    }

    /// Returns whether the file is to be copied to the drive of a foot on USB. An image is sent over a line instead.
    pub(super) fn is_for_usb(&self) -> bool {
        usb::is_program(&self.bytes)
    }
}

fn refused(file: &Path, message: &str) -> Error {
    FootError::File { file: file.display().to_string(), message: message.to_owned() }.into()
}

/// Copies a program to the drive of a foot on USB, and returns a report.
pub(super) fn copy_over_usb(
    arguments: &FootArguments,
    source: &Source,
    file: &ImageFile<'_>,
    which: Which<'_>,
) -> Result<String, Error> {
    if arguments.json || arguments.node.is_some() || which != Which::One {
        return Err(refused(
            file.name,
            "a program for the one foot on a USB port: no --all, --node, --serial or --json",
        ));
    }
    let Source::Line(feet::Source::Uart { port, .. }) = source else {
        return Err(refused(file.name, "a program for a foot on USB: name it as usb or uart:PORT"));
    };
    usb::update(port, &file.bytes)
        .map_err(|error| FootError::NotUpdated(with_hint(&error, error.hint())))?;
    Ok(format!("{port}: the program is copied and runs\n"))
}

/// Sends the image to the feet, and returns a report.
pub(super) fn send(
    arguments: &FootArguments,
    source: &Source,
    mut link: Box<dyn Link>,
    ImageFile { name, bytes }: ImageFile<'_>,
    which: Which<'_>,
) -> Result<String, Error> {
    let image = Image::new(bytes).map_err(|why| refused(name, why.words()))?;
    let (mut client, mut feet) = match which {
        // There is one foot on a serial line.
        Which::All | Which::Numbered(_) if link.as_serial_line().is_none() => {
            let heard = scan::feet(link.as_mut(), &mut LiveDecoder::default(), scan::SCAN)?;
            let nodes = heard.iter().map(|foot| foot.node.and_then(NodeId::new));
            let nodes: Vec<_> = nodes.collect();
            let first = *nodes.first().ok_or(RequestError::NoFoot)?;
            (Client::new(link, first)?, nodes)
        }
        Which::One | Which::All | Which::Numbered(_) => {
            let client = Client::new(link, arguments.node)?;
            let foot = client.node();
            (client, vec![foot])
        }
    };
    if let Which::Numbered(numbers) = which {
        feet = client.with_serial_numbers(&feet, numbers)?;
    }
    let mut progress = Progress::default();
    let results = update::update(&mut client, &feet, &image, &mut |foot, step| {
        progress.show(foot, step);
    });
    progress.end_bar();
    let failed = results.iter().filter_map(|result| result.as_ref().err());
    let failed: Vec<String> = failed.map(ToString::to_string).collect();
    let text = if arguments.json {
        let updates = feet.iter().zip(&results);
        let updates = updates.map(|(node, result)| as_json(*node, result));
        to_json(&updates.collect::<Vec<_>>())
    } else {
        results.iter().flatten().map(line).collect()
    };
    if failed.is_empty() {
        return Ok(text);
    }
    let is_silent = |error: &UpdateError| {
        matches!(error, UpdateError::NotStarted { .. } | UpdateError::Request(_))
    };
    let mut errors = results.iter().filter_map(|result| result.as_ref().err());
    if matches!(source, Source::Demo(_)) && errors.any(is_silent) {
        return Err(FootError::NoBootloader.into());
    }
    // The successful updates are printed as well.
    print_text(&text).map_err(Error::Print)?;
    Err(FootError::NotUpdated(failed.join("\n")).into())
}

/// Returns the result for a foot as JSON.
///
/// | field | null |
/// |---|---|
/// | `node` | on a serial line |
/// | `serial`, `from_program` | the update failed |
/// | `from_version` | the update failed, or the foot ran its bootloader |
/// | `to_version`, `to_program` | the update failed, or nothing was sent |
/// | `error` | the foot was updated |
///
/// The program number 00000000 means that neither an image nor a commit identifies the program.
fn as_json(node: Option<NodeId>, result: &Result<Updated, UpdateError>) -> Json {
    let number = |program: &FootProgram| hex(program.identification);
    let done = result.as_ref().ok();
    let after = done.and_then(|done| done.after.as_ref());
    json!({
        "node": node.map(NodeId::get),
        "serial": done.map(|done| done.serial),
        "from_version": done.and_then(|done| done.before.version.clone()),
        "from_program": done.map(|done| number(&done.before)),
        "to_version": after.and_then(|after| after.version.clone()),
        "to_program": after.map(number),
        "error": result.as_ref().err().map(ToString::to_string),
    })
}

fn line(updated: &Updated) -> String {
    let foot = &updated.foot;
    let before = name(&updated.before);
    match &updated.after {
        Some(after) => format!("{foot}: {before} → {}, confirmed\n", name(after)),
        None => format!("{foot}: {before} runs already, confirmed\n"),
    }
}

fn name(program: &FootProgram) -> String {
    match (program.version.as_deref(), program.identification) {
        (None, _) => "no program".to_owned(),
        (Some(version), 0) => version.to_owned(),
        (Some(version), number) => format!("{version} ({})", hex(number)),
    }
}

/// Progress on standard error: a line for each step, and a bar while an image is sent.
#[derive(Default)]
struct Progress {
    last: Option<(String, UpdateStage)>,
    bar: Option<ProgressBar>,
}

impl Progress {
    fn show(&mut self, foot: &str, step: UpdateStage) {
        let last = self.last.replace((foot.to_owned(), step));
        let step_of = |step: &UpdateStage| discriminant(step);
        if last.is_none_or(|(of, last)| of != foot || step_of(&last) != step_of(&step)) {
            self.end_bar();
            messages::aside(format!("{foot}: {}", words(step)));
        }
        if let UpdateStage::Sending { percent } = step {
            let bar = self.bar.get_or_insert_with(|| Bars::default().sending());
            bar.set_position(percent.into());
        }
    }

    fn end_bar(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

const fn words(step: UpdateStage) -> &'static str {
    match step {
        UpdateStage::Stopping => "restarting into its bootloader",
        UpdateStage::Sending { .. } => "sending",
        UpdateStage::Installing => "installing",
        UpdateStage::Confirming => "running the program, until it has confirmed itself",
    }
}
