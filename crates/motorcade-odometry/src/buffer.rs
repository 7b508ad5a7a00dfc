//! Buffers that are reused from frame to frame.

/// Empties a buffer and reserves room for `count` values.
pub(crate) fn make_room<T>(buffer: &mut Vec<T>, count: usize) {
    buffer.clear();
    buffer.reserve(count);
}
