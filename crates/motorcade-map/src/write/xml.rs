//! XML with indented elements.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// A document in memory. Texts and attributes are escaped.
pub(super) struct Xml {
    writer: Writer<Vec<u8>>,
}

/// Writing to memory does not fail.
fn done(result: std::io::Result<()>) {
    debug_assert!(result.is_ok(), "writing to memory");
}

impl Xml {
    pub(super) fn new() -> Self {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 1);
        done(writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None))));
        Self { writer }
    }

    /// An element around what `fill` writes.
    pub(super) fn element(&mut self, name: &str, attributes: &[(&str, &str)], fill: impl FnOnce(&mut Self)) {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        done(self.writer.write_event(Event::Start(start)));
        fill(self);
        done(self.writer.write_event(Event::End(BytesEnd::new(name))));
    }

    /// Elements inside each other around what `fill` writes.
    pub(super) fn nested(&mut self, names: &[&str], fill: impl FnOnce(&mut Self)) {
        for name in names {
            done(self.writer.write_event(Event::Start(BytesStart::new(*name))));
        }
        fill(self);
        for name in names.iter().rev() {
            done(self.writer.write_event(Event::End(BytesEnd::new(*name))));
        }
    }

    /// An element without content.
    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        done(self.writer.write_event(Event::Empty(start)));
    }

    /// An element with a text.
    pub(super) fn text(&mut self, name: &str, text: &str) {
        done(self.writer.write_event(Event::Start(BytesStart::new(name))));
        done(self.writer.write_event(Event::Text(BytesText::new(text))));
        done(self.writer.write_event(Event::End(BytesEnd::new(name))));
    }

    pub(super) fn finish(self) -> String {
        let mut text = String::from_utf8(self.writer.into_inner()).unwrap_or_default();
        text.push('\n');
        text
    }
}
