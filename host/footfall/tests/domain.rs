//! Domains of DDS for tests, which may run several at a time on one machine.

use std::fs::{self, File};
use std::{env, process};

/// Domains whose ports are below those that the system gives to others: 7400 + 250 per domain.
const DOMAINS: u32 = 100;

/// A domain that no other test of this machine uses until this is dropped.
pub struct Domain {
    pub id: u16,
    _lock: File,
}

impl Domain {
    /// Takes a domain that is free.
    pub fn take() -> Self {
        let folder = env::temp_dir().join("footfall-dds-domains");
        fs::create_dir_all(&folder).expect("a folder");
        let ids = (0..DOMAINS).map(|turn| 1 + (process::id() + turn) % DOMAINS);
        let mut free = ids.filter_map(|id| {
            // A file of another user counts as taken.
            let lock = File::create(folder.join(id.to_string())).ok()?;
            lock.try_lock().ok()?;
            Some(Self { id: id as u16, _lock: lock })
        });
        free.next().expect("a free domain")
    }
}
