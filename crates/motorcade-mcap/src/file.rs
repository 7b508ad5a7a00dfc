//! The MCAP file.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::WriteOptions;
use mcap::records::MessageHeader;

use crate::error::Error;

/// A file whose messages are numbered in the order in which they are put.
pub(crate) struct MessageFile<W: Write + Seek> {
    writer: mcap::Writer<W>,
    /// Number of the next message.
    sequence: u32,
}

/// Schema of a channel.
pub(crate) struct Schema<'a> {
    pub(crate) name: &'a str,
    /// Encoding of `text`: `protobuf`, `jsonschema`, `ros2msg`.
    pub(crate) encoding: &'a str,
    pub(crate) text: &'a [u8],
    /// Encoding of messages: `protobuf`, `json`, `cdr`.
    pub(crate) messages: &'a str,
}

impl<W: Write + Seek> MessageFile<W> {
    /// Begins a file; `profile` is `ros2` or empty.
    pub(crate) fn begin(writer: W, profile: &str) -> Result<Self, Error> {
        // Pictures are nearly all of it, and they are compressed already.
        let options = WriteOptions::new().compression(None).profile(profile);
        let options = options.library(concat!("motorcade ", env!("CARGO_PKG_VERSION")));
        Ok(Self { writer: options.create(writer)?, sequence: 0 })
    }

    /// Adds a channel.
    pub(crate) fn channel(&mut self, topic: &str, schema: &Schema<'_>) -> Result<u16, Error> {
        let id = self.writer.add_schema(schema.name, schema.encoding, schema.text)?;
        Ok(self.writer.add_channel(id, topic, schema.messages, &BTreeMap::new())?)
    }

    /// Writes a message; times before zero are at zero.
    pub(crate) fn put(&mut self, channel_id: u16, time_ns: i64, bytes: &[u8]) -> Result<(), Error> {
        let time = u64::try_from(time_ns).unwrap_or(0);
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence = self.sequence.wrapping_add(1);
        Ok(self.writer.write_to_known_channel(&header, bytes)?)
    }

    /// Ends the file.
    pub(crate) fn finish(mut self) -> Result<W, Error> {
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}
