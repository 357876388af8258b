//! The table of a board: its pins, its crystal and the input of the capture timer. Boards differ in nothing else.
//!
//! The controllers behind the pins are the same on each board, and their modules name them: SPI1 with streams 0 and 3
//! of DMA2, USART1 with streams 2 and 7, CAN1, ADC1, TIM2 for ticks and edges, TIM4 for their count, TIM5 for the HAL.

use embassy_stm32::Peri;
use embassy_stm32::peripherals::{
    ADC1, CAN1, DMA2_CH0, DMA2_CH2, DMA2_CH3, DMA2_CH7, FLASH, SPI1, TIM2, TIM4, USART1,
};

#[cfg(any(
    all(feature = "feather", feature = "reference"),
    not(any(feature = "feather", feature = "reference"))
))]
compile_error!("choose one board by a feature: `reference` (default) or `feather`");

/// Peripherals of the board with their pins.
pub struct Parts {
    pub timer: Peri<'static, TIM2>,
    pub counter: Peri<'static, TIM4>,
    pub sensor: SensorParts,
    pub converter: Peri<'static, ADC1>,
    pub load: Peri<'static, Load>,
    pub can: CanParts,
    pub uart: UartParts,
    pub flash: Peri<'static, FLASH>,
    pub led: Peri<'static, Led>,
}

/// Controller of the sensor's bus and its pins. The module `sensor` starts it.
pub struct SensorParts {
    pub controller: Peri<'static, SPI1>,
    pub clock: Peri<'static, SensorClock>,
    pub to_sensor: Peri<'static, ToSensor>,
    pub from_sensor: Peri<'static, FromSensor>,
    pub select: Peri<'static, SensorSelect>,
    pub data_ready: Peri<'static, DataReady>,
    /// Not passed to the HAL, but owned, so that no other code uses it.
    pub _transmit_dma: Peri<'static, DMA2_CH3>,
    /// As `_transmit_dma`.
    pub _receive_dma: Peri<'static, DMA2_CH0>,
}

/// Controller of CAN and its pins, before the bit rate is known. The module `can` starts it.
pub struct CanParts {
    /// Owned, so that no other code uses it.
    pub _controller: Peri<'static, CAN1>,
    pub receive: Peri<'static, CanReceive>,
    pub transmit: Peri<'static, CanTransmit>,
}

/// Controller of the serial line, its pins and DMA, before the rate is known. The module `uart` starts it.
pub struct UartParts {
    pub controller: Peri<'static, USART1>,
    pub transmit: Peri<'static, UartTransmit>,
    pub receive: Peri<'static, UartReceive>,
    pub transmit_dma: Peri<'static, DMA2_CH7>,
    pub receive_dma: Peri<'static, DMA2_CH2>,
}

/// Declares the wiring of a board from its table: types of pins, constants, and the function `parts`, which takes the
/// pins from the HAL.
macro_rules! wiring {
    (
        crystal: $crystal:literal MHz,
        sensor: {
            clock: $clock:ident,
            to_sensor: $to_sensor:ident,
            from_sensor: $from_sensor:ident,
            select: $select:ident,
            data_ready: $data_ready:ident, TIM2 $channel:ident, $input:ident,
            speed: $start:ident to $speed:ident,
        },
        can: { transmit: $can_transmit:ident, receive: $can_receive:ident },
        uart: { transmit: $uart_transmit:ident, receive: $uart_receive:ident },
        load: $load:ident, ADC1 input $load_input:literal,
        led: $led:ident,
    ) => {
        use embassy_stm32::pac::timer::vals::Ti1s;
        use embassy_stm32::{Peripherals, peripherals, timer};
        use lsm6dsox::BusSpeed;

        use super::{CanParts, Parts, SensorParts, UartParts};

        /// Crystal between `OSC_IN` and `OSC_OUT`: a whole number of MHz, 4 to 26.
        pub const CRYSTAL_MHZ: u32 = $crystal;
        pub type SensorClock = peripherals::$clock;
        pub type ToSensor = peripherals::$to_sensor;
        pub type FromSensor = peripherals::$from_sensor;
        pub type SensorSelect = peripherals::$select;
        pub type DataReady = peripherals::$data_ready;
        /// Channel of TIM2 that the pin of the data-ready line belongs to.
        pub type DataReadyChannel = timer::$channel;
        /// Pins that the capture of channel 1 of TIM2 sees.
        pub const CAPTURE_INPUT: Ti1s = Ti1s::$input;
        /// Clock of the sensor's bus at a start.
        pub const SENSOR_START: BusSpeed = BusSpeed::$start;
        /// Fastest clock of the sensor's bus.
        pub const SENSOR_SPEED: BusSpeed = BusSpeed::$speed;
        pub type CanTransmit = peripherals::$can_transmit;
        pub type CanReceive = peripherals::$can_receive;
        pub type UartTransmit = peripherals::$uart_transmit;
        pub type UartReceive = peripherals::$uart_receive;
        pub type Load = peripherals::$load;
        /// Input of ADC1 with the load sensor, 10 to 18.
        pub const LOAD_INPUT: u8 = $load_input;
        pub type Led = peripherals::$led;

        /// Takes the board's peripherals and pins.
        pub fn parts(p: Peripherals) -> Parts {
            Parts {
                timer: p.TIM2,
                counter: p.TIM4,
                sensor: SensorParts {
                    controller: p.SPI1,
                    clock: p.$clock,
                    to_sensor: p.$to_sensor,
                    from_sensor: p.$from_sensor,
                    select: p.$select,
                    data_ready: p.$data_ready,
                    _transmit_dma: p.DMA2_CH3,
                    _receive_dma: p.DMA2_CH0,
                },
                converter: p.ADC1,
                load: p.$load,
                can: CanParts {
                    _controller: p.CAN1,
                    receive: p.$can_receive,
                    transmit: p.$can_transmit,
                },
                uart: UartParts {
                    controller: p.USART1,
                    transmit: p.$uart_transmit,
                    receive: p.$uart_receive,
                    transmit_dma: p.DMA2_CH7,
                    receive_dma: p.DMA2_CH2,
                },
                flash: p.FLASH,
                led: p.$led,
            }
        }
    };
}
use wiring;

#[cfg(feature = "feather")]
mod feather;
#[cfg(feature = "feather")]
pub use feather::*;
#[cfg(feature = "reference")]
mod reference;
#[cfg(feature = "reference")]
pub use reference::*;
