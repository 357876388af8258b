//! Addresses in the object dictionary.

/// Address of an object or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Address {
    /// Index of the object.
    pub index: u16,
    /// Sub-index; 0 for an object of one value.
    pub subindex: u8,
}

impl Address {
    /// Creates an address.
    #[must_use]
    pub const fn new(index: u16, subindex: u8) -> Self {
        Self { index, subindex }
    }
}

/// Indices of the objects.
pub mod index {
    #![allow(missing_docs)]

    pub const DEVICE_TYPE: u16 = 0x1000;
    pub const ERROR_REGISTER: u16 = 0x1001;
    pub const ERROR_HISTORY: u16 = 0x1003;
    pub const SYNC_COB_ID: u16 = 0x1005;
    pub const DEVICE_NAME: u16 = 0x1008;
    pub const HARDWARE_VERSION: u16 = 0x1009;
    pub const SOFTWARE_VERSION: u16 = 0x100A;
    pub const STORE: u16 = 0x1010;
    pub const RESTORE: u16 = 0x1011;
    pub const TIME_COB_ID: u16 = 0x1012;
    pub const EMCY_COB_ID: u16 = 0x1014;
    pub const HEARTBEAT: u16 = 0x1017;
    pub const IDENTITY: u16 = 0x1018;
    pub const SDO_SERVER: u16 = 0x1200;
    pub const RPDO: u16 = 0x1400;
    pub const RPDO_MAPPING: u16 = 0x1600;
    pub const TPDO: u16 = 0x1800;
    pub const TPDO_MAPPING: u16 = 0x1A00;
    /// Program data: in the bootloader.
    pub const PROGRAM_DATA: u16 = 0x1F50;
    /// Program control.
    pub const PROGRAM_CONTROL: u16 = 0x1F51;
    /// Program software identification.
    pub const PROGRAM_ID: u16 = 0x1F56;
    /// Flash status identification.
    pub const FLASH_STATUS: u16 = 0x1F57;

    pub const FOOT: u16 = 0x2000;
    pub const NODE_ID: u16 = 0x2001;
    pub const CAN_BIT_RATE: u16 = 0x2002;
    pub const UART_RATE: u16 = 0x2003;
    pub const AUTOSTART: u16 = 0x2004;
    pub const LOCK: u16 = 0x2005;
    pub const LOG_LEVEL: u16 = 0x2006;
    pub const SELF_TEST: u16 = 0x2007;
    pub const UART_STREAMS: u16 = 0x2008;
    pub const WINDOW: u16 = 0x2010;
    pub const BANDWIDTH: u16 = 0x2011;
    pub const HALF_WIDTH: u16 = 0x2012;
    pub const ATTITUDE_FILTER: u16 = 0x2013;
    pub const DECISION: u16 = 0x2014;
    pub const LOAD_INPUT: u16 = 0x2015;
    pub const ESTIMATION: u16 = 0x2016;
    pub const ACCELEROMETER: u16 = 0x2017;
    pub const LEARNT: u16 = 0x2018;
    pub const MOUNTING: u16 = 0x2019;
    pub const VELOCITY: u16 = 0x201A;

    pub const CONTACT: u16 = 0x2100;
    pub const AXES: u16 = 0x2101;
    pub const ATTITUDE: u16 = 0x2102;
    pub const ACCELERATION: u16 = 0x2103;
    pub const RATE: u16 = 0x2104;
    pub const BIAS: u16 = 0x2105;
    pub const TEMPERATURE: u16 = 0x2106;
    pub const HEALTH: u16 = 0x2107;
    pub const LOAD: u16 = 0x2108;
    pub const TIME: u16 = 0x2109;
    pub const VELOCITY_SIGMA: u16 = 0x210A;
    pub const STAGE: u16 = 0x2110;
    pub const FAULTS: u16 = 0x2111;
    pub const COUNTERS: u16 = 0x2112;
    pub const LAST_CRASH: u16 = 0x2113;
    pub const SUPPLY: u16 = 0x2114;
    pub const SETTINGS_HASH: u16 = 0x2115;
    pub const COSTS: u16 = 0x2116;
    pub const DIAGNOSIS: u16 = 0x2117;
    pub const CALIBRATION: u16 = 0x2120;
}
