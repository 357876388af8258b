//! The Feather: Adafruit's Feather STM32F405 Express with a 12 MHz crystal. `pins.toml` lists the connection of each
//! pin and its source.
//!
//! Only the capture of channel 1 gives the pulses that TIM4 counts (RM0090, 18.4.2, MMS), and no pin of that channel is
//! free here. So TI1S feeds channel 1 with the XOR of channels 1 to 3, and the edges of channel 3's pin reach it. The
//! inputs of channels 1 and 2 are not connected to pins, and are equal.
//!
//! The breakout shifts the levels of clock and data with 10 kΩ. At 2.5 MHz a rising edge may take as long as half a
//! period. So the bus starts at 1.25 MHz, near the 1 MHz of Adafruit's own driver (`Adafruit_LSM6DS`), and goes up to 2.5
//! MHz if all registers read back right there.

super::wiring! {
    crystal: 12 MHz,
    sensor: {
        clock: PA5,
        to_sensor: PA7,
        from_sensor: PA6,
        select: PA4,
        data_ready: PB10, TIM2 Ch3, XOR,
        speed: Lowest to Reduced,
    },
    can: { transmit: PB9, receive: PB8 },
    uart: { transmit: PB6, receive: PB7 },
    load: PC4, ADC1 input 14,
    led: PC1,
}

/// Board in the header of the program.
pub const BOARD: bootloader::image::Board = bootloader::image::Board::Feather;
