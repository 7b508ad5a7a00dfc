//! Fields of protobuf messages, byte by byte: no network has to come with the tests.

/// A whole number of any length, seven bits a byte.
pub fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field that holds a whole number.
pub fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

/// A field that holds bytes: text, or another message.
pub fn field(number: u64, content: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(content.len() as u64), content.to_vec()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_as_the_format_has_them() {
        // The examples of the protobuf documentation: field 1 is 150, field 2 is "testing".
        assert_eq!(number(1, 150), [0x08, 0x96, 0x01]);
        assert_eq!(field(2, b"testing"), [[0x12, 0x07].as_slice(), b"testing"].concat());
    }
}
