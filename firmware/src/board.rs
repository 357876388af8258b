//! Interface to a board, besides the bus of its sensor, its [ticks](crate::sampling::Ticks), the
//! [mailboxes](crate::ports::Mailboxes) of its CAN controller, its flash and its LED.

use storage::StoreFailed;
use wire::Settings;

use crate::exchange::BusState;
use crate::sampling::Tick;
use crate::supervision::StackDepth;

/// A board. The sampling level calls the functions up to [`Board::micros_since_edge`], the thread level the others.
pub trait Board {
    /// Interval at which the watchdog is fed, ms. It is at most a tenth of the watchdog's period.
    const FEEDING_MS: u32;

    /// Prepares the measurement of a tick's costs.
    fn begin_tick(&self) {}

    /// Notes that the work of a tick is done.
    fn end_tick(&self) {}

    /// Newest reading of the analog load input; `None` without one.
    fn load_reading(&self) -> Option<u16>;

    /// State of the CAN controller; active without one.
    fn bus_state(&self) -> BusState {
        BusState::Active
    }

    /// Sets the node id whose frames are received; 0 for none.
    fn listen_as(&self, node_id: u8) {
        let _ = node_id;
    }

    /// Returns the time from the tick's data-ready edge until the contact was in its mailbox, µs, or 0 if there was no
    /// contact.
    fn micros_to_mailbox(&self) -> u32 {
        0
    }

    /// Returns the time since the data-ready edge of the tick, µs, or since the end of the wait if no edge came.
    fn micros_since_edge(&self, tick: &Tick) -> u32;

    /// Returns whether another node has acknowledged a frame.
    fn is_acknowledged(&self) -> bool {
        false
    }

    /// Restarts the watchdog's period, and resets the count of its consecutive resets.
    fn feed_watchdog(&self);

    /// Checks the next piece of the stack. Returns the maximum depth, bytes, if it has changed.
    fn look_at_stack(&self, depth: &mut StackDepth) -> Option<usize>;

    /// Applies the rates of CAN and UART.
    fn apply_rates(&self, settings: &Settings);

    /// Sets the highest brown-out level, and protects the bootloader.
    ///
    /// # Errors
    /// The supply is too low, or the flash refuses.
    fn protect(&self) -> Result<(), StoreFailed>;

    /// Confirms the running program, if it is new.
    ///
    /// # Errors
    /// The supply is too low, or the flash refuses.
    fn confirm_program(&self) -> Result<(), StoreFailed>;

    /// Restarts into the bootloader.
    fn start_bootloader(&self) -> !;

    /// Restarts the board.
    fn reset(&self) -> !;
}
