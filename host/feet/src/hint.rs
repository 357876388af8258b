//! Hints of errors and notices.
//!
//! An error names the fault, its place and its values. The remedy may depend on the program that uses this library: the
//! command line names an option or another command, Python an argument. Such an error has a [`FootHint`], which each
//! program expresses in its own words.

/// Remedy for an error or a notice that depends on the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootHint {
    /// Name one of the feet on the line.
    NameOneFoot,
    /// Name this node as a foot, so that its contacts are decoded.
    NameNodeAsFoot(u8),
    /// List the objects of a foot.
    ListObjects,
    /// Switch the self-test at each start off, and store that.
    SwitchSelfTestOff,
    /// Leave out the options of an estimate: they are for recordings of an IMU.
    OmitEstimateOptions,
}
