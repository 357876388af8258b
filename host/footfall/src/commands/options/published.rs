//! Frames of messages, and messages of other programs, for all commands that publish streaming feet.

#[cfg(any(feature = "bags", feature = "foxglove", feature = "ros2"))]
use crate::ros::Bridge;
use crate::ros::Compat;
use clap::Args;
use clap::builder::TypedValueParser;

use super::recording::name_parser;

/// Frames of messages, and messages of other programs.
#[derive(Clone, Debug, Args)]
pub struct PublishedArguments {
    /// Publish the decisions of all four feet in messages of other programs, too; several are separated
    /// by commas
    #[arg(long, value_name = "WHOSE,...", value_delimiter = ',', value_parser = compat_parser())]
    pub compat: Vec<Compat>,
    /// Frames of the messages; {foot} stands for the foot's name
    #[arg(long, value_name = "FRAME", default_value = crate::ros::topics::FRAME)]
    pub frame_id: String,
    /// Prefix of the frames of all messages, such as spot/
    #[arg(long, value_name = "PREFIX", default_value = "", hide_default_value = true)]
    pub frame_prefix: String,
}

#[cfg(any(feature = "bags", feature = "foxglove", feature = "ros2"))]
impl PublishedArguments {
    /// Pattern of the frames.
    pub(crate) fn frame(&self) -> String {
        format!("{}{}", self.frame_prefix, self.frame_id)
    }

    /// Returns the conversion to messages.
    pub(crate) fn bridge(&self) -> Bridge {
        Bridge::new(&self.frame(), &self.compat)
    }
}

/// Parser of a program's name; the help lists its message and topic.
pub(crate) fn compat_parser() -> impl TypedValueParser<Value = Compat> {
    name_parser(Compat::ALL, Compat::name, Compat::about)
}
