//! Commands typed while feet run.

use gait::GaitName;
use wire::Foot;

use super::foot::Order;
use super::hands::Side;
use crate::product::fault::SelectedFault;
use crate::product::scenario::Pages;

/// Text of the help.
pub const HELP: &str = "\
[FOOT:] gait stand|walk|trot|run    where the foot next stands, it takes it up
[FOOT:] fault NAME[:VARIANT]        inject a fault; some need a power-up, which is done then
[FOOT:] fault clear                 clear what can be cleared
[FOOT:] hold x|-x|y|-y|z|-z         a hand turns it so that this is up; it stays so, also while it walks
[FOOT:] tap                         a finger taps its sole
[FOOT:] power-cycle                 switch off and on: all faults are gone, settings stay
@MS [FOOT:] …                       any of these, MS ms after the start
faults                              the names of all faults
help                                this
quit                                end
Without FOOT (FL, FR, RL, RR, L, R) it is all feet.
";

/// A typed command.
#[derive(Clone, Copy)]
pub enum Command {
    /// An order to one foot, or to all.
    Order(Option<Foot>, Order),
    /// An order at a time, ms.
    Planned(u64, Option<Foot>, Order),
    /// Lists the names of faults.
    Faults,
    /// Prints the help.
    Help,
    /// Ends the program.
    Quit,
}

/// Parses a line; `None` if it is blank.
///
/// # Errors
/// The command or its argument is invalid. The error is a sentence with the reason.
pub fn parse(line: &str) -> Result<Option<Command>, String> {
    if let Some(planned) = line.trim_start().strip_prefix('@') {
        let (ms, order) = planned.split_once(' ').unwrap_or((planned, ""));
        let ms = ms.parse().map_err(|_| format!("{ms} is not a time in ms"))?;
        return match parse(order)? {
            Some(Command::Order(foot, order)) => Ok(Some(Command::Planned(ms, foot, order))),
            _ => Err(format!("{:?} is not an order to a foot", order.trim())),
        };
    }
    let (foot, rest) = split(line)?;
    let words: Vec<&str> = rest.split_whitespace().collect();
    let command = match words[..] {
        [] if foot.is_none() => return Ok(None),
        ["gait", name] => Command::Order(foot, Order::Gait(gait(name)?)),
        ["fault", name] => Command::Order(foot, Order::Fault(fault(name)?)),
        ["hold", name] => Command::Order(foot, Order::Hold(side(name)?)),
        ["tap"] => Command::Order(foot, Order::Tap),
        ["power-cycle"] => Command::Order(foot, Order::PowerCycle),
        ["faults"] if foot.is_none() => Command::Faults,
        ["help"] if foot.is_none() => Command::Help,
        ["quit"] if foot.is_none() => Command::Quit,
        _ => return Err(format!("{:?} is not a command; help lists them", line.trim())),
    };
    Ok(Some(command))
}

/// Splits a leading foot, `FL:`, from the rest of a text.
///
/// # Errors
/// If the text before the first colon is neither a foot nor a command.
fn split(line: &str) -> Result<(Option<Foot>, &str), String> {
    let Some((name, rest)) = line.split_once(':') else {
        return Ok((None, line));
    };
    let name = name.trim();
    // A colon after a command belongs to a variant.
    if name.contains(char::is_whitespace) {
        return Ok((None, line));
    }
    let foot = Foot::ALL.into_iter().find(|foot| foot.name() == name);
    let names = || Foot::ALL.map(Foot::name).join(", ");
    match foot {
        Some(foot) => Ok((Some(foot), rest)),
        None => Err(format!("there is no foot {name:?}; feet are {}", names())),
    }
}

fn side(name: &str) -> Result<Side, String> {
    Side::find(name).ok_or_else(|| format!("{name} is not a side: {}", Side::NAMES.join(", ")))
}

fn gait(name: &str) -> Result<GaitName, String> {
    name.parse::<GaitName>().map_err(|error| error.to_string())
}

/// Parses a fault that can be injected while feet run.
///
/// # Errors
/// If no fault has this name, or it cannot be injected while feet run.
fn fault(text: &str) -> Result<SelectedFault, String> {
    let fault: SelectedFault = text.parse()?;
    // Filling them takes minutes of the board's time.
    if fault.scenario.pages != Pages::Blank {
        return Err(format!(
            "{0} begins with full pages of flash: FOOTFALL_ROWS={0} cargo test -p virtual-board matrix:: -- --ignored",
            fault.scenario.name
        ));
    }
    Ok(fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_command_to_one_foot_or_to_all_feet() {
        let order = |line: &str| match parse(line) {
            Ok(Some(Command::Order(foot, order))) => (foot, order),
            _ => panic!("{line}"),
        };
        assert!(matches!(order("gait trot"), (None, Order::Gait(GaitName::Trot))));
        for (line, expected, name) in [
            ("FR: fault miso-low", Some(Foot::FrontRight), "miso-low"),
            ("FR:fault clear", Some(Foot::FrontRight), "clear"),
            (" fault  power-cut:17 ", None, "power-cut"),
        ] {
            let (foot, Order::Fault(fault)) = order(line) else {
                panic!("{line}");
            };
            assert_eq!((foot, fault.scenario.name), (expected, name));
        }
        assert!(matches!(order("L: power-cycle").1, Order::PowerCycle));
        assert!(matches!(order("hold -y").1, Order::Hold(side) if side.name() == "-y"));
        assert!(matches!(order("tap").1, Order::Tap));
        assert!(matches!(
            parse("@5000 R: tap"),
            Ok(Some(Command::Planned(5000, Some(Foot::Right), Order::Tap)))
        ));
        assert!(matches!(parse("  "), Ok(None)));
        assert!(matches!(parse("quit"), Ok(Some(Command::Quit))));
    }

    #[test]
    fn an_invalid_line_is_an_error_that_lists_the_valid_names() {
        for (line, expected) in [
            ("gait hop", "known are stand, walk, trot, run"),
            ("gait", "help lists them"),
            ("hold up", "up is not a side: x, -x, y"),
            ("fault thawed", "thawed is not one of miso-low"),
            ("fault store-erases", "FOOTFALL_ROWS=store-erases"),
            ("XX: gait walk", "feet are FL, FR"),
            ("FL: quit", "help lists them"),
            ("FL:", "help lists them"),
            ("jump", "help lists them"),
            ("@5 quit", "is not an order"),
            ("@5", "is not an order"),
            ("@x tap", "x is not a time in ms"),
        ] {
            match parse(line) {
                Err(error) => assert!(error.contains(expected), "{line}: {error}"),
                Ok(_) => panic!("{line}"),
            }
        }
    }
}
