//! Tables and sentences of the documents that show results: headings, columns and formats of numbers. Each function
//! renders one block.

use anyhow::{Context, Result, bail};
use wire::board::EDGE_TO_MAILBOX_US;
use wire::settings::longest_frame;

use crate::{Figures, Stored, file};

/// A generated block of a document.
#[derive(Debug)]
pub struct Block {
    /// The document, relative to the root.
    pub page: &'static str,
    /// Name of the block.
    pub name: &'static str,
    /// Text between its lines.
    pub text: String,
}

/// A block: its document, its name, the result that it shows, and its content.
type Template = (&'static str, &'static str, &'static str, fn(&Stored) -> Result<String>);

const README: &str = "README.md";
const EVALUATION: &str = "docs/reference/evaluation.md";
const LIMITS: &str = "docs/guide/limits.md";
const FIRST_RECORDING: &str = "docs/start/first-recording.md";
const BENCH: &str = "docs/reference/robots-nobody-tuned-on.md";
const BOARD: &str = "laboratory/virtual-board/README.md";
const FAULTS: &str = "laboratory/virtual-board/faults.md";

const TEMPLATES: &[Template] = &[
    (README, "in-short", "delays", in_short),
    (README, "meaning", "reliability", meaning),
    (README, "false-slips", "false-slips", false_slips_in_short),
    (README, "evaluate", "methods", methods_in_short),
    (README, "without-robot", "without-robot", without_robot_in_short),
    (FIRST_RECORDING, "meaning", "reliability", meaning),
    (LIMITS, "meaning", "reliability", meaning),
    (LIMITS, "false-slips", "false-slips", false_slips_in_short),
    ("wire/README.md", "meaning", "reliability", meaning),
    (EVALUATION, "evaluate", "methods", methods),
    (EVALUATION, "without-robot", "without-robot", without_robot),
    (EVALUATION, "delays", "delays", delays),
    (EVALUATION, "reliability", "reliability", reliability),
    (EVALUATION, "sets", "rmse-by-set", rmse_by_set),
    (EVALUATION, "rates", "rmse-by-rate", rmse_by_rate),
    (EVALUATION, "false-slips", "false-slips", false_slips),
    (EVALUATION, "odometry", "odometry", odometry),
    (EVALUATION, "attitude", "attitude", attitude),
    (EVALUATION, "attitude-peers", "attitude-peers", attitude_peers),
    (EVALUATION, "instructions", "instructions", instructions),
    (BENCH, "robots", "bench", bench_robots),
    (BENCH, "methods", "bench", bench_methods),
    (BENCH, "delays", "bench", bench_delays),
    (BENCH, "slips", "bench", bench_slips),
    (BENCH, "reliability", "bench", bench_reliability),
    (BENCH, "velocity", "bench-velocity", bench_velocity),
    (BOARD, "updates", "updates", updates),
    (BOARD, "updates-others", "updates-others", updates_others),
    (BOARD, "update-corners", "update-corners", update_corners),
    (BOARD, "recordings", "recordings", recordings),
    (BOARD, "hour", "hour", hour),
    (BOARD, "latency", "hour", latency),
    (BOARD, "budgets", "budgets", budgets),
    (BOARD, "full-load", "full-load", budgets),
    (FAULTS, "faults", "faults", faults),
    (FAULTS, "corners", "corners", corners),
    (FAULTS, "pairs", "pairs", pairs),
    ("wire/README.md", "latency", "hour", latency_to_the_robot),
    ("docs/guide/wiring.md", "profiles", "bus-profiles", bus_profiles),
    ("docs/guide/your-own-board.md", "processors", "processors", processors),
    ("laboratory/nano/README.md", "nano", "nano", nano),
    ("python/README.md", "throughput", "throughput", throughput),
    ("docs/guide/fleet.md", "fleet", "fleet", fleet),
    ("docs/guide/own-imus.md", "live", "live", live),
    ("CONTRIBUTING.md", "gate", "gate", gate),
];

/// Renders all blocks.
///
/// # Errors
/// A result is missing or lacks a figure.
pub fn blocks() -> Result<Vec<Block>> {
    let blocks = TEMPLATES.iter().map(|&(page, name, result, render)| {
        let result = Stored::read(result)?;
        let mut text = render(&result)?;
        // Sentences and the first screen do not name the commit. They link to the evaluation, which does.
        if page != README && !matches!((page, name), (_, "meaning") | (LIMITS, "false-slips")) {
            // A line after a table needs a blank line before it. Otherwise it would be a row.
            text += &format!("\n{}\n", origin(&result, page)?);
        }
        Ok(Block { page, name, text })
    });
    blocks.collect()
}

/// Sentence that names file, commit and programs of a result, on a page relative to the root.
///
/// # Errors
/// The result has no commit or no date.
pub fn origin(result: &Stored, page: &str) -> Result<String> {
    let up = "../".repeat(page.matches('/').count());
    let file = file(&result.name);
    let mut text = format!(
        "[`{file}`]({up}{file}): {}, commit {}",
        result.text("date")?,
        result.text("commit")?
    );
    for (program, digest) in result.elf() {
        text += &format!(", `{program}` {digest}");
    }
    if let Ok(machine) = result.text("machine") {
        text += &format!(", on {machine}");
    }
    Ok(text + ".")
}

/// A Markdown table.
struct Table(String);

impl Table {
    fn new(headings: &[&str]) -> Self {
        let rule = "---|".repeat(headings.len());
        Self(format!("| {} |\n|{rule}\n", headings.join(" | ")))
    }

    fn row<T: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = T>) {
        let cells: Vec<T> = cells.into_iter().collect();
        let cells: Vec<&str> = cells.iter().map(AsRef::as_ref).collect();
        self.0 += &format!("| {} |\n", cells.join(" | "));
    }
}

/// Formats a figure with `decimals` decimals, or as a dash if the key is missing.
fn fixed(figures: &Figures, key: &str, decimals: usize) -> Result<String> {
    let number = figures.optional(key)?;
    Ok(number.map_or_else(|| "–".to_owned(), |number| format!("{number:.decimals$}")))
}

/// A count.
fn count(figures: &Figures, key: &str) -> Result<String> {
    fixed(figures, key, 0)
}

/// A count with commas between its thousands.
fn grouped(figures: &Figures, key: &str) -> Result<String> {
    let digits = count(figures, key)?;
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    Ok(text)
}

/// Breaks a text into lines of at most 120 columns.
fn filled(text: &str) -> String {
    const WIDTH: usize = 120;
    let mut lines = String::new();
    let mut columns = 0;
    for word in text.split(' ') {
        let length = word.chars().count();
        if columns > 0 && columns + 1 + length > WIDTH {
            lines.push('\n');
            columns = 0;
        } else if columns > 0 {
            lines.push(' ');
            columns += 1;
        }
        lines += word;
        columns += length;
    }
    lines + "\n"
}

/// A method in the README's table, and its name in each result; none if a result has no such row.
struct InShort {
    name: &'static str,
    means: Option<&'static str>,
    pools: &'static str,
    bench: Option<&'static str>,
}

const IN_SHORT: &[InShort] = &[
    InShort {
        name: "footfall, default preset",
        means: Some("footfall, default preset"),
        pools: "default",
        bench: Some(OURS),
    },
    InShort {
        name: "footfall, paper preset",
        means: Some("footfall, paper preset"),
        pools: "paper",
        bench: None,
    },
    InShort {
        name: "SHOE / GLRT, as published",
        means: Some("SHOE / GLRT, as published"),
        pools: "SHOE",
        bench: Some("SHOE, as published"),
    },
    InShort {
        name: "hidden Markov model of the amplitude",
        means: Some("hidden Markov model of the amplitude"),
        pools: "hidden Markov model",
        bench: Some("hidden Markov model"),
    },
    InShort {
        name: "force Schmitt trigger 10/5 %",
        means: None,
        pools: "force trigger",
        bench: Some("force threshold"),
    },
];

/// Errors and delays of the methods, on recordings and on the bench.
fn methods_in_short(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "method",
        "RMSE",
        "ROC-AUC",
        "false stable",
        "real robots",
        "ATLAS",
        "LCD",
        "bench",
        "delay, real robots",
        "delay, bench",
    ]);
    let none = || "–".to_owned();
    let (pools, without, of_delays, bench) = (
        Stored::read("rmse-by-set")?,
        Stored::read("without-robot")?,
        Stored::read("delays")?,
        Stored::read("bench")?,
    );
    let pooled = |set, column| -> Result<String> {
        fixed(&named(&pools, "set", set)?.figures("rmse")?, column, 3)
    };
    let ms = |row: &Figures| -> Result<String> { Ok(count(row, "decision_ms")? + " ms") };
    for &InShort { name, means, pools, bench: on_bench } in IN_SHORT {
        let mut cells = vec![name.to_owned()];
        if let Some(means) = means {
            let row = named(result, "method", means)?;
            for key in ["rmse", "roc_auc", "false_stable", "robots_rmse"] {
                cells.push(fixed(&row, key, 3)?);
            }
        } else {
            // Only ATLAS, LCD and the bench have a force.
            cells.extend([none(), none(), none(), none()]);
        }
        cells.extend([pooled("ATLAS pooled", pools)?, pooled("LCD pooled", pools)?]);
        let ours = on_bench == Some(OURS);
        let (error, late) = match on_bench {
            Some(method) => {
                let rows = of_bench(&bench, method, "all")?;
                let trots = rows.iter().find(|row| {
                    row.text("motion").is_ok_and(|motion| motion == "trots")
                        && row.number("rate_hz").is_ok_and(|rate_hz| rate_hz == KILOHERTZ)
                });
                let trots = trots.context("no trots on the bench")?;
                // The median over the few stances that a method finds would say nothing about the others.
                let finds_most = 2.0 * trots.number("lost")? < trots.number("stances")?;
                (mean_on_bench(&rows)?, if finds_most { ms(trots)? } else { none() })
            }
            None => (none(), none()),
        };
        let real = if ours { ms(&named(&of_delays, "set", "real robots")?)? } else { none() };
        cells.extend([error, real, late]);
        table.row(cells);
        if ours {
            let of = without.values();
            let mut cells = vec!["the same, constants chosen without the robot".to_owned()];
            for key in ["rmse", "roc_auc", "false_stable", "robots_rmse", "atlas_rmse", "lcd_rmse"]
            {
                cells.push(fixed(&of, key, 3)?);
            }
            cells.extend([none(), none(), none()]);
            table.row(cells);
        }
    }
    Ok(table.0)
}

/// How good the estimator is on real robots, in two sentences.
fn in_short(result: &Stored) -> Result<String> {
    let of = named(result, "set", "real robots")?;
    let mut medians = Vec::new();
    for set in ["TALOS", "real NAO", "GO1", "pushed NAO"] {
        medians.push(named(result, "set", set)?.number("decision_ms")?);
    }
    let methods = Stored::read("methods")?;
    let default = named(&methods, "method", "footfall, default preset")?;
    let without = Stored::read("without-robot")?;
    Ok(filled(&format!(
        "**How good:** on recordings of three real robots, footfall missed {} of {} stances. Its decision, a \
         debounced yes or no, came {} ms after touch-down (median; within {} ms in nine of ten stances). The \
         medians of the single sets are {} to {} ms. The RMSE of its probability was {}, whereas an answer of \
         always ½ would have 0.5. These recordings also served to choose footfall's constants. When the constants \
         were chosen again on the other robots only, leaving out the one being scored, the RMSE was {}. On seven \
         other sets, of simulated feet and a walking person, {} of the samples labelled not stable were called \
         stable on average ({} with constants chosen without the robot). \
         [Compare methods and robots](#how-good-it-is).",
        count(&of, "lost_decisions")?,
        count(&of, "stances")?,
        count(&of, "decision_ms")?,
        count(&of, "decision_90_ms")?,
        medians.iter().copied().fold(f64::INFINITY, f64::min),
        medians.iter().copied().fold(0.0, f64::max),
        fixed(&default, "robots_rmse", 2)?,
        fixed(&without.values(), "robots_rmse", 2)?,
        percent(Some(default.number("false_stable")?)),
        percent(without.values().optional("false_stable")?),
    )))
}

/// The row of a result whose text under `key` is `name`.
fn named<'a>(result: &'a Stored, key: &str, name: &str) -> Result<Figures<'a>> {
    let mut rows = result.rows().into_iter();
    let row = rows.find(|row| row.text(key).is_ok_and(|text| text == name));
    row.with_context(|| format!("{}: no row whose {key} is {name}", result.name))
}

/// RMSE of a method on the bench at 1 kHz: the mean over all sets, each with the same weight.
fn mean_on_bench(rows: &[Figures]) -> Result<String> {
    let (mut sum, mut sets) = (0.0, 0.0);
    for row in rows {
        if row.number("rate_hz")? == KILOHERTZ {
            sum += row.number("sets")? * row.number("rmse")?;
            sets += row.number("sets")?;
        }
    }
    Ok(format!("{:.3}", sum / sets))
}

/// A share as a percentage; a dash if there is none.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}

/// Meaning of P, in the same words on each page that explains it.
fn meaning(result: &Stored) -> Result<String> {
    const RANGE: usize = 6;
    let of = |sets: &str| -> Result<String> {
        let rows = result.rows();
        let row = rows.iter().find(|row| row.text("sets").is_ok_and(|name| name == sets));
        let row = row.with_context(|| format!("no reliability of {sets}"))?;
        Ok(percent(row.numbers("stable")?[RANGE]))
    };
    Ok(filled(&format!(
        "**P** says how sure the estimator is that the foot stands, which means that the foot moves as little as it usually \
         does in a stance. On one robot a higher P mostly means a more certain stance, but P is not a calibrated \
         probability: where P was between 0.6 and 0.7, the foot was labelled stable for {} of the time on a simulated \
         ATLAS, {} on another group's simulated humanoids (LCD), and {} on real robots. So compare P with ½, but do not \
         read 0.7 as 70 % of stances.",
        of("ATLAS")?,
        of("LCD")?,
        of("real robots")?,
    )))
}

/// Slips that are reported although there are none.
fn false_slips_in_short(result: &Stored) -> Result<String> {
    let cases: Result<Vec<String>> = result
        .rows()
        .iter()
        .map(|row| {
            let name = match row.text("set")? {
                "shoe" => "a walking person",
                "real NAO" => "a NAO",
                "GO1" => "a GO1",
                name => name,
            };
            Ok(format!("{} in {} s of {name}", count(row, "slips")?, count(row, "duration_s")?))
        })
        .collect();
    Ok(filled(&format!(
        "Some reported slips are false. On real floors without known slips, these were reported: {}.",
        cases?.join(", ")
    )))
}

fn methods(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "method",
        "RMSE",
        "ROC-AUC",
        "calibration error",
        "F1",
        "false stable",
        "robots' RMSE",
        "robots' ROC-AUC",
    ]);
    for row in result.rows() {
        table.row([
            row.text("method")?.to_owned(),
            fixed(&row, "rmse", 4)?,
            fixed(&row, "roc_auc", 3)?,
            fixed(&row, "calibration_error", 3)?,
            fixed(&row, "f1", 3)?,
            fixed(&row, "false_stable", 3)?,
            fixed(&row, "robots_rmse", 4)?,
            fixed(&row, "robots_roc_auc", 3)?,
        ]);
    }
    Ok(table.0)
}

fn without_robot_in_short(result: &Stored) -> Result<String> {
    let cases: Result<Vec<String>> = result
        .rows()
        .iter()
        .map(|row| {
            let (without, with) = (fixed(row, "without_rmse", 3)?, fixed(row, "rmse", 3)?);
            let robot = match row.text("robot")? {
                "shoe" => "the shoe",
                "simulated" => "the simulated foot",
                name => name,
            };
            Ok(format!("{without} instead of {with} on {robot}"))
        })
        .collect();
    Ok(filled(&format!(
        "The constants of the first row were chosen on all of these sets, but of the bench only the two robots named above \
         took part. For the second row, the constants were chosen again for each robot, without its recordings. Averaged \
         over the sets of a robot, simulated and real, as recorded and at 1 kHz, the RMSE is then {}.",
        cases?.join(", ")
    )))
}

fn without_robot(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "robot",
        "RMSE",
        "stances lost",
        "RMSE, without it",
        "stances lost, without it",
    ]);
    for row in result.rows() {
        table.row([
            row.text("robot")?.to_owned(),
            fixed(&row, "rmse", 3)?,
            percent(row.optional("lost")?),
            fixed(&row, "without_rmse", 3)?,
            percent(row.optional("without_lost")?),
        ]);
    }
    Ok(table.0)
}

/// Median and 90 % quantile of a delay, ms.
fn delay(figures: &Figures, name: &str) -> Result<String> {
    let (median, most) =
        (fixed(figures, &format!("{name}_ms"), 0)?, fixed(figures, &format!("{name}_90_ms"), 0)?);
    Ok(if median == "–" { median } else { format!("{median} ({most})") })
}

fn delays(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "feet",
        "Hz",
        "s",
        "stances",
        "lost",
        "touch-down → P > ½, ms",
        "→ decision, ms",
        "lift-off → P < ½, ms",
    ]);
    for row in result.rows() {
        let rates = [count(&row, "least_rate_hz")?, count(&row, "largest_rate_hz")?];
        let name = match row.text("set")? {
            "real robots" => "the four sets of real robots",
            "demo" => "walk of `footfall demo`",
            name => name,
        };
        table.row([
            name.to_owned(),
            if rates[0] == rates[1] { rates[0].clone() } else { rates.join(" to ") },
            count(&row, "duration_s")?,
            count(&row, "stances")?,
            count(&row, "lost")?,
            delay(&row, "rise")?,
            delay(&row, "decision")?,
            delay(&row, "fall")?,
        ]);
    }
    for row in of_bench(&Stored::read("bench")?, OURS, "all")? {
        if row.number("stances")? > 0.0 && row.number("rate_hz")? == KILOHERTZ {
            table.row([
                format!("bench: {}", row.text("motion")?),
                count(&row, "rate_hz")?,
                format!("{:.0}", 60.0 * row.number("foot_minutes")?),
                count(&row, "stances")?,
                count(&row, "lost")?,
                delay(&row, "rise")?,
                delay(&row, "decision")?,
                delay(&row, "fall")?,
            ]);
        }
    }
    Ok(table.0)
}

/// Method of the bench's rows that are about this estimator.
const OURS: &str = "footfall";

/// Rate of the bench at which all methods are scored, Hz.
const KILOHERTZ: f64 = 1000.0;

/// Rows of the bench about a method on a robot, or on `all`.
fn of_bench<'a>(result: &'a Stored, method: &str, robot: &str) -> Result<Vec<Figures<'a>>> {
    let mut found = Vec::new();
    for row in result.rows() {
        if row.text("method")? == method && row.text("robot")? == robot {
            found.push(row);
        }
    }
    Ok(found)
}

fn bench_robots(result: &Stored) -> Result<String> {
    let values = result.values();
    let mut table = Table::new(&[
        "robot",
        "motion",
        "RMSE",
        "ROC-AUC",
        "F1 of P > ½",
        "F1 of the decision",
        "P > ½ of the stable time",
        "false slips",
        "foot-minutes",
    ]);
    let judges = values.texts("judges")?;
    for robot in values.texts("robots")? {
        let name =
            if judges.contains(&robot) { format!("{robot} (judge)") } else { robot.to_owned() };
        for row in of_bench(result, OURS, robot)? {
            table.row([
                name.clone(),
                row.text("motion")?.to_owned(),
                fixed(&row, "rmse", 3)?,
                fixed(&row, "roc_auc", 3)?,
                fixed(&row, "f1", 3)?,
                fixed(&row, "decision_f1", 3)?,
                percent(row.optional("trusted")?),
                count(&row, "false_slips")?,
                fixed(&row, "foot_minutes", 1)?,
            ]);
        }
    }
    let robots = values.texts("robots")?.join(", ");
    let fallen = values.texts("fallen")?;
    let fallen = if fallen.is_empty() {
        "None fell.".to_owned()
    } else {
        format!("These fell: {}.", fallen.join("; "))
    };
    Ok(format!("{}\n{}", filled(&format!("Measured: {robots}. {fallen}")), table.0))
}

fn bench_methods(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "motion",
        "Hz",
        "method",
        "RMSE",
        "ROC-AUC",
        "calibration error",
        "F1 of P > ½",
        "F1 of the decision",
        "stances",
        "lost",
    ]);
    for row in result.rows() {
        if row.text("robot")? == "all" {
            table.row([
                row.text("motion")?.to_owned(),
                count(&row, "rate_hz")?,
                row.text("method")?.to_owned(),
                fixed(&row, "rmse", 3)?,
                fixed(&row, "roc_auc", 3)?,
                fixed(&row, "calibration_error", 3)?,
                fixed(&row, "f1", 3)?,
                fixed(&row, "decision_f1", 3)?,
                count(&row, "stances")?,
                count(&row, "lost")?,
            ]);
        }
    }
    Ok(table.0)
}

fn bench_delays(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "motion",
        "Hz",
        "stances",
        "lost",
        "decisions lost",
        "touch-down → P > ½, ms",
        "→ decision, ms",
        "lift-off → P < ½, ms",
    ]);
    for row in of_bench(result, OURS, "all")? {
        if row.number("stances")? > 0.0 {
            table.row([
                row.text("motion")?.to_owned(),
                count(&row, "rate_hz")?,
                count(&row, "stances")?,
                count(&row, "lost")?,
                count(&row, "lost_decisions")?,
                delay(&row, "rise")?,
                delay(&row, "decision")?,
                delay(&row, "fall")?,
            ]);
        }
    }
    Ok(table.0)
}

fn bench_slips(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "motion",
        "Hz",
        "foot-minutes",
        "slides",
        "faster than 0.1 m/s",
        "found by P < ½",
        "within 20 mm",
        "found by an event",
        "events",
        "false events",
    ]);
    for row in of_bench(result, OURS, "all")? {
        table.row([
            row.text("motion")?.to_owned(),
            count(&row, "rate_hz")?,
            fixed(&row, "foot_minutes", 1)?,
            count(&row, "slides")?,
            count(&row, "fast_slides")?,
            count(&row, "fast_slides_found")?,
            count(&row, "fast_slides_found_within_20_mm")?,
            count(&row, "fast_slides_reported")?,
            count(&row, "slips")?,
            count(&row, "false_slips")?,
        ]);
    }
    Ok(table.0)
}

fn bench_reliability(result: &Stored) -> Result<String> {
    let of = result.values().figures("reliability")?;
    let (stable, samples) = (of.numbers("stable")?, of.numbers("samples")?);
    let mut table = Table::new(&["P", "stable", "part of all samples"]);
    for (range, (stable, samples)) in stable.into_iter().zip(samples).enumerate() {
        let share = samples.context("a share of all samples")?;
        table.row([
            format!("{:.1} to {:.1}", range as f64 / 10.0, (range + 1) as f64 / 10.0),
            percent(stable),
            format!("{:.1} %", 100.0 * share),
        ]);
    }
    Ok(table.0)
}

fn bench_velocity(result: &Stored) -> Result<String> {
    const WAYS: [&str; 5] = ["always", "force", "decision", "sigma_v", "truth"];
    let mut table = Table::new(&[&["robot"], &WAYS[..]].concat());
    for row in result.rows() {
        let mut cells = vec![row.text("robot")?.to_owned()];
        for way in WAYS {
            let of = row.figures(way)?;
            cells.push(format!("{}, {}", fixed(&of, "error_m_s", 3)?, fixed(&of, "drift_m", 2)?));
        }
        table.row(cells);
    }
    Ok(table.0)
}

fn reliability(result: &Stored) -> Result<String> {
    let rows = result.rows();
    let mut columns = Vec::new();
    let mut headings = vec!["P".to_owned()];
    for row in &rows {
        headings.push(row.text("sets")?.to_owned());
        columns.push((row.numbers("stable")?, row.numbers("samples")?));
    }
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    let mut table = Table::new(&headings);
    for range in 0..10 {
        let mut cells =
            vec![format!("{:.1} to {:.1}", range as f64 / 10.0, (range + 1) as f64 / 10.0)];
        for (stable, samples) in &columns {
            let share = samples[range].context("a share of all samples")?;
            cells.push(format!("{} ({:.1} %)", percent(stable[range]), 100.0 * share));
        }
        table.row(cells);
    }
    Ok(table.0)
}

fn rmse_by_set(result: &Stored) -> Result<String> {
    rmse(
        result,
        &[
            "default",
            "paper",
            "authors' script",
            "SHOE",
            "SHOE, tuned on others",
            "hidden Markov model",
            "force threshold",
            "force trigger",
            "fuzzy c-means",
        ],
    )
}

fn rmse_by_rate(result: &Stored) -> Result<String> {
    rmse(result, &["native", "100 Hz", "390 Hz", "500 Hz", "1000 Hz", "1660 Hz"])
}

/// RMSE of several sets or means, one column for each of the names.
fn rmse(result: &Stored, columns: &[&str]) -> Result<String> {
    let mut table = Table::new(&[&["RMSE"], columns].concat());
    for row in result.rows() {
        let rmse = row.figures("rmse")?;
        let mut cells = vec![row.text("set")?.to_owned()];
        for column in columns {
            cells.push(fixed(&rmse, column, 4)?);
        }
        table.row(cells);
    }
    Ok(table.0)
}

fn false_slips(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["set", "s", "touch-downs", "slips"]);
    for row in result.rows() {
        table.row([
            row.text("set")?.to_owned(),
            count(&row, "duration_s")?,
            count(&row, "touch_downs")?,
            count(&row, "slips")?,
        ]);
    }
    Ok(table.0)
}

fn odometry(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["", "mean error, m", "largest, m", "NIS"]);
    for row in result.rows() {
        table.row([
            row.text("measurement")?.to_owned(),
            fixed(&row, "mean_error_m", 3)?,
            fixed(&row, "largest_error_m", 3)?,
            fixed(&row, "nis", 1)?,
        ]);
    }
    let mut halves = Vec::new();
    for half in result.values().rows("halves")? {
        halves.push(format!(
            "{} m/s and {} m, whose mean error is {} m ({} m with the defaults)",
            half.number("speed_m_s")?,
            half.number("lever_m")?,
            fixed(&half, "mean_error_m", 3)?,
            fixed(&half, "default_mean_error_m", 3)?
        ));
    }
    let text = format!(
        "As a check, speed and lever of `sigma_v` were chosen on one half of the walks and scored on the other half, and \
         then the other way round. The first choice was {}.",
        halves.join(". The second was ")
    );
    Ok(format!("{}\n{}", table.0, filled(&text)))
}

/// An angle with two decimals.
fn angle(figures: &Figures, key: &str) -> Result<String> {
    Ok(format!("{}°", fixed(figures, key, 2)?))
}

fn attitude(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["recording", "RMS inclination error", "95 % within"]);
    for row in result.rows() {
        let cells = [row.text("recording")?.to_owned(), angle(&row, "rms_deg")?];
        table.row(cells.into_iter().chain([angle(&row, "percentile_95_deg")?]));
    }
    let values = result.values();
    let angle = |key| angle(&values, key);
    let text = format!(
        "These figures may be better than those of your sensor, because the filter's constants were chosen on \
         these trials, on the GO1 and on a simulated walk. But on these trials eight of its constants matter \
         little: if one of them is changed by 20 %, the mean is between {} and {}. In another test, time constant \
         and quiet gain were chosen from a coarse grid on three trials and scored on the other three, in all {} \
         ways. The mean is then {}, and {} at worst. The time to which the gyroscope's samples belong matters most: \
         without the half period that `gyro_timing` allows \
         for, the mean is {}.",
        angle("least_mean_with_a_constant_20_percent_off_deg")?,
        angle("largest_mean_with_a_constant_20_percent_off_deg")?,
        count(&values, "held_out_choices")?,
        angle("held_out_mean_deg")?,
        angle("held_out_worst_deg")?,
        angle("mean_without_gyro_timing_deg")?
    );
    Ok(format!("{}\n{}", table.0, filled(&text)))
}

fn attitude_peers(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["filter", "mean", "worst trial"]);
    for row in result.rows() {
        let cells = [row.text("filter")?.to_owned(), angle(&row, "mean_deg")?];
        table.row(cells.into_iter().chain([angle(&row, "worst_deg")?]));
    }
    Ok(table.0)
}

fn instructions(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["part", "instructions a sample", "budget"]);
    for row in result.rows() {
        table.row([
            row.text("part")?.to_owned(),
            count(&row, "instructions_per_sample")?,
            count(&row, "budget")?,
        ]);
    }
    Ok(table.0)
}

fn updates(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "",
        "disturbance",
        "program afterwards",
        "reason in 0x1F57",
        "time without contacts",
    ]);
    for row in result.rows() {
        let program = match row.text("runs_afterwards")? {
            "old" => "the old program",
            "new" => "the new program",
            "none" => "the bootloader; the next update succeeds",
            other => bail!("no program is called {other}"),
        };
        let reason = row.text("reason")?;
        let silent = row.optional("without_contacts_s")?;
        table.row([
            format!("`{}`", row.text("name")?),
            row.text("disturbance")?.to_owned(),
            program.to_owned(),
            if reason.is_empty() { "—" } else { reason }.to_owned(),
            silent.map_or_else(|| "—".to_owned(), |seconds| format!("{seconds:.1} s")),
        ]);
    }
    Ok(table.0)
}

fn updates_others(result: &Stored) -> Result<String> {
    let quoted = |key| -> Result<String> {
        let names = result.values().texts(key)?;
        Ok(names.iter().map(|name| format!("`{name}`")).collect::<Vec<String>>().join(", "))
    };
    let rows = result.values().texts("rows")?.len();
    Ok(format!("The board {} runs {rows} of these rows: {}.\n", quoted("boards")?, quoted("rows")?))
}

fn update_corners(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["board", "corner", "rows", "failed"]);
    for row in result.rows() {
        table.row([
            row.text("board")?.to_owned(),
            row.text("corner")?.to_owned(),
            count(&row, "rows")?,
            count(&row, "not_as_promised")?,
        ]);
    }
    Ok(table.0)
}

fn recordings(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "recording",
        "start",
        "duration",
        "contacts compared, serial line",
        "contacts compared, CAN",
        "contacts that differ in a bit",
    ]);
    for row in result.rows() {
        table.row([
            format!("`{}`", row.text("recording")?),
            format!("{} s", count(&row, "from_s")?),
            format!("{} s", fixed(&row, "duration_s", 1)?),
            count(&row, "compared_over_serial_line")?,
            count(&row, "compared_over_can")?,
            count(&row, "different")?,
        ]);
    }
    Ok(table.0)
}

fn hour(result: &Stored) -> Result<String> {
    let values = result.values();
    let mut table = Table::new(&["", ""]);
    let mut row = |name: &str, keys: &[&str], unit: &str| -> Result<()> {
        let numbers = keys.iter().map(|key| count(&values, key));
        let numbers = numbers.collect::<Result<Vec<String>>>()?.join(", ");
        table.row([name, &format!("{numbers}{unit}")]);
        Ok(())
    };
    row("ticks", &["ticks"], "")?;
    row("late ticks", &["late_ticks"], "")?;
    row(
        "data-ready edge to CAN mailbox: median, 99.9 %, longest",
        &[
            "edge_to_mailbox_us_median",
            "edge_to_mailbox_us_99_9_percent",
            "edge_to_mailbox_us_longest",
        ],
        " µs",
    )?;
    row(
        "instructions in a tick: median, longest",
        &["instructions_per_tick_median", "instructions_per_tick_longest"],
        "",
    )?;
    row(
        "estimated cycles in a tick: median, longest",
        &["cycles_per_tick_median", "cycles_per_tick_longest"],
        "",
    )?;
    row("deepest stack", &["deepest_stack_bytes"], " bytes")?;
    let of_lines = |key: &str| ["over_serial_line", "over_can"].map(|line| format!("{key}_{line}"));
    for (name, key) in [
        ("frames: serial line, CAN", "frames"),
        ("drops: serial line, CAN", "dropped"),
        ("estimates compared with the host: serial line, CAN", "compared"),
    ] {
        row(name, &of_lines(key).each_ref().map(String::as_str), "")?;
    }
    row("of which differ in a bit", &["different"], "")?;
    let load = fixed(&values, "processor_load_percent", 1)?;
    table.row(["estimated load of the processor", &format!("{load} %")]);
    Ok(table.0)
}

/// The latency of a board and its budget.
fn latency(result: &Stored) -> Result<String> {
    let values = result.values();
    let mut table = Table::new(&["", "µs"]);
    for (name, key) in [
        ("median", "edge_to_mailbox_us_median"),
        ("99.9 %", "edge_to_mailbox_us_99_9_percent"),
        ("longest", "edge_to_mailbox_us_longest"),
    ] {
        table.row([name, &count(&values, key)?]);
    }
    table.row(["budget of the longest", &EDGE_TO_MAILBOX_US.to_string()]);
    Ok(table.0)
}

/// Age of the motion that a contact reports when its frame has arrived at 1 Mbit/s: typical, and the longest.
fn latency_to_the_robot(result: &Stored) -> Result<String> {
    /// Bits per ms.
    const BIT_RATE: f64 = 1.0e3;
    /// Bits of a frame of eight bytes without stuffing: 44 around the data, and 3 until the next frame.
    const UNSTUFFED: f64 = 8.0 * 8.0 + 44.0 + 3.0;
    let longest = |bytes| f64::from(longest_frame(bytes)) / BIT_RATE;
    let median = result.values().number("edge_to_mailbox_us_median")? / 1.0e3;
    let budget = f64::from(EDGE_TO_MAILBOX_US) / 1.0e3;
    let parts = [
        (
            "delay of the sensor's filters, of second order with cut-offs of 333 and 335 Hz, for slow motion",
            2,
            [0.67, 0.67],
        ),
        (
            "wait for the next sample: one per ms, at an edge at most 0.15 ms after the tick",
            2,
            [0.50, 1.15],
        ),
        (
            "read, estimate and encode, from edge to CAN mailbox: [estimated](../laboratory/virtual-board/README.md#latency) \
             (typical), its budget (longest)",
            3,
            [median, budget],
        ),
        (
            "wait for the bus: none (typical), or a frame under way, a SYNC and three contacts (longest)",
            3,
            [0.0, 4.0 * longest(8) + longest(1)],
        ),
        (
            "the frame, without stuff bits (typical) or with the most possible (longest)",
            3,
            [UNSTUFFED / BIT_RATE, longest(8)],
        ),
    ];
    let sum = |parts: &[(&str, usize, [f64; 2])]| {
        parts
            .iter()
            .fold([0.0; 2], |sum, (_, _, [typical, longest])| [sum[0] + typical, sum[1] + longest])
    };
    let mut table = Table::new(&["part", "typical, ms", "longest, ms"]);
    for (name, decimals, [typical, longest]) in &parts {
        table.row([
            (*name).to_owned(),
            format!("{typical:.decimals$}"),
            format!("{longest:.decimals$}"),
        ]);
    }
    // Filters and the wait for a sample are over when it is taken.
    for (name, parts) in [
        ("**age of the sample**: sum of the three rows above", &parts[2..]),
        ("**sum of all parts**", &parts[..]),
    ] {
        let [typical, longest] = sum(parts);
        table.row([name.to_owned(), format!("**{typical:.2}**"), format!("**{longest:.2}**")]);
    }
    Ok(table.0)
}

/// Quantities of the two boards, and their budgets.
fn budgets(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["", "reference", "feather", "budget", ""]);
    for row in result.rows() {
        table.row([
            row.text("quantity")?.to_owned(),
            count(&row, "reference")?,
            count(&row, "feather")?,
            count(&row, "budget")?,
            row.text("unit")?.to_owned(),
        ]);
    }
    Ok(table.0)
}

/// A time with two digits.
fn two_digits(ms: f64) -> String {
    match ms {
        ..9.95 => format!("{ms:.1} ms"),
        ..995.0 => format!("{ms:.0} ms"),
        _ => format!("{:.1} s", ms / 1000.0),
    }
}

fn faults(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "`fault`",
        "fault",
        "detected after",
        "reported",
        "last \"stable\" after",
        "\"stable\" on invalid data",
        "recovered after",
    ]);
    for row in result.rows() {
        let late = row.optional("late_ms")?;
        let last_stable = match (row.flag("invalid_data")?, row.optional("last_stable_ms")?) {
            (true, Some(ms)) => two_digits(ms),
            (true, None) => "never".to_owned(),
            (false, _) => late.map_or_else(
                || "data valid".to_owned(),
                |ms| format!("data valid, at most {} late", two_digits(ms)),
            ),
        };
        let stable = match row.number("frames_on_invalid_data")? {
            0.0 => "—".to_owned(),
            frames => format!("{} of about {frames}", count(&row, "stable_on_invalid_data")?),
        };
        table.row([
            format!("`{}`", row.text("fault")?),
            row.text("description")?.to_owned(),
            row.optional("detected_ms")?.map_or_else(|| "—".to_owned(), two_digits),
            reported(&row)?,
            last_stable,
            stable,
            recovered(&row)?,
        ]);
    }
    Ok(table.0)
}

/// Reports of a fault.
fn reported(row: &Figures) -> Result<String> {
    let each = |key, before: &str, behind: &str| -> Result<Vec<String>> {
        let texts = row.texts(key)?.into_iter();
        Ok(texts.map(|text| format!("{before}{text}{behind}")).collect())
    };
    let mut all = each("resets", "reset (", ")")?;
    all.extend(each("emergencies", "EMCY ", "")?);
    all.extend(each("faults_over_serial_line_alone", "serial line: ", "")?);
    let counters = row.texts("counters")?;
    if !counters.is_empty() {
        all.push(format!("counted: {}", counters.join(", ")));
    }
    if row.flag("boot_up_message")? {
        all.push("boot-up message".to_owned());
    }
    Ok(if all.is_empty() { "—".to_owned() } else { all.join("; ") })
}

/// Recovery from a fault, with what became of the settings, and the remark.
fn recovered(row: &Figures) -> Result<String> {
    let mut text = match (row.optional("recovered_ms")?, row.optional("reported_cleared_ms")?) {
        (Some(ms), _) => two_digits(ms),
        (None, Some(ms)) => format!("reported cleared after {}", two_digits(ms)),
        (None, None) if row.flag("healthy_at_end")? => "not disturbed".to_owned(),
        (None, None) => "persists, reported".to_owned(),
    };
    if let Ok(settings) = row.figures("settings") {
        text += &format!(
            "; settings: {} × old, {} × new, {} × other",
            count(&settings, "old")?,
            count(&settings, "new")?,
            count(&settings, "other")?
        );
    }
    let note = row.text("note")?;
    if !note.is_empty() {
        text += &format!("; {note}");
    }
    Ok(text)
}

fn corners(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["corner", "rows", "beyond their bounds"]);
    for row in result.rows() {
        table.row([
            row.text("corner")?.to_owned(),
            count(&row, "rows")?,
            count(&row, "beyond_their_bounds")?,
        ]);
    }
    Ok(table.0)
}

fn pairs(result: &Stored) -> Result<String> {
    let pairs = count(&result.values(), "pairs")?;
    if result.values().number("pairs_beyond_their_bounds")? != 0.0 {
        bail!("the result `pairs` has pairs beyond their bounds");
    }
    Ok(format!(
        "Only faults that can be injected into a running board without preparation were combined. Each ordered pair of \
         them was run twice, at the same time and 12 ms apart, which makes {pairs} runs. In none of them did a frame \
         say \"stable\" on invalid data, and the board recovered every time.\n"
    ))
}

fn bus_profiles(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "wiring",
        "feet",
        "bit rate",
        "contact message every",
        "load of the bus",
        "longest time between two contacts of a foot",
    ]);
    for row in result.rows() {
        table.row([
            row.text("wiring")?.to_owned(),
            count(&row, "feet")?,
            format!("{} kbit/s", count(&row, "bit_rate_kbit_s")?),
            format!("{} ms", count(&row, "contact_period_ms")?),
            format!("{} %", count(&row, "bus_load_percent")?),
            format!("{} ms", fixed(&row, "longest_between_contacts_ms", 2)?),
        ]);
    }
    Ok(table.0)
}

fn processors(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "processor",
        "library, bytes",
        "stack of `init`",
        "of `update`",
        "instructions of an update, mean",
        "largest",
        "bound",
    ]);
    for row in result.rows() {
        table.row([
            format!("`{}`", row.text("processor")?),
            count(&row, "library_bytes")?,
            count(&row, "init_stack_bytes")?,
            count(&row, "update_stack_bytes")?,
            count(&row, "mean_instructions")?,
            count(&row, "largest_instructions")?,
            count(&row, "bound_instructions")?,
        ]);
    }
    Ok(table.0)
}

fn nano(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["", "", ""]);
    for row in result.rows() {
        table.row([
            row.text("quantity")?.to_owned(),
            row.number("value")?.to_string(),
            row.text("unit")?.to_owned(),
        ]);
    }
    Ok(table.0)
}

fn throughput(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["a million samples", "s", "samples/s"]);
    for row in result.rows() {
        table.row([
            row.text("work")?.to_owned(),
            fixed(&row, "seconds_per_million_samples", 2)?,
            grouped(&row, "samples_per_s")?,
        ]);
    }
    let values = result.values();
    let text = format!(
        "Two threads estimate {} times as many samples a second as one. \
         [`throughput.py`](../laboratory/benchmarks/throughput.py) measured this with CPython {}; before it began, the load \
         average was {}.",
        fixed(&values, "two_threads_to_one", 2)?,
        values.text("cpython")?,
        fixed(&values, "load_average_before", 1)?
    );
    Ok(format!("{}\n{}", table.0, filled(&text)))
}

fn live(result: &Stored) -> Result<String> {
    let mut table = Table::new(&[
        "four feet at, Hz",
        "samples",
        "lost",
        "added, median, ms",
        "99 of 100 within, ms",
        "share of one core",
    ]);
    for row in result.rows() {
        table.row([
            fixed(&row, "rate_hz", 0)?,
            grouped(&row, "samples")?,
            count(&row, "lost")?,
            fixed(&row, "p50_ms", 2)?,
            fixed(&row, "p99_ms", 2)?,
            fixed(&row, "cpu_share", 2)?,
        ]);
    }
    let text = format!(
        "`replay - --output -` reads a line and prints its row after {} ms (median; 99 of 100 rows within {} ms). \
         [`live.py`](../../laboratory/benchmarks/live.py) measured these times at a raised priority; before it began, the \
         load average of other programs was {}.",
        fixed(&result.values(), "stream_p50_ms", 2)?,
        fixed(&result.values(), "stream_p99_ms", 2)?,
        fixed(&result.values(), "load_average_before", 1)?
    );
    Ok(format!("{}\n{}", table.0, filled(&text)))
}

fn fleet(result: &Stored) -> Result<String> {
    let mut table = Table::new(&["recordings", "s", "recordings/s", "samples/s"]);
    for row in result.rows() {
        let of = format!("{} of {} s", count(&row, "recordings")?, row.number("length_s")?);
        let is_again = row.flag("unchanged")?;
        let name = match (is_again, row.flag("samples_written")?) {
            (true, _) => "these again, unchanged".to_owned(),
            (false, true) => format!("{of}, samples written"),
            (false, false) => of,
        };
        let rate = row.number("recordings_per_s")?;
        table.row([
            name,
            fixed(&row, "duration_s", 1)?,
            if is_again { grouped(&row, "recordings_per_s")? } else { format!("{rate:.1}") },
            if is_again { String::new() } else { grouped(&row, "samples_per_s")? },
        ]);
    }
    let values = result.values();
    let text = format!(
        "The recordings are Parquet at 1 kHz. They were estimated by {} workers with CPython {}; before this began, the \
         load average was {}. An estimate takes {} bytes of memory for each sample of each foot.",
        count(&values, "workers")?,
        values.text("cpython")?,
        fixed(&values, "load_average_before", 1)?,
        count(&values, "bytes_per_sample")?
    );
    Ok(format!("{}\n{}", table.0, filled(&text)))
}

fn gate(result: &Stored) -> Result<String> {
    let mut table =
        Table::new(&["command", "commit", "minutes", "CPU minutes", "packages compiled"]);
    for row in result.rows() {
        // A result of one commit has it beside its figures.
        let commit = row.text("commit").or_else(|_| result.text("commit"))?;
        table.row([
            format!("`{}`", row.text("command")?),
            commit.to_owned(),
            fixed(&row, "minutes", 1)?,
            fixed(&row, "cpu_minutes", 1)?,
            count(&row, "packages_compiled")?,
        ]);
    }
    Ok(table.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_two_digits() {
        let times = [0.04, 9.94, 9.96, 994.0, 996.0, 1234.0].map(two_digits);
        assert_eq!(times, ["0.0 ms", "9.9 ms", "10 ms", "994 ms", "1.0 s", "1.2 s"]);
    }

    #[test]
    fn lines_break_before_column_121() {
        let word = "x".repeat(59);
        assert_eq!(filled(&format!("{word} {word}")), format!("{word} {word}\n"));
        assert_eq!(filled(&format!("{word} {word} ab")), format!("{word} {word}\nab\n"));
    }

    #[test]
    fn number_without_a_figure_is_a_dash() {
        let json = serde_json::json!({"rmse": null, "samples": 1_234_567});
        let figures = Figures { place: "made".to_owned(), json: &json };
        assert_eq!(fixed(&figures, "rmse", 4).expect("a dash"), "–");
        assert_eq!(grouped(&figures, "samples").expect("a count"), "1,234,567");
        assert!(fixed(&figures, "missing", 1).is_err());
    }
}
