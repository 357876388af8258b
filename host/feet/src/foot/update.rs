//! Update of the program of feet over CAN or their serial lines, by the program control of `CiA` 302-3
//! (`docs/guide/update.md`).

use std::time::Duration;

use bootloader::DEVICE_NAME as BOOTLOADER;
use bootloader::image::{HEADER, Header, Kind, Refusal};
use thiserror::Error;
use wire::dictionary::index;
use wire::node::{NmtCommand, NmtState};
use wire::{AbortCode, Address, NodeId, Value};

use super::client::Client;
use super::download::download;
use super::request::{RequestError, TRIES};

/// Time in which the bootloader erases the slot for a new program, with a reserve: 128 KiB take up to 2 s in words of
/// 32 bits (STM32F405 data sheet, DS8626, table 40).
const ERASE: Duration = Duration::from_secs(6);

/// Time in which a foot restarts into its bootloader, which erases the slot.
const STOP: Duration = Duration::from_secs(10);

/// Time in which the bootloader installs a program, with a reserve: three sectors are erased, two programs copied, in up
/// to 15 s.
const INSTALL: Duration = Duration::from_secs(60);

/// Time after which a program that works has confirmed itself: ten seconds, with a reserve.
const CONFIRMATION: Duration = Duration::from_secs(12);

/// Commands to object 0x1F51.
mod control {
    pub(super) const STOP: u8 = 0;
    pub(super) const START: u8 = 1;
    pub(super) const CLEAR: u8 = 3;
    pub(super) const CONFIRM: u8 = 0x80;
}

/// Image of a program.
pub struct Image {
    header: Header,
    bytes: Vec<u8>,
}

impl Image {
    /// Checks header and length of an image, which do not need the key.
    ///
    /// # Errors
    /// The reason why a foot would refuse it.
    pub fn new(bytes: Vec<u8>) -> Result<Self, Refusal> {
        let header = bytes.first_chunk::<HEADER>().ok_or(Refusal::NotAnImage)?;
        let header = Header::decode(header)?;
        if header.kind != Kind::Signed {
            return Err(Refusal::Unsigned);
        }
        if bytes.len() != HEADER + header.length as usize {
            return Err(Refusal::WrongLength);
        }
        Ok(Self { header, bytes })
    }
}

/// Program of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootProgram {
    /// Version; `None` while the bootloader runs.
    pub version: Option<String>,
    /// Value of object 0x1F56: the first bytes of the program's hash. For a program that was written with a probe, the
    /// first bytes of its commit, or 0.
    pub identification: u32,
}

/// Step of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpdateStage {
    /// The foot restarts into its bootloader.
    Stopping,
    /// The image is being sent.
    Sending {
        /// Part that has arrived, %.
        percent: u8,
    },
    /// The bootloader installs the program and starts it.
    Installing,
    /// The program of the image runs, and must confirm itself.
    Confirming,
}

/// Result of an update.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Updated {
    /// Name of the foot in messages.
    pub foot: String,
    /// Serial number of the foot.
    pub serial: u32,
    /// Program before.
    pub before: FootProgram,
    /// Program that runs now and is confirmed; `None` if the foot already ran it before, and the update only
    /// confirmed it.
    pub after: Option<FootProgram>,
}

/// Reason why a foot was not updated.
#[derive(Debug, Error)]
pub enum UpdateError {
    /// A request has failed.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// The program has no objects for updates.
    #[error("{0} has a program that cannot be updated: write foot.hex with a probe once")]
    NoBootloader(String),
    /// The foot has refused the image, and runs its program as before.
    #[error("{foot} has refused the image: {}; it continues with its program", why.words())]
    Refused {
        /// The foot.
        foot: String,
        /// Reason.
        why: Refusal,
    },
    /// The foot has refused the image, and no program of it has started since.
    #[error("{foot} has refused the image: {}; it waits in its bootloader for another", why.words())]
    RefusedWithoutProgram {
        /// The foot.
        foot: String,
        /// Reason.
        why: Refusal,
    },
    /// The foot did not reach the next step in time.
    #[error("{foot} has not started {what} within {} s{}", within.as_secs(), reason(*why))]
    NotStarted {
        /// The foot.
        foot: String,
        /// Program that was expected.
        what: &'static str,
        /// Time that was allowed.
        within: Duration,
        /// Reason that the foot reports.
        why: Option<Refusal>,
    },
    /// The new program has restarted before it had confirmed itself.
    #[error(
        "{0} has restarted within ten seconds of starting the new program, which is not confirmed; after three starts the previous program is restored"
    )]
    StartedAgain(String),
    /// The running program is not the one that was sent.
    #[error("{foot} runs program {found:08X} instead of {sent:08X}{}", reason(*why))]
    OtherProgram {
        /// The foot.
        foot: String,
        /// Value of object 0x1F56.
        found: u32,
        /// Value of this object for the image that was sent.
        sent: u32,
        /// Reason that the foot reports.
        why: Option<Refusal>,
    },
}

fn reason(why: Option<Refusal>) -> String {
    why.map_or_else(String::new, |why| format!(": {}", why.words()))
}

/// Foot between its installation and its confirmation.
struct Installed {
    /// Result of the update, once the program is confirmed.
    updated: Updated,
    /// Node id of the foot; `None` on a serial line.
    node: Option<NodeId>,
    /// Number of its starts until now.
    starts: u32,
}

impl Installed {
    fn new(client: &Client, updated: Updated) -> Self {
        Self { updated, node: client.node(), starts: client.starts() }
    }
}

/// Updates feet, one after the other: the nodes of a bus, or the one foot of a serial line. Then waits until all have
/// confirmed their programs. A foot that fails does not end the update of the others. `report` is called at each step.
pub fn update(
    client: &mut Client,
    feet: &[Option<NodeId>],
    image: &Image,
    report: &mut dyn FnMut(&str, UpdateStage),
) -> Vec<Result<Updated, UpdateError>> {
    let mut installed = Vec::new();
    for node in feet {
        if let Some(node) = node {
            client.follow(*node);
        }
        installed.push(install(client, image, report));
    }
    let clock = client.clock();
    let end = clock.now() + CONFIRMATION;
    let confirm = |foot: Result<Installed, UpdateError>| {
        let foot = foot?;
        report(&foot.updated.foot, UpdateStage::Confirming);
        client.wait(clock.until(end))?;
        confirm(client, foot, image)
    };
    installed.into_iter().map(confirm).collect()
}

/// Sends the image to the foot that the client follows, and starts the new program.
fn install(
    client: &mut Client,
    image: &Image,
    report: &mut dyn FnMut(&str, UpdateStage),
) -> Result<Installed, UpdateError> {
    let foot = client.foot();
    client.check_alone()?;
    let serial = client.serial_number()?;
    let runs = runs(client)?;
    let before = program(client, runs).map_err(|error| match error {
        error if error.is_refusal(AbortCode::NoObject) => UpdateError::NoBootloader(foot.clone()),
        error => error.into(),
    })?;
    if runs == Runs::Program && before.identification == image.header.identification() {
        let updated = Updated { foot, serial, before, after: None };
        return Ok(Installed::new(client, updated));
    }
    let state = match runs {
        Runs::Bootloader => NmtState::Operational,
        Runs::Program => client.state()?,
    };
    if runs == Runs::Program {
        report(&foot, UpdateStage::Stopping);
        client.command(NmtCommand::EnterPreOperational)?;
        if let Err(error) = control(client, control::STOP) {
            client.bring_to(state)?;
            return Err(error.into());
        }
        client.switch_to_bootloader(STOP)?;
        wait_for(client, serial, Runs::Bootloader, STOP)?;
    }
    let sent = send(client, &foot, image, &mut |step| report(&foot, step));
    if sent.is_err() {
        // The whole image may have arrived although the last response was lost, so it is erased.
        let _ = control(client, control::CLEAR);
    }
    // After a refusal, the start returns the foot to its previous program.
    let started = control(client, control::START);
    let why = sent.err();
    report(&foot, UpdateStage::Installing);
    match started {
        // The foot may restart although its response was lost.
        Ok(()) | Err(RequestError::NoAnswer { .. }) => {}
        Err(error) => return Err(why.unwrap_or_else(|| error.into())),
    }
    client.switch_to_program();
    let runs = wait_for(client, serial, Runs::Program, INSTALL);
    if let Some(why) = why {
        if runs.is_ok() {
            client.bring_to(state)?;
            return Err(why);
        }
        return Err(match why {
            UpdateError::Refused { foot, why } => UpdateError::RefusedWithoutProgram { foot, why },
            why => why,
        });
    }
    runs?;
    let after = program(client, Runs::Program)?;
    client.bring_to(state)?;
    is_sent(client, image, after.identification)?;
    let updated = Updated {
        // LSS may have given it another id.
        foot: client.node().map_or(foot, |_| client.foot()),
        serial,
        before,
        after: Some(after),
    };
    Ok(Installed::new(client, updated))
}

/// Clears the slot and sends the image, again if the transfer is disturbed.
fn send(
    client: &mut Client,
    foot: &str,
    image: &Image,
    report: &mut dyn FnMut(UpdateStage),
) -> Result<(), UpdateError> {
    let Some(node) = client.node() else {
        return Ok(());
    };
    let data = Address::new(index::PROGRAM_DATA, 1);
    let mut tries = TRIES;
    loop {
        control(client, control::CLEAR)?;
        let total = image.bytes.len();
        let mut sent = |bytes| {
            let percent = (bytes * 100 / total) as u8;
            report(UpdateStage::Sending { percent });
        };
        let failed = match download(client, node, data, &image.bytes, &mut sent) {
            Ok(()) => return Ok(()),
            Err(RequestError::Link(error)) => return Err(RequestError::Link(error).into()),
            Err(error) => error,
        };
        // A foot erases a refused image before it responds again.
        let clock = client.clock();
        let end = clock.now() + ERASE;
        let why = loop {
            match refusal(client) {
                Err(RequestError::NoAnswer { .. }) if clock.now() < end => {}
                answer => break answer?,
            }
        };
        if let Some(why) = why {
            let foot = foot.to_owned();
            return Err(UpdateError::Refused { foot, why });
        }
        tries -= 1;
        if tries == 0 {
            return Err(failed.into());
        }
    }
}

/// Checks that a foot still runs the new program, which has confirmed itself.
fn confirm(client: &mut Client, foot: Installed, image: &Image) -> Result<Updated, UpdateError> {
    if let Some(node) = foot.node {
        client.follow(node);
    }
    let found = identification(client)?;
    is_sent(client, image, found)?;
    if client.starts() != foot.starts {
        return Err(UpdateError::StartedAgain(foot.updated.foot));
    }
    // Asks the foot to confirm the program. The foot refuses if the program could not be confirmed. A program that
    // has already confirmed itself is not affected.
    control(client, control::CONFIRM)?;
    Ok(foot.updated)
}

fn is_sent(client: &mut Client, image: &Image, found: u32) -> Result<(), UpdateError> {
    let sent = image.header.identification();
    if found == sent {
        return Ok(());
    }
    Err(UpdateError::OtherProgram { foot: client.foot(), found, sent, why: refusal(client)? })
}

fn control(client: &mut Client, command: u8) -> Result<(), RequestError> {
    let address = Address::new(index::PROGRAM_CONTROL, 1);
    client.write_within(address, Value::U8(command), ERASE)
}

fn runs(client: &mut Client) -> Result<Runs, RequestError> {
    let name = client.read_text(Address::new(index::DEVICE_NAME, 0))?;
    Ok(match name.as_str() {
        BOOTLOADER => Runs::Bootloader,
        _ => Runs::Program,
    })
}

/// Reads the number of the running program.
fn identification(client: &mut Client) -> Result<u32, RequestError> {
    client.read_number(index::PROGRAM_ID, 1)
}

fn program(client: &mut Client, runs: Runs) -> Result<FootProgram, RequestError> {
    Ok(FootProgram {
        identification: identification(client)?,
        version: match runs {
            Runs::Bootloader => None,
            Runs::Program => Some(client.read_text(Address::new(index::SOFTWARE_VERSION, 0))?),
        },
    })
}

/// Programs in the flash of a foot that runs its program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Programs {
    /// Number of the running program; `None` if no commit has its sources.
    pub running: Option<u32>,
    /// Number of the program before the last update; `None` without one.
    pub previous: Option<u32>,
    /// Reason why the last image was refused, or why the previous program was restored.
    pub refused: Option<Refusal>,
}

/// Reads the numbers of a foot's programs; `None` where the foot lacks the object.
///
/// # Errors
/// There is no response.
pub fn programs(client: &mut Client) -> Result<Programs, RequestError> {
    let known = |result: Result<u32, RequestError>| match result {
        Ok(number) => Ok(Some(number).filter(|number| *number != 0)),
        Err(error) if error.is_refusal(AbortCode::NoObject) => Ok(None),
        Err(error) if error.is_refusal(AbortCode::NoSubindex) => Ok(None),
        Err(error) => Err(error),
    };
    Ok(Programs {
        running: known(identification(client))?,
        previous: known(client.read_number(index::PROGRAM_ID, 2))?,
        refused: known(client.read_number(index::FLASH_STATUS, 1))?
            .and_then(Refusal::from_flash_status),
    })
}

/// Reason why the last image was refused.
fn refusal(client: &mut Client) -> Result<Option<Refusal>, RequestError> {
    let status = client.read_number(index::FLASH_STATUS, 1)?;
    Ok(Refusal::from_flash_status(status))
}

samples::named! {
    /// Program that a foot can run.
    #[derive(Clone, Copy, PartialEq, Eq)]
    enum Runs {
        Bootloader = "its bootloader",
        Program = "a program",
    }
}

/// Polling interval for a start.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Waits until the foot with this serial number runs its bootloader or its program, under its id or another one.
fn wait_for(
    client: &mut Client,
    serial: u32,
    expected: Runs,
    within: Duration,
) -> Result<(), UpdateError> {
    let clock = client.clock();
    let end = clock.now() + within;
    while clock.now() < end {
        client.wait(POLL_INTERVAL)?;
        for node in client.take_booted() {
            client.follow_if_serial_matches(node, serial)?;
        }
        match runs(client) {
            Ok(runs) if runs == expected => return Ok(()),
            Ok(_) | Err(RequestError::NoAnswer { .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Err(UpdateError::NotStarted {
        foot: client.foot(),
        what: expected.name(),
        within,
        why: refusal(client).unwrap_or_default(),
    })
}
