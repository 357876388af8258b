//! The reference board: a bare STM32F405RG with an 8 MHz crystal. `pins.toml` lists the connection of each pin.

super::wiring! {
    crystal: 8 MHz,
    sensor: {
        clock: PA5,
        to_sensor: PA7,
        from_sensor: PA6,
        select: PA4,
        data_ready: PA0, TIM2 Ch1, NORMAL,
        speed: Full to Full,
    },
    can: { transmit: PB9, receive: PB8 },
    uart: { transmit: PA9, receive: PA10 },
    load: PC0, ADC1 input 10,
    led: PC6,
}

/// Board in the header of the program.
pub const BOARD: bootloader::image::Board = bootloader::image::Board::Reference;
