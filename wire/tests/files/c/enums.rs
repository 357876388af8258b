//! Enumerations in C: names and numbers come from the crate's own.

use std::fmt::{Debug, Write};

use wire::node::Command;
use wire::pdo::Kind as SignalKind;
use wire::uart::Kind;
use wire::{AbortCode, Fault, Pdo, Stage};

use super::super::dbc::NODE_STATES;
use super::super::eds::ascii;
use super::{comment, snake};

/// Whether C code must check if a number belongs to the enumeration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Yes,
    No,
}

/// Enumeration.
#[derive(Clone, Debug)]
pub struct Enum {
    name: &'static str,
    about: &'static str,
    /// Number, name in C without the common prefix, and text.
    values: Vec<(u32, String, String)>,
    /// Value that represents all others: it is never sent.
    unknown: Option<u32>,
    asked: Asked,
}

/// Name of a variant as part of a constant.
fn snake_of(variant: impl Debug) -> String {
    snake(&format!("{variant:?}"))
}

impl Enum {
    /// Creates an enumeration from numbers, the names of their constants, and texts.
    fn new(
        name: &'static str,
        about: &'static str,
        values: impl IntoIterator<Item = (u32, String, String)>,
    ) -> Self {
        let values = values.into_iter();
        Self {
            name,
            about,
            values: values
                .map(|(code, of, text)| (code, of.to_ascii_uppercase(), text))
                .collect(),
            unknown: None,
            asked: Asked::No,
        }
    }

    fn asked(mut self) -> Self {
        self.asked = Asked::Yes;
        self
    }

    pub fn declare(&self) -> String {
        let Self { name, about, .. } = self;
        let prefix = format!("FOOTFALL_{}", name.to_ascii_uppercase());
        let mut values: Vec<String> = self
            .values
            .iter()
            .map(|(code, constant, _)| format!("    {prefix}_{constant} = {}", number(*code)))
            .collect();
        if let Some(code) = self.unknown {
            values.push(format!("    {prefix}_UNKNOWN = {}", number(code)));
        }
        format!(
            "{}enum footfall_{name} {{\n{}\n}};\n\n\
             /* Its name; \"unknown\" for a number that is none. */\n\
             const char *footfall_{name}_name(enum footfall_{name} {name});\n\n",
            comment("", about),
            values.join(",\n")
        )
    }

    pub fn define(&self) -> String {
        let Self { name, .. } = self;
        let prefix = format!("FOOTFALL_{}", name.to_ascii_uppercase());
        let mut code = format!(
            "const char *footfall_{name}_name(enum footfall_{name} {name})\n{{\n    switch ({name}) {{\n"
        );
        for (_, constant, text) in &self.values {
            let _ = write!(
                code,
                "    case {prefix}_{constant}:\n        return \"{text}\";\n"
            );
        }
        if self.unknown.is_some() {
            let _ = write!(code, "    case {prefix}_UNKNOWN:\n        break;\n");
        }
        code += "    }\n    return \"unknown\";\n}\n\n";
        if self.asked == Asked::Yes {
            let _ = write!(
                code,
                "static bool is_{name}(uint32_t code)\n{{\n    switch (code) {{\n"
            );
            for (value, ..) in &self.values {
                let _ = writeln!(code, "    case {}u:", number(*value));
            }
            code += "        return true;\n    default:\n        return false;\n    }\n}\n\n";
        }
        code
    }
}

/// Formats a number as is usual for its size.
fn number(code: u32) -> String {
    if code < 0x100 {
        code.to_string()
    } else {
        format!("0x{code:08X}")
    }
}

/// All enumerations.
pub fn all() -> Vec<Enum> {
    let owned = |code: u32, name: &str| (code, name.to_owned(), name.to_owned());
    let named = |wanted: &str| {
        let (_, signal) = Pdo::Contact
            .signals()
            .find(|(_, signal)| signal.name == wanted)
            .expect("a signal of TPDO1");
        let SignalKind::Named(names) = signal.kind else {
            panic!("{wanted} has no names");
        };
        names.iter().map(|(code, name)| owned((*code).into(), name))
    };
    let frames = Pdo::ALL.map(|pdo| snake(pdo.name()));
    let others = ["emergency", "heartbeat", "load"].map(str::to_owned);
    let frames = [&frames[..], &others].concat();
    vec![
        Enum::new(
            "state",
            "Phase of the gait; unknown without a load signal or in doubt.",
            named("State"),
        )
        .asked(),
        Enum::new(
            "decision",
            "The debounced answer; stable only where the status is valid.",
            named("Decision"),
        ),
        Enum::new(
            "node_state",
            "State of the node (NMT), as in the heartbeat; a boot-up is the first of them.",
            NODE_STATES.map(|(state, name)| owned(state as u32, name)),
        )
        .asked(),
        Enum::new(
            "stage",
            "What the board is doing.",
            Stage::ALL.map(|stage| owned(stage.code().into(), stage.name())),
        )
        .asked(),
        Enum {
            unknown: Some(u8::MAX.into()),
            ..Enum::new(
                "fault",
                "Something is wrong with the board: bit i of a set of faults is the fault of number i.",
                Fault::ALL.map(|fault| {
                    let name = fault.name().to_owned();
                    (fault.number().into(), snake_of(fault), name)
                }),
            )
            .asked()
        },
        Enum::new(
            "validity",
            "What the sensor's driver says about a sample.",
            super::messages::VALIDITIES.map(|(code, name)| owned(code.into(), name)),
        )
        .asked(),
        Enum::new(
            "abort",
            "Why a request was refused (CiA 301).",
            AbortCode::ALL.map(|abort| (abort.code(), snake_of(abort), abort.name().to_owned())),
        )
        .asked(),
        Enum::new(
            "command",
            "A change of the node's state (NMT).",
            COMMANDS.map(|(command, name)| owned(command as u32, name)),
        )
        .asked(),
        Enum::new(
            "frame_kind",
            "What a CAN frame says.",
            (0..).zip(&frames).map(|(code, name)| owned(code, name)),
        ),
        Enum::new(
            "message_kind",
            "What a message of the serial line says: its type's byte.",
            Kind::ALL.map(|kind| owned(kind.code().into(), &snake_of(kind))),
        )
        .asked(),
    ]
}

const COMMANDS: [(Command, &str); 5] = [
    (Command::StartRemoteNode, "start"),
    (Command::StopRemoteNode, "stop"),
    (Command::EnterPreOperational, "enter_pre_operational"),
    (Command::ResetNode, "reset_node"),
    (Command::ResetCommunication, "reset_communication"),
];

/// Other properties of faults: code, detail, the sets that determine the error register.
pub fn fault_functions() -> String {
    let about = |of: &dyn Fn(Fault) -> String| -> String {
        Fault::ALL
            .iter()
            .map(|fault| {
                let name = snake_of(fault).to_ascii_uppercase();
                format!(
                    "    case FOOTFALL_FAULT_{name}:\n        return {};\n",
                    of(*fault)
                )
            })
            .collect()
    };
    let codes = about(&|fault| format!("0x{:04X}u", fault.code()));
    let details = about(&|fault| format!("\"{}\"", ascii(fault.detail())));
    let bits = |of: &dyn Fn(Fault) -> bool| {
        let set = Fault::ALL.into_iter().filter(|fault| of(*fault));
        set.fold(0_u32, |bits, fault| bits | 1 << fault.number())
    };
    let registers: String = (1..8)
        .map(|i| 1_u8 << i)
        .map(|bit| (bit, bits(&|fault| fault.register_bits() & bit != 0)))
        .filter(|(_, set)| *set != 0)
        .map(|(bit, set)| {
            format!("    if ((faults & UINT32_C(0x{set:08X})) != 0u) {{\n        bits |= 0x{bit:02X}u;\n    }}\n")
        })
        .collect();
    format!(
        "uint16_t footfall_fault_code(enum footfall_fault fault)\n{{\n    switch (fault) {{\n{codes}\
         \x20   case FOOTFALL_FAULT_UNKNOWN:\n        break;\n    }}\n    return 0u;\n}}\n\n\
         const char *footfall_fault_detail(enum footfall_fault fault)\n{{\n    switch (fault) {{\n{details}\
         \x20   case FOOTFALL_FAULT_UNKNOWN:\n        break;\n    }}\n    return \"unknown\";\n}}\n\n\
         /* Every fault that is known here. */\n\
         static const uint32_t FAULTS_KNOWN = UINT32_C(0x{:08X});\n\n\
         /* The error register while these faults last. */\n\
         static uint32_t register_of(uint32_t faults)\n{{\n\
         \x20   uint32_t bits = faults != 0u ? 0x01u : 0u;\n{registers}    return bits;\n}}\n\n",
        bits(&|_| true)
    )
}
