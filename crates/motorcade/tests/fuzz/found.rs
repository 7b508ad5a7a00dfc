//! Inputs of the kind that once made a reader panic, end the process or take too long.

/// A bitmap of 200,000 by 200,000 pixels without one of them. The test once ended by a request for 135 GB beside two readers, of which that of
/// pictures had lost its limit; the input itself was not kept, this one is made like it.
const HUGE_BITMAP: &[u8] = b"BM6\x00\x00\x00\x00\x00\x00\x006\x00\x00\x00(\x00\x00\x00@\x0d\x03\x00@\x0d\x03\x00\x01\x00\x18\x00\x00\x00\x00\x00\x00\x00\x00\x00\x13\x0b\x00\x00\x13\x0b\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00";

/// A network whose node has a name of 32 GB, of which no byte is there: the engine allocated them, which ends the process.
const LONG_NAME: &[u8] = b"\x3a\x09\x0a\x07\x1a\x80\x80\x80\x80\x80\x01";

/// Those of a reader: name of the file and content.
pub fn of(reader: &str) -> Vec<(&'static str, &'static [u8])> {
    match reader {
        "pictures" => vec![("huge/000000.bmp", HUGE_BITMAP)],
        "networks" => vec![("n/tiny.onnx", LONG_NAME)],
        _ => Vec::new(),
    }
}
