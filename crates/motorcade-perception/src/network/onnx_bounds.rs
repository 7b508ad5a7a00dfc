//! Bounds of an ONNX file, checked before an engine reads it: the engine allocates whatever length a field states, and an allocation that
//! fails ends the process.
//!
//! The file is a protobuf message of messages. A field of bytes must end within the message around it; a tensor may not have more
//! elements than its message could hold. The content is left to the engine.

/// Depth of messages in messages: a graph in a branch of a graph takes four levels; the engine follows them by recursion.
const DEEPEST: usize = 64;
/// Elements that a byte of a tensor's message holds at most: of eight bits each two of four.
const ELEMENTS_A_BYTE: u64 = 2;

/// A kind of message, by the fields that are messages themselves.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Message {
    Model,
    Graph,
    Node,
    Attribute,
    Tensor,
    ValueInfo,
    Type,
    TensorType,
    SequenceType,
    Shape,
    /// A message of texts and numbers alone.
    Plain,
}

impl Message {
    /// The kind of message in a field (onnx.proto3, IR version 10); `None` of text, numbers and fields unknown to it.
    fn of_field(self, number: u64) -> Option<Self> {
        Some(match (self, number) {
            (Self::Model, 7) | (Self::Attribute, 6 | 11) => Self::Graph,
            (Self::Model, 8 | 14) | (Self::Tensor, 13) | (Self::Shape, 1) => Self::Plain,
            (Self::Graph, 1) => Self::Node,
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) => Self::Tensor,
            (Self::Graph, 11..=13) => Self::ValueInfo,
            (Self::Node, 5) => Self::Attribute,
            (Self::ValueInfo, 2) | (Self::SequenceType, 1) => Self::Type,
            (Self::Type, 1) => Self::TensorType,
            (Self::Type, 4) => Self::SequenceType,
            (Self::TensorType, 2) => Self::Shape,
            _ => return None,
        })
    }
}

/// Checks an ONNX file.
///
/// # Errors
/// The problem in words, with the byte where it lies.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut reader = Reader { bytes, at: 0 };
    reader.message(Message::Model, bytes.len(), 0)
}

/// A position in the file.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    /// Checks a message that ends at `end`.
    fn message(&mut self, kind: Message, end: usize, depth: usize) -> Result<(), String> {
        if depth > DEEPEST {
            return Err(format!("byte {}: messages within messages, more than {DEEPEST} deep", self.at));
        }
        let begin = self.at;
        let mut elements = Some(1_u64);
        while self.at < end {
            let tag = self.varint(end)?;
            let (number, wire) = (tag >> 3, tag & 7);
            match wire {
                0 => {
                    let value = self.varint(end)?;
                    if (kind, number) == (Message::Tensor, 1) {
                        elements = elements.and_then(|n| n.checked_mul(value));
                    }
                }
                1 => self.skip(8, end)?,
                2 => {
                    let length = self.varint(end)?;
                    let stop = self.end_of(length, end)?;
                    match kind.of_field(number) {
                        Some(inner) => self.message(inner, stop, depth + 1)?,
                        None if (kind, number) == (Message::Tensor, 1) => {
                            while self.at < stop {
                                let value = self.varint(stop)?;
                                elements = elements.and_then(|n| n.checked_mul(value));
                            }
                        }
                        None => self.at = stop,
                    }
                }
                // A group has no length; its fields follow as fields of this message.
                3 | 4 => {}
                5 => self.skip(4, end)?,
                _ => return Err(format!("byte {}: a field of unknown kind {wire}", self.at)),
            }
        }
        let most = ELEMENTS_A_BYTE * (end - begin) as u64;
        if kind == Message::Tensor && elements.is_none_or(|n| n > most) {
            let elements = elements.map_or_else(|| "more than 2^64".to_owned(), |n| n.to_string());
            let bytes = end - begin;
            return Err(format!("byte {begin}: a tensor of {elements} elements in {bytes} bytes"));
        }
        Ok(())
    }

    /// The end of `length` bytes from here on.
    fn end_of(&self, length: u64, end: usize) -> Result<usize, String> {
        let left = end - self.at;
        match usize::try_from(length).ok().filter(|length| *length <= left) {
            Some(length) => Ok(self.at + length),
            None => Err(format!("byte {}: a field of {length} bytes where {left} are left", self.at)),
        }
    }

    fn skip(&mut self, length: u64, end: usize) -> Result<(), String> {
        self.at = self.end_of(length, end)?;
        Ok(())
    }

    /// A number of up to ten bytes of seven bits each, least first.
    fn varint(&mut self, end: usize) -> Result<u64, String> {
        let begin = self.at;
        let mut value = 0_u64;
        for shift in (0..70).step_by(7) {
            let Some(byte) = self.bytes[..end].get(self.at) else {
                return Err(format!("byte {begin}: the file ends within a number"));
            };
            self.at += 1;
            value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(format!("byte {begin}: a number of more than ten bytes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::protobuf::{field, number, varint};

    fn tensor(dims: &[u64], data: usize) -> Vec<u8> {
        let dims: Vec<u8> = dims.iter().flat_map(|d| number(1, *d)).collect();
        field(7, &field(5, &[dims, field(9, &vec![0; data])].concat()))
    }

    #[test]
    fn networks_of_the_program_pass_and_lengths_beyond_the_file_do_not() {
        for bytes in [
            include_bytes!("../../../../models/scene.onnx").as_slice(),
            include_bytes!("../../../../models/vehicle.onnx"),
        ] {
            assert_eq!(check(bytes), Ok(()));
            assert!(check(&bytes[..bytes.len() - 1]).is_err());
        }
        assert_eq!(check(&[]), Ok(()));
        // A name of 32 GB, in a node of a graph.
        let name = [varint(3 << 3 | 2), varint(32 << 30)].concat();
        let problem = check(&field(7, &field(1, &name))).unwrap_err();
        assert!(problem.contains("a field of 34359738368 bytes where 0 are left"), "{problem}");
        // A name that fits into the file but not into its node.
        let long = [varint(3 << 3 | 2), varint(20)].concat();
        let file = [field(7, &field(1, &long)), vec![0; 64]].concat();
        assert!(check(&file).unwrap_err().contains("where 0 are left"));
    }

    #[test]
    fn tensors_have_no_more_elements_than_their_bytes_hold() {
        assert_eq!(check(&tensor(&[2, 3], 24)), Ok(()));
        assert_eq!(check(&tensor(&[], 4)), Ok(()));
        assert_eq!(check(&tensor(&[0, 1 << 62], 0)), Ok(()));
        assert!(check(&tensor(&[1 << 20, 1 << 20], 24)).unwrap_err().contains("1099511627776 elements"));
        assert!(check(&tensor(&[1 << 40, 1 << 40], 24)).unwrap_err().contains("2^64"));
        // Dimensions as one packed field are bounded too.
        let dims: Vec<u8> = [1 << 20, 1 << 20].iter().flat_map(|d| varint(*d)).collect();
        assert!(check(&field(7, &field(5, &field(1, &dims)))).is_err());
    }

    #[test]
    fn graphs_within_graphs_end_somewhere() {
        let nested = |levels: usize| {
            let graph = (0..levels).fold(Vec::new(), |inner, _| field(1, &field(5, &field(6, &inner))));
            check(&field(7, &graph))
        };
        assert_eq!(nested(10), Ok(()));
        assert!(nested(1000).unwrap_err().contains("deep"));
        assert!(check(&[0xff; 30]).unwrap_err().contains("ten bytes"));
        assert!(check(&[0x0f]).unwrap_err().contains("unknown kind 7"));
    }
}
