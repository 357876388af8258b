//! Short names of feet, from the names of their topics.

/// The distinct parts of several topics: `fl` and `fr` for `/imu/fl` and `/imu/fr`, `fl_foot` and `fr_foot` for
/// `/fl_foot/imu` and `/fr_foot/imu`.
pub(super) fn names(topics: &[String]) -> Vec<String> {
    let whole: Vec<&str> = topics.iter().map(|topic| topic.trim_matches('/')).collect();
    let start = common(&whole, common_start);
    let end = common(&whole, common_end);
    let short = whole.iter().map(|topic| {
        let end = topic.len() - end;
        topic
            .get(word_start(topic, start)..word_end(topic, end))
            .unwrap_or_default()
    });
    let short: Vec<&str> = short.collect();
    let tell_apart = |name: &&str| !name.is_empty();
    let chosen = if short.iter().all(tell_apart) {
        short
    } else {
        whole
    };
    chosen.into_iter().map(str::to_owned).collect()
}

/// Number of bytes that all names have in common.
fn common(names: &[&str], of_two: impl Fn(&str, &str) -> usize) -> usize {
    let Some((first, others)) = names.split_first() else {
        return 0;
    };
    others
        .iter()
        .map(|other| of_two(first, other))
        .min()
        .unwrap_or_default()
}

fn common_start(a: &str, b: &str) -> usize {
    a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count()
}

fn common_end(a: &str, b: &str) -> usize {
    let pairs = a.bytes().rev().zip(b.bytes().rev());
    pairs.take_while(|(a, b)| a == b).count()
}

/// Start of the part of a topic that contains the byte `at`.
fn word_start(topic: &str, at: usize) -> usize {
    topic.as_bytes()[..at.min(topic.len())]
        .iter()
        .rposition(|byte| *byte == b'/')
        .map_or(0, |slash| slash + 1)
}

/// End of the part of a topic that contains the byte before `at`.
fn word_end(topic: &str, at: usize) -> usize {
    let rest = topic.as_bytes().get(at..).unwrap_or_default();
    rest.iter()
        .position(|byte| *byte == b'/')
        .map_or(topic.len(), |slash| at + slash)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(topics: &[&str]) -> Vec<String> {
        names(
            &topics
                .iter()
                .map(|topic| (*topic).to_owned())
                .collect::<Vec<_>>(),
        )
    }

    #[test]
    fn foot_is_named_by_the_distinct_part_of_its_topic() {
        for (topics, feet) in [
            (["/imu/fl", "/imu/fr"], ["fl", "fr"]),
            (["/fl_foot/imu", "/fr_foot/imu"], ["fl_foot", "fr_foot"]),
            (["/leg_1/imu/data", "/leg_2/imu/data"], ["leg_1", "leg_2"]),
            (["/imu_left", "/imu_right"], ["imu_left", "imu_right"]),
            (["/robot/1/imu", "/robot/12/imu"], ["1", "12"]),
            (["/a/left/imu", "/b/right/imu"], ["a/left", "b/right"]),
            (["/imu", "/imu/raw"], ["imu", "imu/raw"]),
            (["/x/fl/imu", "/x/fl/imu2"], ["imu", "imu2"]),
        ] {
            assert_eq!(named(&topics), feet, "{topics:?}");
        }
    }
}
