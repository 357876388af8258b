//! Definitions of message types from an installation of ROS 2, if there is one.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::PathBuf;

use bags::Schema;

/// Largest number of types in the definition of one.
const MOST_TYPES: usize = 256;

/// Returns the definition of a type such as `my_msgs/msg/FootForces` and of all types in it, as bags have it. `None` if no
/// prefix in `AMENT_PREFIX_PATH` has it.
pub fn installed(message: &str) -> Option<Schema> {
    let prefixes: Vec<PathBuf> = env::split_paths(&env::var_os("AMENT_PREFIX_PATH")?).collect();
    definition(message, &|name| {
        let (package, message) = (name.split('/').next()?, name.rsplit('/').next()?);
        let file = format!("share/{package}/msg/{message}.msg");
        prefixes.iter().find_map(|prefix| fs::read_to_string(prefix.join(&file)).ok())
    })
}

/// Concatenates the definition of a type with the definitions of the types in it.
fn definition(message: &str, text_of: &dyn Fn(&str) -> Option<String>) -> Option<Schema> {
    let mut text = text_of(message)?;
    let mut known = BTreeSet::from([bare(message)]);
    let mut open = vec![(bare(message), text.clone())];
    while let Some((name, own)) = open.pop() {
        let package = name.split('/').next().unwrap_or_default();
        for part in types_in(&own, package) {
            if known.len() >= MOST_TYPES || !known.insert(part.clone()) {
                continue;
            }
            // A type without a definition here is left out, because the reader may know it.
            if let Some(own) = text_of(&part) {
                text += &format!("\n{}\nMSG: {part}\n{own}", "=".repeat(80));
                open.push((part, own));
            }
        }
    }
    Some(Schema { encoding: "ros2msg".to_owned(), text: text.into_bytes() })
}

/// Name of a type without `msg`: `std_msgs/Header`.
fn bare(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

/// Names of the types of fields that are messages themselves.
fn types_in(text: &str, package: &str) -> Vec<String> {
    let types = text.lines().filter_map(|line| {
        let line = line.split('#').next().unwrap_or_default();
        let name = line.split_whitespace().next()?;
        let name = name.split(['[', '<']).next()?;
        // Names of primitive types are in lower case.
        let own = name.rsplit('/').next()?;
        let is_message = own.starts_with(|c: char| c.is_ascii_uppercase());
        is_message.then(|| match (name, name.contains('/')) {
            ("Header", _) => "std_msgs/Header".to_owned(),
            (_, true) => bare(name),
            (_, false) => format!("{package}/{name}"),
        })
    });
    types.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definition_has_all_types_in_it_once() {
        let text_of = |name: &str| {
            let text = match name {
                "a_msgs/msg/Feet" => {
                    "std_msgs/Header header\nFoot[4] feet # all\nb_msgs/msg/Force sum\nfloat64 x"
                }
                "a_msgs/Foot" => "b_msgs/Force[<=2] force\nint8 UP=1\nstring<=5 name",
                "b_msgs/Force" => "float64 z",
                _ => return None,
            };
            Some(text.to_owned())
        };
        let schema = definition("a_msgs/msg/Feet", &text_of).expect("a definition");
        let text = String::from_utf8(schema.text).expect("text");
        let names: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
        assert_eq!(names, ["a_msgs/Foot", "b_msgs/Force"]);
        assert_eq!(definition("c_msgs/msg/Other", &text_of), None);
    }
}
