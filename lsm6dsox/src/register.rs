//! Registers in use: the description shared by the drivers and the simulated part.
//!
//! Addresses, bit fields and the identity are those of ST's own C driver \[P\]. The other values after reset are
//! secondary \[S\]. The drivers write the registers of a configuration in full.

/// Kind of access to a register over the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Can be written and read back.
    ReadWrite,
    /// Writing has no effect.
    ReadOnly,
}

/// One 8-bit register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// ST's name of the register.
    pub name: &'static str,
    /// Address, 7 bits.
    pub address: u8,
    /// Value after power-up and after a software reset.
    pub reset: u8,
    /// Access that the bus has to the register.
    pub access: Access,
    /// Bits with a function. The others are reserved, and keep their value after reset.
    pub mask: u8,
}

impl Register {
    /// Most significant bit of the address byte on SPI: set to read \[D\].
    pub const READ: u8 = 0x80;

    /// Returns the address byte that starts a read.
    #[must_use]
    pub const fn read_address(&self) -> u8 {
        self.address | Self::READ
    }

    /// Returns whether two values agree in all fields. Reserved bits may read as anything, because the data sheet does
    /// not specify them.
    #[must_use]
    pub const fn agree(&self, first: u8, second: u8) -> bool {
        (first ^ second) & self.mask == 0
    }

    /// Returns whether `value` leaves the reserved bits at their reset value.
    #[must_use]
    pub const fn keeps_reserved_bits(&self, value: u8) -> bool {
        (value ^ self.reset) & !self.mask == 0
    }
}

/// Adjacent bits of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    low: u8,
    high: u8,
}

impl Field {
    /// Mask of the field's bits, in place.
    #[must_use]
    pub const fn mask(self) -> u8 {
        (0xFF >> (7 - self.high)) & (0xFF << self.low)
    }

    /// Returns `value` moved to the field's place; bits that do not fit are dropped.
    #[must_use]
    pub const fn place(self, value: u8) -> u8 {
        (value << self.low) & self.mask()
    }

    /// Returns the field's value in the register's `value`.
    #[must_use]
    pub const fn of(self, value: u8) -> u8 {
        (value & self.mask()) >> self.low
    }

    /// Returns whether any bit of the field is set in the register's `value`.
    #[must_use]
    pub const fn is_set(self, value: u8) -> bool {
        value & self.mask() != 0
    }
}

macro_rules! registers {
    ($(
        $(#[$doc:meta])*
        $name:ident $fields:ident $address:literal $access:ident $reset:literal
        { $($field:ident $low:literal ..= $high:literal),* $(,)? }
    )*) => {
        $(
            $(#[$doc])*
            pub const $name: Register = Register {
                name: stringify!($name),
                address: $address,
                reset: $reset,
                access: Access::$access,
                mask: 0 $(| $fields::$field.mask())*,
            };

            #[doc = concat!("The fields of [`", stringify!($name), "`].")]
            pub mod $fields {
                $(
                    #[doc = concat!("Bits ", $low, " to ", $high, ".")]
                    pub const $field: super::Field = super::Field { low: $low, high: $high };
                )*
            }
        )*

        /// Every register described here, by ascending address.
        pub const ALL: &[Register] = &[$($name),*];
    };
}

registers! {
    /// Selection of the register bank; 0 is the one described here.
    FUNC_CFG_ACCESS func_cfg_access 0x01 ReadWrite 0x00 { OIS_CTRL_FROM_UI 0..=0, REG_ACCESS 6..=7 }
    /// Pull-ups of the data pins.
    PIN_CTRL pin_ctrl 0x02 ReadWrite 0x3F { SDO_PU_EN 6..=6, OIS_PU_DIS 7..=7 }
    /// FIFO watermark, bits 0 to 7.
    FIFO_CTRL1 fifo_ctrl1 0x07 ReadWrite 0x00 { WTM 0..=7 }
    /// FIFO watermark, bit 8; compression.
    FIFO_CTRL2 fifo_ctrl2 0x08 ReadWrite 0x00 {
        WTM8 0..=0, UNCOPTR_RATE 1..=2, ODRCHG_EN 4..=4, FIFO_COMPR_RT_EN 6..=6, STOP_ON_WTM 7..=7,
    }
    /// Data rates of the FIFO's batches; same codes as the output data rates.
    FIFO_CTRL3 fifo_ctrl3 0x09 ReadWrite 0x00 { BDR_XL 0..=3, BDR_GY 4..=7 }
    /// FIFO mode; batching of temperature and timestamp.
    FIFO_CTRL4 fifo_ctrl4 0x0A ReadWrite 0x00 { FIFO_MODE 0..=2, ODR_T_BATCH 4..=5, ODR_TS_BATCH 6..=7 }
    /// Batch counter; data-ready pulsed instead of latched.
    COUNTER_BDR_REG1 counter_bdr_reg1 0x0B ReadWrite 0x00 {
        CNT_BDR_TH 0..=2, TRIG_COUNTER_BDR 5..=5, RST_COUNTER_BDR 6..=6, DATAREADY_PULSED 7..=7,
    }
    /// Signals routed to INT1.
    INT1_CTRL int1_ctrl 0x0D ReadWrite 0x00 {
        DRDY_XL 0..=0, DRDY_G 1..=1, BOOT 2..=2, FIFO_TH 3..=3, FIFO_OVR 4..=4, FIFO_FULL 5..=5,
        CNT_BDR 6..=6, DEN_DRDY_FLAG 7..=7,
    }
    /// Signals routed to INT2.
    INT2_CTRL int2_ctrl 0x0E ReadWrite 0x00 {
        DRDY_XL 0..=0, DRDY_G 1..=1, DRDY_TEMP 2..=2, FIFO_TH 3..=3, FIFO_OVR 4..=4,
        FIFO_FULL 5..=5, CNT_BDR 6..=6,
    }
    /// The part's identity, shared with LSM6DSO and LSM6DSO32.
    WHO_AM_I who_am_i 0x0F ReadOnly 0x6C { ID 0..=7 }
    /// Accelerometer: data rate, full scale, second low-pass filter.
    CTRL1_XL ctrl1_xl 0x10 ReadWrite 0x00 { LPF2_XL_EN 1..=1, FS_XL 2..=3, ODR_XL 4..=7 }
    /// Gyroscope: data rate and full scale.
    CTRL2_G ctrl2_g 0x11 ReadWrite 0x00 { FS_125 1..=1, FS_G 2..=3, ODR_G 4..=7 }
    /// Reset, address increment, pin levels, block data update.
    CTRL3_C ctrl3_c 0x12 ReadWrite 0x04 {
        SW_RESET 0..=0, IF_INC 2..=2, SIM 3..=3, PP_OD 4..=4, H_LACTIVE 5..=5, BDU 6..=6, BOOT 7..=7,
    }
    /// I²C off; first low-pass filter of the gyroscope on.
    CTRL4_C ctrl4_c 0x13 ReadWrite 0x00 {
        LPF1_SEL_G 1..=1, I2C_DISABLE 2..=2, DRDY_MASK 3..=3, INT2_ON_INT1 5..=5, SLEEP_G 6..=6,
    }
    /// Self-test; wrap-around of burst reads.
    CTRL5_C ctrl5_c 0x14 ReadWrite 0x00 {
        ST_XL 0..=1, ST_G 2..=3, ROUNDING_STATUS 4..=4, ROUNDING 5..=6, XL_ULP_EN 7..=7,
    }
    /// Cut-off of the gyroscope's first low-pass filter; low power for the accelerometer.
    CTRL6_C ctrl6_c 0x15 ReadWrite 0x00 {
        FTYPE 0..=2, USR_OFF_W 3..=3, XL_HM_MODE 4..=4, DEN_MODE 5..=7,
    }
    /// High-pass filter and low power for the gyroscope.
    CTRL7_G ctrl7_g 0x16 ReadWrite 0x00 {
        OIS_ON 0..=0, USR_OFF_ON_OUT 1..=1, OIS_ON_EN 2..=2, HPM_G 4..=5, HP_EN_G 6..=6, G_HM_MODE 7..=7,
    }
    /// Cut-off of the accelerometer's second filter.
    CTRL8_XL ctrl8_xl 0x17 ReadWrite 0x00 {
        LOW_PASS_ON_6D 0..=0, XL_FS_MODE 1..=1, HP_SLOPE_XL_EN 2..=2, FASTSETTL_MODE_XL 3..=3,
        HP_REF_MODE_XL 4..=4, HPCF_XL 5..=7,
    }
    /// I3C off; data-enable stamping.
    CTRL9_XL ctrl9_xl 0x18 ReadWrite 0xE0 {
        I3C_DISABLE 1..=1, DEN_LH 2..=2, DEN_XL_G 3..=4, DEN_Z 5..=5, DEN_Y 6..=6, DEN_X 7..=7,
    }
    /// Timestamp counter on.
    CTRL10_C ctrl10_c 0x19 ReadWrite 0x00 { TIMESTAMP_EN 5..=5 }
    /// Flags of outputs that are newer than the last reading.
    STATUS_REG status_reg 0x1E ReadOnly 0x00 { XLDA 0..=0, GDA 1..=1, TDA 2..=2 }
    /// Temperature, low byte; the high byte follows.
    OUT_TEMP_L out_temp_l 0x20 ReadOnly 0x00 { DATA 0..=7 }
    /// Angular rate about x, low byte; the other five follow.
    OUTX_L_G outx_l_g 0x22 ReadOnly 0x00 { DATA 0..=7 }
    /// Specific force along x, low byte; the other five follow.
    OUTX_L_A outx_l_a 0x28 ReadOnly 0x00 { DATA 0..=7 }
    /// Specific force along z, high byte: the end of the sample.
    OUTZ_H_A outz_h_a 0x2D ReadOnly 0x00 { DATA 0..=7 }
    /// I3C timing; pull-down of INT1.
    I3C_BUS_AVB i3c_bus_avb 0x62 ReadWrite 0x00 { PD_DIS_INT1 0..=0, I3C_BUS_AVB_SEL 3..=4 }
    /// Error of the part's clock, in steps of 0.15 %.
    INTERNAL_FREQ_FINE internal_freq_fine 0x63 ReadOnly 0x00 { FREQ_FINE 0..=7 }
    /// Offset of the specific force along x, added to the output of the low-pass filter if
    /// `USR_OFF_ON_OUT` is set.
    X_OFS_USR x_ofs_usr 0x73 ReadWrite 0x00 { OFS 0..=7 }
    /// Offset of the specific force along y.
    Y_OFS_USR y_ofs_usr 0x74 ReadWrite 0x00 { OFS 0..=7 }
    /// Offset of the specific force along z.
    Z_OFS_USR z_ofs_usr 0x75 ReadWrite 0x00 { OFS 0..=7 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_are_listed_once_and_by_rising_address() {
        for pair in ALL.windows(2) {
            assert!(pair[0].address < pair[1].address, "{}", pair[1].name);
        }
    }

    #[test]
    fn a_field_keeps_to_its_own_bits() {
        assert_eq!(ctrl1_xl::ODR_XL.mask(), 0xF0);
        assert_eq!(ctrl1_xl::FS_XL.place(0b01), 0x04);
        assert_eq!(ctrl1_xl::FS_XL.place(0xFF), 0x0C);
        assert_eq!(ctrl1_xl::ODR_XL.of(0xA6), 0x0A);
        assert_eq!(fifo_ctrl1::WTM.mask(), 0xFF);
    }

    #[test]
    fn reserved_bits_are_those_without_a_field() {
        assert_eq!(CTRL1_XL.mask, 0xFE);
        assert!(CTRL1_XL.keeps_reserved_bits(0xA6));
        assert!(!CTRL1_XL.keeps_reserved_bits(0xA7));
        assert!(PIN_CTRL.keeps_reserved_bits(0x7F) && !PIN_CTRL.keeps_reserved_bits(0x40));
    }

    #[test]
    fn reading_sets_the_top_bit_of_the_address() {
        assert_eq!(WHO_AM_I.read_address(), 0x8F);
        assert_eq!(STATUS_REG.read_address(), 0x9E);
    }
}
