//! Wiring of the boards: the pins of sensor, transceiver, serial line, load sensor and LED, and the crystal. It comes
//! from the tables of the firmware's boards (`pins.toml`), which the documents show. The programs have their own
//! tables, so that a wrong pin in a program is unconnected here.

use std::sync::LazyLock;

use toml::Table;

use crate::emulator::elf::ElfImage;
use crate::emulator::part::gpio::Gpio;

/// A pin of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChipPin {
    /// Port, A first.
    pub port: usize,
    /// Number in the port, 0 to 15.
    pub number: u32,
}

/// A pin and the alternate function by which a peripheral uses it (DS8626, table 9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Connection {
    /// The pin.
    pub pin: ChipPin,
    /// Name of the function, for instance `SPI1_SCK`.
    pub name: &'static str,
    /// Number of the alternate function.
    function: u32,
}

/// A board around the chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Name of the board and of its folder in the firmware.
    pub name: &'static str,
    /// Name of its program, and so of the ELF.
    pub program: &'static str,
    /// Frequency of the crystal, Hz.
    pub crystal: u32,
    /// Controller of the sensor's bus, SPI1 first.
    pub spi: usize,
    /// Clock of the sensor, data to and from it.
    pub sensor_bus: [Connection; 3],
    /// Chip select of the sensor.
    pub select: ChipPin,
    /// INT1 of the sensor.
    pub data_ready: ChipPin,
    /// To and from the CAN transceiver.
    pub can: [Connection; 2],
    /// Controller of the serial line: USART1, 2, 3 and 6.
    pub usart: usize,
    /// To and from the serial line.
    pub serial: [Connection; 2],
    /// Pin of the load sensor, and its channel of the converter.
    pub load: (ChipPin, usize),
    /// The LED.
    pub led: ChipPin,
    /// Pins that the board connects to a supply. A program that drives one of them shorts the supply.
    pub tied: Vec<ChipPin>,
}

/// Name and table of each board.
pub const TABLES: [(&str, &str); 2] = [
    (
        "reference",
        include_str!("../../../../firmware/boards/stm32f405/src/wiring/reference/pins.toml"),
    ),
    ("feather", include_str!("../../../../firmware/boards/stm32f405/src/wiring/feather/pins.toml")),
];

static BOARDS: LazyLock<Vec<Wiring>> = LazyLock::new(|| {
    let parse = |(name, text): &(&'static str, &'static str)| {
        Wiring::parse(name, text).unwrap_or_else(|problem| panic!("{name}/pins.toml: {problem}"))
    };
    TABLES.iter().map(parse).collect()
});

impl ChipPin {
    /// Reads a name such as `PA5`.
    fn parse(name: &str) -> Option<Self> {
        let mut letters = name.strip_prefix('P')?.chars();
        let port = "ABCDEFGHI".find(letters.next()?)?;
        let number: u32 = letters.as_str().parse().ok()?;
        (number < 16).then_some(Self { port, number })
    }

    /// Name of the pin.
    #[must_use]
    pub fn name(self) -> String {
        let letter = char::from(b'A' + self.port as u8);
        format!("P{letter}{}", self.number)
    }
}

/// Index of the controller in a function's name, and the number of the alternate function.
fn controller(function: &str) -> Option<(usize, u32)> {
    let (name, _) = function.split_once('_')?;
    Some(match name {
        "SPI1" => (0, 5),
        "SPI2" => (1, 5),
        "SPI3" => (2, 6),
        "USART1" => (0, 7),
        "USART2" => (1, 7),
        "USART3" => (2, 7),
        "USART6" => (3, 8),
        "CAN1" => (0, 9),
        _ => return None,
    })
}

impl Connection {
    /// Returns whether the program has connected the peripheral to the pin.
    #[must_use]
    pub const fn is_made(&self, ports: &[Gpio; 9]) -> bool {
        let port = &ports[self.pin.port];
        port.mode(self.pin.number) == 2 && port.function(self.pin.number) == self.function
    }
}

impl Wiring {
    /// The reference board.
    #[must_use]
    pub fn reference() -> &'static Self {
        &BOARDS[0]
    }

    /// All boards, the reference board first.
    #[must_use]
    pub fn all() -> &'static [Self] {
        &BOARDS
    }

    /// Returns the board of this name.
    ///
    /// # Errors
    /// No board has this name. The error lists all names.
    pub fn named(name: &str) -> Result<&'static Self, String> {
        let found = BOARDS.iter().find(|board| board.name == name);
        let names = TABLES.map(|(name, _)| name).join(", ");
        found.ok_or_else(|| format!("board `{name}`: there are {names}"))
    }

    /// Arguments of cargo that choose the board's program.
    #[must_use]
    pub fn cargo_arguments(&self) -> [&'static str; 7] {
        [
            "-p",
            "foot-stm32f405",
            "--no-default-features",
            "--features",
            self.name,
            "--bin",
            self.program,
        ]
    }

    /// The board for which an ELF is built, named by a symbol `_board_NAME`. Without one it is the reference board.
    #[must_use]
    pub fn of(image: &ElfImage) -> &'static Self {
        let names_it = |board: &&Self| image.symbol(&format!("_board_{}", board.name)).is_some();
        BOARDS.iter().find(names_it).unwrap_or(&BOARDS[0])
    }

    /// Reads a table.
    fn parse(name: &'static str, text: &'static str) -> Result<Self, String> {
        let table: Table = text.parse().map_err(|error| format!("{error}"))?;
        let wires = table.get("wire").and_then(toml::Value::as_array);
        let wires = wires.ok_or("there are no wires")?;
        let find = |signal: &str| -> Result<(ChipPin, &'static str), String> {
            let is_it = |wire: &&toml::Value| {
                wire.get("signal").and_then(toml::Value::as_str) == Some(signal)
            };
            let wire = wires.iter().find(is_it);
            let wire = wire.ok_or_else(|| format!("there is no wire for the signal {signal}"))?;
            let field = |key: &str| {
                let value = wire.get(key).and_then(toml::Value::as_str);
                value.ok_or_else(|| format!("{signal}: `{key}` is missing"))
            };
            let pin = field("pin")?;
            let pin = ChipPin::parse(pin).ok_or_else(|| format!("{signal}: {pin} is not a pin"))?;
            // Tables live as long as the program, a handful of names too.
            Ok((pin, String::leak(field("function")?.to_owned())))
        };
        let connect = |signal: &str| -> Result<(usize, Connection), String> {
            let (pin, name) = find(signal)?;
            let (index, function) = controller(name)
                .ok_or_else(|| format!("{signal}: {name} is not a function that is modelled"))?;
            let connection = Connection { pin, name, function };
            Ok((index, connection))
        };
        let (spi, clock) = connect("sensor_clock")?;
        let (usart, transmit) = connect("uart_transmit")?;
        let (load, input) = find("load")?;
        let input = input.strip_prefix("ADC1_IN").and_then(|n| n.parse().ok());
        let crystal = table.get("crystal_mhz").and_then(toml::Value::as_integer);
        let crystal = crystal.and_then(|mhz| u32::try_from(mhz).ok());
        let program = table.get("program").and_then(toml::Value::as_str);
        let program = program.ok_or("`program` is missing")?;
        let tied = table.get("tied").and_then(toml::Value::as_array);
        let tied = tied.into_iter().flatten().map(|entry| {
            let pin = entry.get("pin").and_then(toml::Value::as_str);
            pin.and_then(ChipPin::parse).ok_or("a tied pin is not a pin")
        });
        Ok(Self {
            name,
            program: String::leak(program.to_owned()),
            crystal: crystal.ok_or("`crystal_mhz` is missing")? * 1_000_000,
            spi,
            sensor_bus: [clock, connect("to_sensor")?.1, connect("from_sensor")?.1],
            select: find("sensor_select")?.0,
            data_ready: find("data_ready")?.0,
            can: [connect("can_transmit")?.1, connect("can_receive")?.1],
            usart,
            serial: [transmit, connect("uart_receive")?.1],
            load: (load, input.ok_or("load: the function is not ADC1_INn")?),
            led: find("led")?.0,
            tied: tied.collect::<Result<_, _>>()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_give_pins_functions_and_crystals() {
        let [reference, feather] = Wiring::all() else {
            panic!("{} boards", Wiring::all().len());
        };
        assert_eq!((reference.crystal, feather.crystal), (8_000_000, 12_000_000));
        assert_eq!(feather.data_ready, ChipPin { port: 1, number: 10 });
        assert_eq!(feather.tied.len(), 2);
        assert_eq!(reference.sensor_bus[2].name, "SPI1_MISO");
        assert_eq!(reference.load, (ChipPin { port: 2, number: 0 }, 10));
    }

    #[test]
    fn incomplete_table_error_names_the_signal() {
        let text = TABLES[0].1.replace("\"from_sensor\"", "\"nothing\"");
        let error = Wiring::parse("test", String::leak(text)).expect_err("a signal is missing");
        assert_eq!(error, "there is no wire for the signal from_sensor");
        assert_eq!(ChipPin::parse("PA16"), None);
        assert_eq!(ChipPin::parse("PB10").map(ChipPin::name), Some("PB10".into()));
    }
}
