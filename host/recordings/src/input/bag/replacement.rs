//! Replacement of numbers in the messages of a topic, whose other bytes stay as they are.

use super::definition::{Definition, Path};
use super::storage::Channel;

/// Numbers in the messages of a channel.
#[derive(Clone, Debug)]
pub struct Replacement {
    definition: Definition,
    paths: Vec<Path>,
}

impl Replacement {
    /// Finds numbers by their names, such as `foot_force[0]`, in the definition of a channel.
    ///
    /// # Errors
    /// Half a sentence: there is no definition, or no such number in it.
    pub fn of(channel: &Channel, names: &[&str]) -> Result<Self, String> {
        let definition = Definition::of_channel(channel)?;
        let paths = names.iter().map(|name| definition.number(name));
        let paths = paths.collect::<Result<_, _>>()?;
        Ok(Self { definition, paths })
    }

    /// Returns a message, which is not compressed, with other values: one for each name, in its unit, rounded and limited to
    /// the type of the number.
    ///
    /// # Errors
    /// Half a sentence: the message is not of its definition.
    pub fn replaced(&self, message: &[u8], values: &[f64]) -> Result<Vec<u8>, String> {
        let paths: Vec<&Path> = self.paths.iter().collect();
        let places = self.definition.places(message, &paths)?;
        let mut message = message.to_vec();
        for (place, value) in places.into_iter().zip(values) {
            place
                .write(*value, &mut message)
                .ok_or_else(|| "its bytes end before a number".to_owned())?;
        }
        Ok(message)
    }
}
