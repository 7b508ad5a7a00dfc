//! Common Data Representation as ROS 2 writes it (OMG CORBA 3.1, 15.3; little endian): numbers are aligned to their size.

/// Representation header: plain CDR, little endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message that is being written.
pub(crate) struct Cdr {
    bytes: Vec<u8>,
}

impl Cdr {
    pub(crate) fn new() -> Self {
        Self { bytes: HEADER.to_vec() }
    }

    /// The message.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Places are counted behind the header.
    fn align(&mut self, size: usize) {
        let at = self.bytes.len() - HEADER.len();
        self.bytes.resize(HEADER.len() + at.next_multiple_of(size), 0);
    }

    pub(crate) fn bool(&mut self, value: bool) {
        self.bytes.push(u8::from(value));
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn i32(&mut self, value: i32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, value: f32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    /// An array of a fixed length.
    pub(crate) fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.f64(*value));
    }

    /// Number of the elements that follow.
    pub(crate) fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).unwrap_or(u32::MAX));
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.length(bytes.len());
        self.bytes.extend_from_slice(bytes);
    }

    /// Text with the zero at its end, which counts.
    pub(crate) fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_behind_the_header() {
        let mut out = Cdr::new();
        out.text("abc");
        out.bool(true);
        out.f64(1.0);
        out.u32(7);
        let mut expected = vec![0, 1, 0, 0];
        expected.extend([4, 0, 0, 0, b'a', b'b', b'c', 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        expected.extend(1.0_f64.to_le_bytes());
        expected.extend([7, 0, 0, 0]);
        assert_eq!(out.into_bytes(), expected);
    }
}
