//! `footfall.dbc`: the frames of every foot at its default node id.

use std::fmt::Write;

use wire::pdo::{Kind, Signal};
use wire::{Foot, Pdo};

pub fn generate() -> String {
    let feet = Foot::ALL.map(Foot::name).join(" ");
    let mut dbc = format!(
        "VERSION \"1\"\n\nNS_ :\n\tBA_\n\tBA_DEF_\n\tBA_DEF_DEF_\n\tCM_\n\tVAL_\n\nBS_:\n\nBU_: {feet} Robot\n"
    );
    let messages = || {
        Foot::ALL
            .into_iter()
            .flat_map(|foot| Pdo::ALL.map(|pdo| (foot, pdo, id(foot, pdo))))
    };
    for (foot, pdo, id) in messages() {
        let name = foot.name();
        let _ = writeln!(dbc, "\nBO_ {id} {name}_{}: 8 {name}", pdo.name());
        for signal in pdo.signals() {
            write_signal(&mut dbc, signal);
        }
    }
    dbc.push('\n');
    let _ = writeln!(
        dbc,
        "CM_ \"Contact of a robot's feet. Identifiers are those of the default node ids; with another one, shift them. Generated from wire/src/pdo: change that, not this.\";"
    );
    for (_, pdo, id) in messages() {
        let number = pdo as u8 + 1;
        let _ = writeln!(dbc, "CM_ BO_ {id} \"TPDO{number}: {}\";", about(pdo));
        for signal in pdo.signals() {
            let Signal { name, comment, .. } = signal;
            let _ = writeln!(dbc, "CM_ SG_ {id} {name} \"{comment}\";");
        }
    }
    dbc.push_str("BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\n");
    dbc.push_str("BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n");
    for (_, pdo, id) in messages() {
        let period = pdo.default_period_ms();
        let _ = writeln!(dbc, "BA_ \"GenMsgCycleTime\" BO_ {id} {period};");
    }
    for (_, pdo, id) in messages() {
        for signal in pdo.signals() {
            if let Kind::Named(names) = signal.kind {
                let names: String = names
                    .iter()
                    .map(|(code, name)| format!(" {code} \"{name}\""))
                    .collect();
                let _ = writeln!(dbc, "VAL_ {id} {}{names} ;", signal.name);
            }
        }
    }
    dbc
}

fn id(foot: Foot, pdo: Pdo) -> u16 {
    pdo.cob_id(foot.default_node_id())
}

fn about(pdo: Pdo) -> &'static str {
    match pdo {
        Pdo::Contact => "contact, each tick.",
        Pdo::Axes => "probability of each axis.",
        Pdo::Attitude => "orientation.",
        Pdo::Acceleration => "acceleration without gravity.",
        Pdo::Rate => "angular rate without bias.",
        Pdo::Bias => "gyroscope bias and temperature.",
        Pdo::Health => "flags, errors, drops and the clock.",
    }
}

fn write_signal(dbc: &mut String, signal: &Signal) {
    let Signal {
        name,
        start,
        length,
        unit,
        ..
    } = signal;
    let factor = signal.factor();
    let sign = match signal.kind {
        Kind::Signed { .. } => '-',
        Kind::Unsigned { .. } | Kind::Named(_) => '+',
    };
    let (low, high) = signal.code_range();
    let [low, high] = [low, high].map(|code| rounded(code as f64 * factor));
    let _ = writeln!(
        dbc,
        " SG_ {name} : {start}|{length}@1{sign} ({factor},0) [{low}|{high}] \"{unit}\" Robot"
    );
}

/// To nine places, which no range here needs more of.
fn rounded(value: f64) -> f64 {
    (value * 1.0e9).round() / 1.0e9
}
