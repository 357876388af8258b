//! Names of feet whose topics differ, for bags.

use crate::ros::FootTopics;

/// Returns a foot name whose topics differ from those of these names.
#[must_use]
pub fn unlike(name: &str, taken: &[impl AsRef<str>]) -> String {
    let is_free = |name: &String| {
        let topics = FootTopics::of(name);
        let mut taken = taken.iter();
        taken.all(|other| FootTopics::of(other.as_ref()) != topics)
    };
    let numbered = (2..).map(|number: u32| format!("{name}_{number}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    names.find(is_free).unwrap_or_else(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_the_same_topics_are_numbered() {
        let mut names: Vec<String> = Vec::new();
        for name in ["front left", "front_left", "左前", "右前", "fl"] {
            names.push(unlike(name, &names));
        }
        assert_eq!(names, ["front left", "front_left_2", "左前", "右前_2", "fl"]);
    }
}
