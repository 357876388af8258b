//! `footfall.dbc`: the frames of every foot at its default node id.

use std::fmt::Write;

use wire::foot::cob_id;
use wire::node::NmtState;
use wire::pdo::{Load, Quantity, Signal, SignalKind};
use wire::{Fault, Foot, Pdo, Settings};

/// Code of a signed signal without a value.
const NO_VALUE: i16 = Quantity::NONE.0;

/// States in a heartbeat.
const NODE_STATES: [(NmtState, &str); 4] = [
    (NmtState::Initialising, "boot_up"),
    (NmtState::Stopped, "stopped"),
    (NmtState::Operational, "operational"),
    (NmtState::PreOperational, "pre_operational"),
];

pub fn generate() -> String {
    let feet = Foot::ALL.map(Foot::name).join(" ");
    let mut dbc = format!(
        "VERSION \"1\"\n\nNS_ :\n\tBA_\n\tBA_DEF_\n\tBA_DEF_DEF_\n\tCM_\n\tSIG_VALTYPE_\n\tVAL_\n\nBS_:\n\nBU_: {feet} Robot\n"
    );
    let messages =
        || Foot::ALL.into_iter().flat_map(|foot| Pdo::ALL.map(|pdo| (foot, pdo, id(foot, pdo))));
    for (foot, pdo, id) in messages() {
        let name = foot.name();
        let _ = writeln!(dbc, "\nBO_ {id} {name}_{}: 8 {name}", pdo.name());
        for (_, signal) in pdo.signals() {
            write_signal(&mut dbc, &signal);
        }
    }
    for foot in Foot::ALL {
        let (name, node) = (foot.name(), foot.default_node_id());
        let _ = writeln!(
            dbc,
            "
BO_ {} {name}_Emergency: 8 {name}
 SG_ EmergencyCode : 0|16@1+ (1,0) [0|65535] \"\" Robot
 SG_ ErrorRegister : 16|8@1+ (1,0) [0|255] \"\" Robot
 SG_ FaultNumber : 24|8@1+ (1,0) [0|255] \"\" Robot
 SG_ Detail : 32|32@1+ (1,0) [0|4294967295] \"\" Robot

BO_ {} {name}_Heartbeat: 1 {name}
 SG_ NodeState : 0|7@1+ (1,0) [0|127] \"\" Robot",
            node.cob_id(cob_id::EMERGENCY),
            node.cob_id(cob_id::HEARTBEAT)
        );
        let _ = writeln!(
            dbc,
            "\nBO_ {} {name}_Load: 4 Robot\n SG_ Load : 0|32@1- (1,0) [-1000000000|1000000000] \"N\" {name}",
            node.cob_id(Load::BASE)
        );
    }
    dbc.push('\n');
    let _ = writeln!(
        dbc,
        "CM_ \"Contact of a robot's feet. Identifiers are those of the default node ids; with another one, shift them. A signed signal at its lowest code has no value. Generated from wire/src/pdo: change that, not this.\";"
    );
    for (_, pdo, id) in messages() {
        let number = pdo as u8 + 1;
        let _ = writeln!(dbc, "CM_ BO_ {id} \"TPDO{number}: {}\";", pdo.about());
        for (_, signal) in pdo.signals() {
            let Signal { name, comment, .. } = signal;
            let none = match signal.kind {
                SignalKind::Signed { .. } => {
                    format!(" The code {NO_VALUE} means that there is no value.")
                }
                SignalKind::Unsigned { .. } | SignalKind::Named(_) => String::new(),
            };
            let _ = writeln!(dbc, "CM_ SG_ {id} {name} \"{comment}{none}\";");
        }
    }
    for foot in Foot::ALL {
        let node = foot.default_node_id();
        let (emergency, heartbeat) =
            (node.cob_id(cob_id::EMERGENCY), node.cob_id(cob_id::HEARTBEAT));
        let _ = writeln!(
            dbc,
            "CM_ BO_ {emergency} \"A fault was raised or cleared.\";
CM_ SG_ {emergency} EmergencyCode \"Emergency code of the raised fault; 0 if it was cleared.\";
CM_ SG_ {emergency} ErrorRegister \"Object 0x1001 of CiA 301 after the change.\";
CM_ SG_ {emergency} FaultNumber \"Number of the raised or cleared fault.\";
CM_ SG_ {emergency} Detail \"docs/reference/faults.md explains it for each fault.\";
CM_ BO_ {heartbeat} \"Boot-up and heartbeat of the node.\";
CM_ SG_ {heartbeat} NodeState \"NMT state of CiA 301.\";
CM_ BO_ {load} \"RPDO1: the load, from a robot that measures it; used with load source 2 (object 0x2015).\";
CM_ SG_ {load} Load \"Load on the foot, in the unit of the load thresholds.\";",
            load = node.cob_id(Load::BASE)
        );
    }
    dbc.push_str("BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\n");
    dbc.push_str("BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n");
    for (_, pdo, id) in messages() {
        let period = pdo.default_period_ms();
        let _ = writeln!(dbc, "BA_ \"GenMsgCycleTime\" BO_ {id} {period};");
    }
    let heartbeat = Settings::default().heartbeat_ms();
    for foot in Foot::ALL {
        let id = foot.default_node_id().cob_id(cob_id::HEARTBEAT);
        let _ = writeln!(dbc, "BA_ \"GenMsgCycleTime\" BO_ {id} {heartbeat};");
    }
    for foot in Foot::ALL {
        let id = foot.default_node_id().cob_id(Load::BASE);
        let _ = writeln!(dbc, "SIG_VALTYPE_ {id} Load : 1;");
    }
    for (_, pdo, id) in messages() {
        for (_, signal) in pdo.signals() {
            let names: String = match signal.kind {
                SignalKind::Named(names) => {
                    names.iter().map(|(code, name)| format!(" {code} \"{name}\"")).collect()
                }
                SignalKind::Signed { .. } => format!(" {NO_VALUE} \"no_value\""),
                SignalKind::Unsigned { .. } => continue,
            };
            let _ = writeln!(dbc, "VAL_ {id} {}{names} ;", signal.name);
        }
    }
    let codes: String =
        Fault::ALL.map(|fault| format!(" {} \"{}\"", fault.code(), fault.name())).concat();
    let numbers: String =
        Fault::ALL.map(|fault| format!(" {} \"{}\"", fault.number(), fault.name())).concat();
    let states: String =
        NODE_STATES.map(|(state, name)| format!(" {} \"{name}\"", state as u8)).concat();
    for foot in Foot::ALL {
        let node = foot.default_node_id();
        let (emergency, heartbeat) =
            (node.cob_id(cob_id::EMERGENCY), node.cob_id(cob_id::HEARTBEAT));
        let _ = writeln!(
            dbc,
            "VAL_ {emergency} EmergencyCode 0 \"gone\"{codes} ;
VAL_ {emergency} FaultNumber{numbers} ;
VAL_ {heartbeat} NodeState{states} ;"
        );
    }
    dbc
}

fn id(foot: Foot, pdo: Pdo) -> u16 {
    pdo.cob_id(foot.default_node_id())
}

fn write_signal(dbc: &mut String, signal: &Signal) {
    let Signal { name, start, length, unit, .. } = signal;
    let factor = signal.factor();
    let sign = match signal.kind {
        SignalKind::Signed { .. } => '-',
        SignalKind::Unsigned { .. } | SignalKind::Named(_) => '+',
    };
    let (low, high) = signal.code_range();
    let [low, high] = [low, high].map(|code| rounded(code as f64 * factor));
    let _ = writeln!(
        dbc,
        " SG_ {name} : {start}|{length}@1{sign} ({factor},0) [{low}|{high}] \"{unit}\" Robot"
    );
}

/// Rounds to nine places, enough for every range here.
fn rounded(value: f64) -> f64 {
    (value * 1.0e9).round() / 1.0e9
}
