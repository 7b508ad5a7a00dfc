//! Buffers that are reused from frame to frame.

/// Empties a buffer and lets it take `count` values without growing.
pub(crate) fn make_room<T>(buffer: &mut Vec<T>, count: usize) {
    buffer.clear();
    buffer.reserve(count);
}
