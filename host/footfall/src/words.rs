//! Words of the command line: the options and commands that an error, a finding or a notice of a library names, as
//! `docs/design/errors.md` explains.

use std::fmt::Display;

use feet::FootHint;
use options::hint::{Hint, InWords, Setting, Vocabulary};

/// Options of the command line.
#[derive(Clone, Copy, Debug)]
pub struct CommandLine;

impl Vocabulary for CommandLine {
    fn name(&self, setting: Setting) -> String {
        format!("--{}", setting.name().replace(' ', "-"))
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        format!("{} {value}", self.name(setting))
    }

    fn remedy(&self, hint: &Hint) -> Option<String> {
        let convert = "for readers that refuse such a file, footfall convert writes a whole one";
        matches!(hint, Hint::WholeCopy).then(|| convert.to_owned())
    }
}

/// Returns the text of an error, a finding or a notice, with options in it.
pub fn in_words(what: &impl InWords) -> String {
    what.in_words(&CommandLine)
}

/// Returns an error or a notice of [`feet`] with its hint, in the options and commands of this program.
pub(crate) fn with_hint(message: impl Display, hint: Option<FootHint>) -> String {
    match hint {
        None => message.to_string(),
        Some(FootHint::NameOneFoot) => format!("{message}: name one with --node"),
        Some(FootHint::NameNodeAsFoot(node)) => format!("{message}: --node {node}"),
        Some(FootHint::ListObjects) => format!("{message}; `footfall foot SOURCE get` lists all"),
        Some(FootHint::SwitchSelfTestOff) => {
            format!("{message} until footfall foot … set self_test_at_start=0 --save")
        }
        Some(FootHint::OmitEstimateOptions) => format!(
            "{message}: --config, --topic, --load-topic, --axes, --units and similar options apply only to recordings of an IMU"
        ),
        // The command cannot be repeated, because a board in its loader has no port.
        Some(FootHint::MountDrive(label)) => format!(
            "{message}; where none appears: sudo mount /dev/disk/by-label/{label} /mnt, sudo cp the file to /mnt/, sudo umount /mnt"
        ),
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    use feet::usb::CopyError;

    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn missing_drive_error_names_the_commands_that_mount_it() {
        let error = CopyError::NoDrive {
            port: "/dev/ttyACM0".to_owned(),
            drive: "RPI-RP2",
            by_hand: "press the board's button twice",
        };
        assert_eq!(
            with_hint(&error, error.hint()),
            "no new drive RPI-RP2 is mounted 30 s after /dev/ttyACM0 was asked for it: press the board's button twice, and copy the file to the drive that appears; where none appears: sudo mount /dev/disk/by-label/RPI-RP2 /mnt, sudo cp the file to /mnt/, sudo umount /mnt"
        );
    }

    #[test]
    fn hint_names_the_option_with_its_value() {
        assert_eq!(in_words(&Hint::Units("g,dps".parse().unwrap())), "--units g,dps");
        assert_eq!(
            in_words(&Hint::ChooseTopic { topics: true, frames: true }),
            "choose with --topic and --frame, or --topic all"
        );
        assert_eq!(in_words(&Hint::SampleRate), "--sample-rate HZ");
    }

    #[test]
    fn hint_names_the_command_that_writes_a_whole_file() {
        assert_eq!(
            in_words(&Hint::WholeCopy),
            "for readers that refuse such a file, footfall convert writes a whole one"
        );
    }
}
