//! Frames of messages, and messages of other programs, for all commands that publish streaming feet.

use clap::{Args, ValueEnum};
use ros::{Bridge, Compat};

/// Frames of messages, and messages of other programs.
#[derive(Clone, Debug, Args)]
pub struct PublishedArguments {
    /// Publish the decisions of all four feet in messages of other programs, too; several are separated
    /// by commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',')]
    pub compat: Vec<CompatOption>,
    /// Frames of the messages; {foot} stands for the foot's name
    #[arg(long, value_name = "FRAME", default_value = ros::topics::FRAME)]
    pub frame_id: String,
    /// Before the frames of all messages, such as spot/
    #[arg(
        long,
        value_name = "PREFIX",
        default_value = "",
        hide_default_value = true
    )]
    pub frame_prefix: String,
}

impl PublishedArguments {
    /// Pattern of the frames.
    pub(super) fn frame(&self) -> String {
        format!("{}{}", self.frame_prefix, self.frame_id)
    }

    /// Programs whose messages are published.
    pub(super) fn compats(&self) -> Vec<Compat> {
        let compats = self.compat.iter();
        compats.map(|compat| compat.compat()).collect()
    }

    /// Returns the conversion to messages.
    pub(super) fn bridge(&self) -> Bridge {
        Bridge::new(&self.frame()).with_compat(&self.compats())
    }
}

/// Whose messages are published besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CompatOption {
    /// `pronto_msgs/msg/QuadrupedStance` on /footfall/stance
    Pronto,
    /// `champ_msgs/msg/ContactsStamped` on `/foot_contacts`
    Champ,
    /// `inekf_msgs/msg/ContactArray` on /contact
    Inekf,
    /// `custom_sensor_msgs/msg/ContactArray` on /footfall/drift/contacts
    Drift,
    /// `state_estimator_msgs/msg/ContactDetection` on `/footfall/contact_detection`
    Muse,
    /// `std_msgs/msg/Bool` on /footfall/FL/contact/decision and those of the other feet
    Bool,
    /// `unitree_go/msg/LowState` on /footfall/lowstate, whose forces are 100 or 0
    Unitree,
}

impl CompatOption {
    const fn compat(self) -> Compat {
        match self {
            Self::Pronto => Compat::Pronto,
            Self::Champ => Compat::Champ,
            Self::Inekf => Compat::Inekf,
            Self::Drift => Compat::Drift,
            Self::Muse => Compat::Muse,
            Self::Bool => Compat::Bool,
            Self::Unitree => Compat::Unitree,
        }
    }
}
