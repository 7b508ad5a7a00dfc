//! Nodes and constants of an ONNX file, read without copying. Lengths were checked before (`onnx_bounds.rs`); what does not read is left out.

/// Elements of a tensor that are read: shapes, repeats and scales have fewer.
pub(super) const MOST_VALUES: usize = 1024;

/// A graph: the network itself, or a branch.
#[derive(Default)]
pub(super) struct Graph<'a> {
    pub nodes: Vec<Node<'a>>,
    /// Constants by name.
    pub constants: Vec<(&'a str, Tensor)>,
    /// Inputs of which all dimensions are stated, as constants are.
    pub inputs: Vec<(&'a str, Vec<u64>)>,
}

/// An operation.
#[derive(Default)]
pub(super) struct Node<'a> {
    pub inputs: Vec<&'a str>,
    pub outputs: Vec<&'a str>,
    pub operator: &'a str,
    attributes: Vec<(&'a str, &'a [u8])>,
}

/// Shape and, where they are few, elements of a constant.
#[derive(Clone, Debug, Default)]
pub(super) struct Tensor {
    pub dims: Vec<u64>,
    pub values: Option<Vec<f64>>,
}

/// Content of a field.
enum Content<'a> {
    Number(u64),
    Bytes(&'a [u8]),
}

/// Fields of a message of which the lengths were checked.
fn fields(bytes: &[u8]) -> impl Iterator<Item = (u64, Content<'_>)> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        loop {
            let tag = varint(&mut rest)?;
            let (number, length) = match tag & 7 {
                0 => return Some((tag >> 3, Content::Number(varint(&mut rest)?))),
                1 => (tag >> 3, 8),
                2 => (tag >> 3, usize::try_from(varint(&mut rest)?).ok()?),
                5 => (tag >> 3, 4),
                // A group has no length; its fields follow as fields of this message.
                _ => continue,
            };
            let (content, after) = rest.split_at_checked(length)?;
            rest = after;
            return Some((number, Content::Bytes(content)));
        }
    })
}

/// A number of seven bits a byte, least first; `None` at the end.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for shift in (0..70).step_by(7) {
        let (byte, after) = rest.split_first()?;
        *rest = after;
        value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

/// Appends the whole numbers of a repeated field, packed or not.
fn extend_numbers(into: &mut Vec<u64>, content: &Content<'_>) {
    match content {
        Content::Number(value) => into.push(*value),
        Content::Bytes(bytes) => {
            let mut rest = *bytes;
            while into.len() <= MOST_VALUES
                && let Some(value) = varint(&mut rest)
            {
                into.push(value);
            }
        }
    }
}

/// The graph of a file.
pub(super) fn of_model(bytes: &[u8]) -> Graph<'_> {
    let graph = fields(bytes).filter(|(number, _)| *number == 7);
    graph.last().map_or_else(Graph::default, |(_, content)| Graph::read(&content))
}

impl<'a> Graph<'a> {
    fn read(content: &Content<'a>) -> Self {
        let mut graph = Self::default();
        let Content::Bytes(bytes) = content else { return graph };
        for (number, content) in fields(bytes) {
            let Content::Bytes(bytes) = content else { continue };
            match number {
                1 => graph.nodes.push(Node::read(bytes)),
                5 => {
                    if let (Some(name), tensor) = Tensor::read(bytes) {
                        graph.constants.push((name, tensor));
                    }
                }
                11 => graph.inputs.extend(stated_shape(bytes)),
                _ => {}
            }
        }
        graph
    }
}

impl<'a> Node<'a> {
    fn read(bytes: &'a [u8]) -> Self {
        let mut node = Self::default();
        for (number, content) in fields(bytes) {
            let Content::Bytes(bytes) = content else { continue };
            let word = std::str::from_utf8(bytes).unwrap_or("");
            match number {
                1 => node.inputs.push(word),
                2 => node.outputs.push(word),
                4 => node.operator = word,
                5 => {
                    let name = fields(bytes).filter(|(number, _)| *number == 1).last();
                    let name = name.and_then(|(_, content)| match content {
                        Content::Bytes(name) => std::str::from_utf8(name).ok(),
                        Content::Number(_) => None,
                    });
                    node.attributes.extend(name.map(|name| (name, bytes)));
                }
                _ => {}
            }
        }
        node
    }

    fn attribute(&self, name: &str) -> Option<&'a [u8]> {
        self.attributes.iter().find(|(own, _)| *own == name).map(|(_, bytes)| *bytes)
    }

    /// Whole numbers of an attribute, one or a list.
    pub fn numbers(&self, name: &str) -> Option<Vec<i64>> {
        self.attribute(name).map(numbers)
    }

    /// Whole numbers of all attributes.
    pub fn all_numbers(&self) -> Vec<i64> {
        self.attributes.iter().flat_map(|(_, bytes)| numbers(bytes)).collect()
    }

    /// The constant that an attribute is: a tensor, or numbers.
    pub fn tensor(&self, name: &str) -> Option<Tensor> {
        let mut found = None;
        let mut floats = Vec::new();
        for (number, content) in fields(self.attribute(name)?) {
            match (number, content) {
                (5, Content::Bytes(bytes)) => found = Some(Tensor::read(bytes).1),
                (2 | 7, Content::Bytes(bytes)) => floats.extend(f32s(bytes)),
                _ => {}
            }
        }
        if found.is_none() {
            let whole = numbers(self.attribute(name)?);
            let values: Vec<f64> =
                if floats.is_empty() { whole.iter().map(|v| *v as f64).collect() } else { floats };
            found = Some(Tensor { dims: vec![values.len() as u64], values: Some(values) });
        }
        found
    }

    /// Graphs in attributes: branches, bodies of loops.
    pub fn graphs(&self) -> impl Iterator<Item = Graph<'a>> + '_ {
        let inner = self.attributes.iter().flat_map(|(_, bytes)| fields(bytes));
        inner.filter(|(number, _)| matches!(number, 6 | 11)).map(|(_, content)| Graph::read(&content))
    }
}

fn numbers(attribute: &[u8]) -> Vec<i64> {
    let mut out = Vec::new();
    for (number, content) in fields(attribute) {
        if matches!(number, 3 | 8) {
            extend_numbers(&mut out, &content);
        }
    }
    out.into_iter().map(|v| v as i64).collect()
}

fn f32s(bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
    bytes.as_chunks::<4>().0.iter().map(|four| f64::from(f32::from_le_bytes(*four)))
}

impl Tensor {
    /// Name and tensor.
    fn read(bytes: &[u8]) -> (Option<&str>, Self) {
        let (mut name, mut dims, mut kind) = (None, Vec::new(), 0);
        let (mut whole, mut raw, mut floats): (Vec<u64>, &[u8], Vec<f64>) = (Vec::new(), &[], Vec::new());
        for (number, content) in fields(bytes) {
            match (number, content) {
                (1, content) => extend_numbers(&mut dims, &content),
                (2, Content::Number(value)) => kind = value,
                (4, Content::Bytes(bytes)) => floats.extend(f32s(bytes).take(MOST_VALUES + 1)),
                (5 | 7, content) => extend_numbers(&mut whole, &content),
                (8, Content::Bytes(bytes)) => name = std::str::from_utf8(bytes).ok(),
                (9, Content::Bytes(bytes)) => raw = bytes,
                _ => {}
            }
        }
        let count = count(&dims);
        let few = usize::try_from(count).ok().filter(|count| *count <= MOST_VALUES);
        let values = few.and_then(|count| {
            let found: Vec<f64> = match (kind, raw.is_empty()) {
                (1, true) => floats,
                (1, false) => f32s(raw).take(count).collect(),
                (6 | 7, true) => whole.iter().map(|v| *v as i64 as f64).collect(),
                (6, false) => raw.as_chunks().0.iter().map(|b| f64::from(i32::from_le_bytes(*b))).collect(),
                (7, false) => raw.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f64).collect(),
                (11, false) => raw.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
                _ => Vec::new(),
            };
            (found.len() == count).then_some(found)
        });
        (name, Self { dims, values })
    }
}

/// Elements of a shape; the largest number where they are more.
pub(super) fn count(dims: &[u64]) -> u64 {
    dims.iter().fold(1, |product: u64, size| product.saturating_mul(*size))
}

/// Name and shape of an input, where every dimension is a number.
fn stated_shape(value_info: &[u8]) -> Option<(&str, Vec<u64>)> {
    fn inner(bytes: &[u8], wanted: u64) -> impl Iterator<Item = &[u8]> {
        fields(bytes).filter_map(move |(number, content)| match content {
            Content::Bytes(bytes) if number == wanted => Some(bytes),
            _ => None,
        })
    }
    let name = inner(value_info, 1).last().and_then(|name| std::str::from_utf8(name).ok())?;
    let shape = inner(inner(inner(value_info, 2).last()?, 1).last()?, 2).last()?;
    let size = |dimension: &[u8]| {
        let stated = fields(dimension).filter(|(number, _)| *number == 1).last();
        stated.and_then(|(_, content)| match content {
            Content::Number(size) => Some(size),
            Content::Bytes(_) => None,
        })
    };
    Some((name, inner(shape, 1).map(size).collect::<Option<_>>()?))
}
