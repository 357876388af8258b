//! Text that a foot does not use.

/// Text for people and files. A foot does not use it: on a microcontroller it is empty and takes
/// no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text(#[cfg(not(target_os = "none"))] &'static str);

impl Text {
    pub(super) const NONE: Self = Self::new("");

    #[cfg(not(target_os = "none"))]
    pub(super) const fn new(text: &'static str) -> Self {
        Self(text)
    }

    #[cfg(target_os = "none")]
    pub(super) const fn new(_: &'static str) -> Self {
        Self()
    }

    /// The text.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        #[cfg(not(target_os = "none"))]
        return self.0;
        #[cfg(target_os = "none")]
        return "";
    }
}

impl core::ops::Deref for Text {
    type Target = str;

    fn deref(&self) -> &str {
        self.as_str()
    }
}

impl core::fmt::Display for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.as_str())
    }
}
