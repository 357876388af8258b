//! Mean period of a foot's contacts, which tells how many were made in a given time.

/// Largest number of contacts over which the period is averaged; the smallest is half of it. A single
/// period varies by a sixth, because its time is that of the sensor's edge.
const AVERAGED: u64 = 2048;

/// Longest time to the contact with the next number, in periods; a longer time is a pause of the foot.
const MOST_PERIODS: i64 = 8;

/// Modulus of the sequence numbers.
const NUMBERS: i64 = 1 << 8;

/// Mean period of the contacts of a foot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    elapsed_us: u64,
    contacts: u64,
}

impl Pace {
    /// Adds a number of contacts made within `elapsed_us`.
    pub(super) const fn take(&mut self, elapsed_us: u64, contacts: u64) {
        self.elapsed_us += elapsed_us;
        self.contacts += contacts;
        if self.contacts >= AVERAGED {
            self.elapsed_us /= 2;
            self.contacts /= 2;
        }
    }

    /// Returns whether no contacts have been added.
    pub(super) const fn is_unknown(self) -> bool {
        self.contacts == 0
    }

    /// Starts from the time between two consecutive contacts, if the pace is unknown.
    pub(super) fn take_first(&mut self, elapsed_us: i64) {
        if self.is_unknown() && elapsed_us > 0 {
            self.take(elapsed_us.unsigned_abs(), 1);
        }
    }

    /// Returns whether a contact may be `contacts` after another, or before it if negative, by a time of
    /// `elapsed_us` between them. The tolerance is half a period plus the change of the pace; the next contact
    /// may be later, as with a late edge.
    pub(super) fn agrees(self, elapsed_us: i64, contacts: i64) -> bool {
        let expected_us = |contacts| {
            let mean_us = i64::try_from(self.elapsed_us).ok()?;
            let averaged = i64::try_from(self.contacts).ok()?;
            mean_us.saturating_mul(contacts).checked_div(averaged)
        };
        let (Some(period_us), Some(expected_us)) = (expected_us(1), expected_us(contacts)) else {
            return false;
        };
        let tolerance_us = period_us / 2 + expected_us.abs() / 256;
        match contacts {
            1 => (1..=MOST_PERIODS * period_us).contains(&elapsed_us),
            _ => (expected_us - elapsed_us).abs() <= tolerance_us,
        }
    }

    /// Number of contacts missing in `elapsed_us`, in which the number has advanced by `numbers`. The pace
    /// gives the number of contacts made approximately, the sequence number exactly, modulo 256. If the number
    /// is the next one and contradicts the pace, the foot has paused.
    pub(super) fn missing(self, elapsed_us: i64, numbers: u8) -> i64 {
        let modulo = i64::from(numbers.wrapping_sub(1));
        let Some(made) = self.contacts_in(elapsed_us) else {
            return modulo;
        };
        let difference =
            (i64::from(numbers) - made + NUMBERS / 2).rem_euclid(NUMBERS) - NUMBERS / 2;
        if numbers == 1 && difference.abs() > 2 + made / 256 {
            return 0;
        }
        (made + difference - 1).max(modulo)
    }

    /// Number of contacts made in `elapsed_us`, rounded; `None` if the pace is unknown.
    fn contacts_in(self, elapsed_us: i64) -> Option<i64> {
        let elapsed = i128::from(elapsed_us) * i128::from(self.contacts);
        let period = i128::from(self.elapsed_us);
        let contacts = (elapsed + period / 2).checked_div_euclid(period)?;
        i64::try_from(contacts).ok()
    }
}
