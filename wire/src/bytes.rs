//! Little-endian reading and writing without panics.

/// Reader that takes fields off the front of a byte slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn i16(&mut self) -> Option<i16> {
        self.array().map(i16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    pub(crate) fn rest(self) -> &'a [u8] {
        self.0
    }

    /// Returns `value` if no bytes are left over. A frame with excess bytes is invalid.
    pub(crate) fn finish<T>(self, value: T) -> Option<T> {
        self.0.is_empty().then_some(value)
    }
}

/// Appends fields to a buffer of fixed size. Fields that do not fit are dropped, and [`Writer::finish`] reports that.
#[derive(Debug)]
pub(crate) struct Writer<'a> {
    rest: &'a mut [u8],
    capacity: usize,
    overflowed: bool,
}

impl<'a> Writer<'a> {
    pub(crate) const fn new(buffer: &'a mut [u8]) -> Self {
        Self { capacity: buffer.len(), rest: buffer, overflowed: false }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        match core::mem::take(&mut self.rest).split_at_mut_checked(bytes.len()) {
            Some((head, rest)) => {
                head.copy_from_slice(bytes);
                self.rest = rest;
            }
            None => self.overflowed = true,
        }
    }

    fn array<const N: usize>(&mut self, bytes: [u8; N]) {
        match core::mem::take(&mut self.rest).split_first_chunk_mut() {
            Some((head, rest)) => {
                *head = bytes;
                self.rest = rest;
            }
            None => self.overflowed = true,
        }
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.array([value]);
    }

    pub(crate) fn u16(&mut self, value: u16) {
        self.array(value.to_le_bytes());
    }

    pub(crate) fn i16(&mut self, value: i16) {
        self.array(value.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.array(value.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, value: u64) {
        self.array(value.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, value: f32) {
        self.array(value.to_le_bytes());
    }

    /// Number of bytes written; `None` if they did not all fit.
    pub(crate) const fn finish(self) -> Option<usize> {
        if self.overflowed { None } else { Some(self.capacity - self.rest.len()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_fields_are_read_back() {
        let mut buffer = [0; 32];
        let mut writer = Writer::new(&mut buffer);
        writer.u8(1);
        writer.u16(0x0302);
        writer.i16(-2);
        writer.u32(0x0706_0504);
        writer.u64(u64::MAX - 1);
        writer.f32(1.5);
        let length = writer.finish().expect("it fits");
        assert_eq!(buffer[..7], [1, 2, 3, 0xFE, 0xFF, 4, 5]);
        let mut reader = Reader::new(&buffer[..length]);
        assert_eq!(reader.u8(), Some(1));
        assert_eq!(reader.u16(), Some(0x0302));
        assert_eq!(reader.i16(), Some(-2));
        assert_eq!(reader.u32(), Some(0x0706_0504));
        assert_eq!(reader.u64(), Some(u64::MAX - 1));
        assert_eq!(reader.f32(), Some(1.5));
        assert_eq!(reader.u8(), None);
    }

    #[test]
    fn a_full_buffer_is_reported() {
        let mut buffer = [0; 3];
        let mut writer = Writer::new(&mut buffer);
        writer.u32(0);
        assert_eq!(writer.finish(), None);
    }
}
