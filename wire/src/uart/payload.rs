//! Contents of a frame: a message, or by itself a kind that is sent often. A message is
//! as large as its largest kind, and moving it costs more than writing most of them.

use super::{ConfigResponse, ContactMessage, HealthMessage, Kind, LogMessage, RawSample};
use crate::bytes::Writer;

/// The contents of a frame.
pub trait Payload {
    /// Type of the message.
    fn kind(&self) -> Kind;

    /// Writes the payload.
    fn write(&self, writer: &mut Writer<'_>);
}

macro_rules! payload {
    ($($message:ident is $kind:ident),*) => {$(
        impl Payload for $message {
            fn kind(&self) -> Kind {
                Kind::$kind
            }

            fn write(&self, writer: &mut Writer<'_>) {
                self.write(writer);
            }
        }
    )*};
}

payload!(
    ContactMessage is Contact,
    RawSample is Raw,
    HealthMessage is Health,
    ConfigResponse is ConfigResponse,
    LogMessage is Log
);
