//! Tests of the page as text; its appearance is tested in `host-tests`.

use super::*;
use estimator_core::{Gravity, ImuSample, Load, Probabilities, Timestamp};

/// Returns a foot with this many samples at 1 kHz, whose clock starts at `start_us`.
fn foot(name: &str, start_us: i64, samples: u64) -> PageFoot {
    let about = About {
        samples: samples as usize,
        duration_us: (samples - 1) * 1000,
        load_title: format!("force of {name} (N)"),
        start_us,
        ..About::new(name.to_owned(), 1000.0, Gravity::Included)
    };
    let mut foot = PageFoot::new(name, &about, 0.0..about.duration_s());
    for k in 0..samples {
        let sample = RecordedSample {
            imu: ImuSample { timestamp: Timestamp::from_micros(k * 1000), ..ImuSample::default() },
            load: (k % 100 != 50).then_some(Load((k * 7919 % 1000) as f32)),
            label: Some(if k % 2 == 0 { Label::Stable } else { Label::NotStable }),
        };
        let p = (k * 104_729 % 1009) as f32 / 1008.0;
        let estimate = ContactEstimate {
            timestamp: sample.imu.timestamp,
            phase: Phase::ALL[k as usize % Phase::ALL.len()],
            decision: DECISIONS[k as usize % 2],
            probabilities: Probabilities {
                stable: p,
                tangential: p,
                vertical: p,
                ..Probabilities::default()
            },
            ..ContactEstimate::default()
        };
        foot.add(&sample, &estimate);
    }
    foot
}

fn written(feet: Vec<PageFoot>) -> String {
    let mut bytes = Vec::new();
    write(feet, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The JSON in a page.
fn data_of(page: &str) -> serde_json::Value {
    let start = page.split_once("id=\"data\">").unwrap().1;
    serde_json::from_str(start.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn names_cannot_end_the_script_or_open_a_tag() {
    let names = ["</script><script>alert(1)</script>", "<!--<script>", "a & b > \"c\" \\ \u{2028}"];
    let page = written(names.map(|name| foot(name, 0, 10)).into());
    let empty = written(vec![foot("a", 0, 10)]);
    for tag in ["<script", "</script", "<!--", "<title", "</title"] {
        assert_eq!(page.matches(tag).count(), empty.matches(tag).count(), "{tag}");
    }
    let data = data_of(&page);
    for (k, name) in names.into_iter().enumerate() {
        assert_eq!(data["feet"][k]["name"], name);
        assert_eq!(data["feet"][k]["lines"][0]["name"], format!("force of {name} (N)"));
    }
}

#[test]
fn page_loads_no_external_resource() {
    let page = written(vec![foot("a", 0, 10)]);
    assert!(page.contains("default-src 'none'"));
    for fetch in
        [" src=", " href=", "url(", "@import", "fetch(", "XMLHttpRequest", "WebSocket", "import("]
    {
        assert!(!page.contains(fetch), "{fetch}");
    }
    // The one address is that of uPlot's home, in a comment.
    let addresses: Vec<_> = page.match_indices("://").collect();
    assert_eq!(addresses.len(), 1);
    assert!(page.contains("/*! https://github.com/leeoniya/uPlot (v1.6.32) */"));
    assert!(page.contains("Copyright (c) 2022 Leon Sorokin"));
}

#[test]
fn page_stays_below_4_mb_per_foot() {
    let page = written(vec![foot("busy", 0, 400_000)]);
    assert!(page.len() < 4_000_000, "{} bytes", page.len());
    let line = &data_of(&page)["feet"][0]["lines"][3];
    let points = line["v"].as_array().unwrap();
    assert!(points.len() > 60_000, "{}", points.len());
    let levels = points.iter().filter_map(serde_json::Value::as_i64);
    assert_eq!((levels.clone().min(), levels.max()), (Some(0), Some(10_000)));
}

#[test]
fn line_keeps_values_and_gaps_of_the_recording() {
    let data = data_of(&written(vec![foot("a", 0, 200)]));
    let load = &data["feet"][0]["lines"][0];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let (low, high) = (number(&load["low"]), number(&load["high"]));
    let mut time = 0;
    let mut values = Vec::new();
    for (step, level) in load["t"].as_array().unwrap().iter().zip(load["v"].as_array().unwrap()) {
        time += step.as_i64().unwrap();
        match level.as_f64() {
            Some(level) => {
                values.push((time, low + level * (high - low) / number(&load["levels"])));
            }
            None => assert!(time % 100_000 == 49_000, "{time}"),
        }
    }
    assert_eq!(values.len(), 198);
    for (time, value) in values {
        let expected = (time / 1000 * 7919 % 1000) as f64;
        assert!((value - expected).abs() < 0.1, "{time}: {value}");
    }
}

#[test]
fn feet_with_overlapping_times_share_an_axis() {
    let day = 86_400_000_000;
    let feet = [("a", day), ("b", 5), ("c", day + 50_000), ("d", 120_000)];
    let data = data_of(&written(feet.map(|(name, start)| foot(name, start, 100)).into()));
    let groups = [0, 1, 2, 3].map(|k| data["feet"][k]["group"].clone());
    assert_eq!(groups, [0, 1, 0, 2]);
    assert_eq!(data["groups"][0]["title"], "time (s) since t = 86400 s");
    assert_eq!(data["groups"][0]["from"], 0.0);
    assert_eq!(data["groups"][0]["to"], 0.149);
    assert_eq!(data["feet"][2]["shift"], 0.05);
    assert_eq!(data["groups"][1]["title"], "time (s) since t = 0.000005 s");
}

#[test]
fn excess_events_are_counted() {
    let mut busy = foot("busy", 0, 100);
    for k in 0..MOST_EVENTS as u64 + 7 {
        busy.add_event(&ContactEvent {
            time: Timestamp::from_micros(k),
            kind: EventKind::ALL[k as usize % 4],
            duration_us: Some(1),
            peak: 1.0,
            distance_m: None,
        });
    }
    let foot = &data_of(&written(vec![busy]))["feet"][0];
    assert_eq!(foot["left_out"], 7);
    assert_eq!(foot["events"].as_array().unwrap().len(), MOST_EVENTS);
    assert_eq!(foot["events"][1], serde_json::json!([1, 1, 1, null]));
    assert_eq!(foot["counts"]["touch_down"], 5002);
}
