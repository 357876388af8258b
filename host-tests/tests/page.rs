//! The page of a replay in a browser: its drawing, by its own report.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use config::default_params;
use estimator_core::{ContactEstimate, Decision, Load, Phase};
use footfall::plot::page::{self, PageFoot};
use gait::{Plan, SensorParams, simulate};
use host_tests::requirements::unmet;
use replay::events::{ContactEvent, EventKind, Events};
use samples::estimate::estimates_of;
use samples::{Label, Recording};
use stored::About;
use tempfile::TempDir;

const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// A name that would end the script if it were inserted into the page without escaping.
const NASTY: &str = "</script><script>document.body.dataset.errors = 'injected'</script><!--";

fn browser() -> Option<&'static str> {
    let runs = |name: &&str| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    };
    let found = BROWSERS.into_iter().find(runs);
    if found.is_none() {
        unmet(
            "there is no Chromium, so that no page was looked at; `cargo xtask install --full` installs it",
        );
    }
    found
}

/// Opens a page. Returns the output of the browser.
fn open(browser: &str, page: &Path, arguments: &[&OsStr]) -> String {
    let profile = TempDir::new().expect("a temporary directory");
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"])
        .args([
            "--force-device-scale-factor=1",
            "--virtual-time-budget=5000",
            "--enable-logging=stderr",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(arguments)
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("a browser that has said its version");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let console: Vec<_> = said.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert_eq!(console, [""; 0]);
    String::from_utf8(output.stdout).expect("UTF-8")
}

type Attributes = BTreeMap<String, String>;

/// The attributes of all tags with this attribute.
fn tags(document: &str, with: &str) -> Vec<Attributes> {
    let mut found = Vec::new();
    for tag in document.split('<').filter(|tag| tag.contains(&format!(" {with}=\""))) {
        let mut attributes = Attributes::new();
        let mut rest = tag;
        while let Some((before, after)) = rest.split_once("=\"") {
            let name = before.rsplit(' ').next().unwrap_or_default();
            let (value, after) = after.split_once('"').expect("a value in quotes");
            attributes.insert(name.to_owned(), value.to_owned());
            rest = after;
        }
        found.push(attributes);
    }
    found
}

fn number(attributes: &Attributes, name: &str) -> f64 {
    let value = attributes.get(name).unwrap_or_else(|| panic!("{name} in {attributes:?}"));
    value.parse().unwrap_or_else(|_| panic!("{name} is {value}"))
}

/// A foot with all data that a page shows.
struct Foot {
    name: String,
    recording: Recording,
    estimates: Vec<ContactEstimate>,
    events: Vec<ContactEvent>,
}

impl Foot {
    /// The demo's walk, of another foot for each seed; every third foot has no load signal and no labels.
    fn walks(name: &str, seed: u64) -> Self {
        let mut recording = simulate(&Plan::demo(seed), &SensorParams::LSM6DSOX, seed).recording;
        if seed.is_multiple_of(3) {
            for sample in &mut recording.samples {
                (sample.load, sample.label) = (None, None);
            }
        }
        let estimates = estimates_of(&recording, &default_params()).expect("the preset");
        let mut events = Events::default();
        estimates.iter().for_each(|estimate| events.add(estimate));
        let known: Vec<_> = std::iter::from_fn(|| events.pop()).collect();
        Self {
            name: name.to_owned(),
            events: known.into_iter().chain(events.finish()).collect(),
            recording,
            estimates,
        }
    }

    fn page(&self) -> PageFoot {
        let samples = &self.recording.samples;
        let recording = &self.recording;
        let about = About {
            samples: samples.len(),
            duration_us: (recording.duration_s() * 1.0e6) as u64,
            load_title: recording.load_title.clone(),
            ..About::new(self.name.clone(), recording.sample_rate, recording.gravity)
        };
        let start = samples[0].time_s();
        let mut page =
            PageFoot::new(&self.name, &about, start..start + self.recording.duration_s());
        for (sample, estimate) in samples.iter().zip(&self.estimates) {
            page.add(sample, estimate);
        }
        self.events.iter().for_each(|event| page.add_event(event));
        page
    }

    /// Number of ranges in which `is` holds.
    fn stretches(&self, is: impl Fn(usize) -> bool) -> f64 {
        let starts = (0..self.estimates.len()).filter(|k| is(*k) && (*k == 0 || !is(*k - 1)));
        starts.count() as f64
    }

    fn counts(&self, kind: EventKind) -> f64 {
        self.events.iter().filter(|event| event.kind == kind).count() as f64
    }

    fn loads(&self) -> Vec<f64> {
        let loads = self.recording.samples.iter().filter_map(|sample| sample.load);
        loads.map(|Load(load)| f64::from(load)).collect()
    }
}

/// Compares the report of a page about its drawing with the expected values.
fn assert_shows(document: &str, feet: &[Foot]) {
    let body = &tags(document, "data-ready")[0];
    assert_eq!(body["data-errors"], "0", "{body:?}");
    assert_eq!(number(body, "data-feet") as usize, feet.len());
    let panels = tags(document, "data-panel");
    assert_eq!(number(body, "data-panels") as usize, panels.len());
    let mut panels = panels.iter();
    for foot in feet {
        let loads = foot.loads();
        let kinds = ["load", "tangential", "vertical", "total"];
        for kind in kinds.into_iter().skip(usize::from(loads.is_empty())) {
            let panel = panels.next().expect("a panel");
            assert_eq!(panel["data-panel"], kind);
            assert_eq!(number(panel, "data-points") as usize, foot.estimates.len());
            let values = match kind {
                "load" => loads.clone(),
                _ => foot
                    .estimates
                    .iter()
                    .map(|e| {
                        let p = e.probabilities;
                        f64::from(match kind {
                            "tangential" => p.tangential,
                            "vertical" => p.vertical,
                            _ => p.stable,
                        })
                    })
                    .collect(),
            };
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            // Values have 10 000 levels.
            let tolerance = 1.0e-4 * (high - low).max(1.0);
            assert!((number(panel, "data-low") - low).abs() < tolerance, "{panel:?}");
            assert!((number(panel, "data-high") - high).abs() < tolerance, "{panel:?}");
            assert_states(panel, foot);
        }
        let tracks = panels.next().expect("a panel");
        assert_eq!(tracks["data-panel"], "tracks");
        assert_states(tracks, foot);
        let stable = foot.stretches(|k| foot.estimates[k].decision == Decision::Stable);
        assert_eq!(number(tracks, "data-decision"), stable);
        let labelled = foot.stretches(|k| foot.recording.samples[k].label == Some(Label::Stable));
        match foot.recording.samples[0].label {
            Some(_) => assert_eq!(number(tracks, "data-label"), labelled),
            None => assert!(!tracks.contains_key("data-label")),
        }
        assert_eq!(number(tracks, "data-touch_downs"), foot.counts(EventKind::TouchDown));
        assert_eq!(number(tracks, "data-lift_offs"), foot.counts(EventKind::LiftOff));
        assert_eq!(number(tracks, "data-slips"), foot.counts(EventKind::SlipStart));
    }
    assert!(panels.next().is_none());
}

fn assert_states(panel: &Attributes, foot: &Foot) {
    let shaded = [Phase::Swing, Phase::QuietSwing, Phase::Landing, Phase::Slip, Phase::Unknown];
    for phase in shaded {
        // Without a load the phase is always unknown, and nothing is shaded.
        let expected = if foot.loads().is_empty() {
            0.0
        } else {
            foot.stretches(|k| foot.estimates[k].phase == phase)
        };
        let name = format!("data-shaded_{}", phase.name());
        assert_eq!(number(panel, &name), expected, "{name} of {}", foot.name);
    }
}

/// Writes the page of some feet.
fn written(folder: &TempDir, feet: &[Foot]) -> PathBuf {
    let path = folder.path().join("out.html");
    let mut bytes = Vec::new();
    page::write(feet.iter().map(Foot::page).collect(), &mut bytes).expect("memory");
    fs::write(&path, bytes).expect("a temporary file");
    path
}

#[test]
fn a_page_draws_all_data_of_one_foot_and_of_four() {
    let Some(browser) = browser() else { return };
    let four = [("RL", 1), (NASTY, 2), ("no load", 3), ("FR", 4)];
    for names in [&four[..1], &four[..]] {
        let feet: Vec<_> = names.iter().map(|(name, seed)| Foot::walks(name, *seed)).collect();
        let folder = TempDir::new().expect("a temporary directory");
        let page = written(&folder, &feet);
        let window: &OsStr = "--window-size=1400,2600".as_ref();
        let document = open(browser, &page, &[window, "--dump-dom".as_ref()]);
        assert_shows(&document, &feet);
    }
}

/// Drags over half of the first chart, then double-clicks; records the visible range.
const MOUSE: &str = "<script>
setTimeout(() => {
  const note = (name) => {
    document.body.dataset[name + 'From'] = document.body.dataset.from;
    document.body.dataset[name + 'To'] = document.body.dataset.to;
    const panels = [...document.querySelectorAll('[data-panel=tracks]')];
    document.body.dataset[name + 'TouchDowns'] = panels.map((panel) => panel.dataset.touch_downs).join(' ');
  };
  const over = document.querySelector('.u-over');
  const box = over.getBoundingClientRect();
  const send = (target, type, share) => target.dispatchEvent(new MouseEvent(type, {
    bubbles: true, view: window, button: 0, clientX: box.left + share * box.width, clientY: box.top + 20, movementX: 1,
  }));
  send(over, 'mousemove', 0.25);
  send(over, 'mousedown', 0.25);
  send(over, 'mousemove', 0.75);
  send(document, 'mouseup', 0.75);
  setTimeout(() => {
    note('zoomed');
    document.body.dataset.readouts = [...document.querySelectorAll('.readout')].map((e) => e.textContent).join('|');
    send(over, 'dblclick', 0.5);
    setTimeout(() => note('whole'), 100);
  }, 300);
}, 300);
</script>";

#[test]
fn the_mouse_zooms_reads_out_and_restores_all_feet() {
    let Some(browser) = browser() else { return };
    let feet = [Foot::walks("RL", 1), Foot::walks("RR", 2)];
    let folder = TempDir::new().expect("a temporary directory");
    let page = written(&folder, &feet);
    let text = fs::read_to_string(&page).expect("the page");
    fs::write(&page, text.replace("</body>", &format!("{MOUSE}</body>"))).expect("a file");
    let document =
        open(browser, &page, &["--window-size=1400,1200".as_ref(), "--dump-dom".as_ref()]);
    let body = &tags(&document, "data-ready")[0];
    let end = number(body, "data-whole-to");
    let start = number(body, "data-whole-from");
    let (from, to) = (number(body, "data-zoomed-from"), number(body, "data-zoomed-to"));
    let width = end - start;
    assert!(
        (from - start - 0.25 * width).abs() < 0.02 && (to - start - 0.75 * width).abs() < 0.02,
        "{body:?}"
    );
    let in_sight = |foot: &Foot, from: f64, to: f64| {
        let times = foot.events.iter().filter(|event| event.kind == EventKind::TouchDown);
        let times = times.map(|event| event.time.as_micros() as f64 / 1.0e6);
        times.filter(|time| (from..to).contains(time)).count().to_string()
    };
    let counts =
        |from, to| feet.iter().map(|foot| in_sight(foot, from, to)).collect::<Vec<_>>().join(" ");
    assert_eq!(body["data-zoomed-touch-downs"], counts(from, to));
    assert_eq!(body["data-whole-touch-downs"], counts(start, end));
    assert_ne!(body["data-zoomed-touch-downs"], body["data-whole-touch-downs"]);
    let readouts: Vec<_> = body["data-readouts"].split('|').collect();
    assert_eq!(readouts.len(), 2);
    assert!(
        readouts.iter().all(|said| said.contains("P stable") && said.contains("decision: ")),
        "{readouts:?}"
    );
}
