//! Size of what an engine computes from the constants of an ONNX file while it prepares it: a shape in the file can ask for any amount of
//! memory, and an allocation that fails ends the process.
//!
//! Operations of which every input is constant are followed: the elements of each result are bounded by the shapes of the inputs and,
//! where a number decides the size, by the number. Of operations on the picture, whose sizes are known when it comes, those are checked that
//! repeat it as often as a constant says.

mod sizes;
mod values;

use std::collections::BTreeMap;

use super::onnx_graph::{Graph, Node, Tensor, count, of_model};

/// Elements of all computed constants together, at four bytes each 128 MiB.
const MOST_ELEMENTS: u64 = 1 << 25;

/// Elements of one result of an operation on the picture, at four bytes each 1 GiB.
const MOST_REPEATED: u64 = 1 << 28;

/// A value that does not depend on the picture.
#[derive(Clone, Debug)]
struct Constant {
    /// Elements at most.
    count: u64,
    /// Shape, where it is known.
    dims: Option<Vec<u64>>,
    /// Elements, where they are few and known.
    values: Option<Vec<f64>>,
}

impl From<Tensor> for Constant {
    fn from(tensor: Tensor) -> Self {
        Self { count: count(&tensor.dims), dims: Some(tensor.dims), values: tensor.values }
    }
}

/// Checks that an ONNX file, of which the lengths were checked, does not ask for more than fits.
///
/// # Errors
/// The operation and its elements, in words.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut elements = 0;
    check_graph(&of_model(bytes), &BTreeMap::new(), &mut elements)
}

/// Constants by name.
type Constants<'a> = BTreeMap<&'a str, Constant>;

/// Checks a graph within which the constants `outer` can be used.
fn check_graph<'a>(graph: &Graph<'a>, outer: &Constants<'a>, elements: &mut u64) -> Result<(), String> {
    let mut known = outer.clone();
    known.extend(graph.constants.iter().map(|(name, tensor)| (*name, Constant::from(tensor.clone()))));
    let shapes: BTreeMap<&str, &Vec<u64>> = graph.inputs.iter().map(|(name, dims)| (*name, dims)).collect();
    // Operations wait for their inputs: the file need not have them in order.
    let mut waiting: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    let mut missing = vec![0_usize; graph.nodes.len()];
    let mut ready = Vec::new();
    for (index, node) in graph.nodes.iter().enumerate() {
        for input in node.inputs.iter().filter(|name| !name.is_empty() && !known.contains_key(*name)) {
            if node.operator == "Shape" && shapes.contains_key(input) {
                continue;
            }
            waiting.entry(input).or_default().push(index);
            missing[index] += 1;
        }
        if missing[index] == 0 {
            ready.push(index);
        }
    }
    while let Some(index) = ready.pop() {
        let node = &graph.nodes[index];
        let Some(result) = result(node, &known, &shapes, *elements)? else { continue };
        if node.operator != "Constant" {
            *elements = elements.saturating_add(result.count);
        }
        if *elements > MOST_ELEMENTS {
            return Err(format!(
                "{} asks for {} elements, computed from constants; at most {MOST_ELEMENTS} in all are computed",
                described(node),
                result.count
            ));
        }
        for output in node.outputs.iter().filter(|name| !name.is_empty()) {
            if known.insert(output, result.clone()).is_none() {
                for waiter in waiting.remove(output).into_iter().flatten() {
                    missing[waiter] -= 1;
                    if missing[waiter] == 0 {
                        ready.push(waiter);
                    }
                }
            }
        }
    }
    graph.nodes.iter().try_for_each(|node| check_repeated(node, &known))?;
    graph.nodes.iter().flat_map(Node::graphs).try_for_each(|inner| check_graph(&inner, &known, elements))
}

/// Checks how often a constant repeats what depends on the picture: the result has as many elements at least.
fn check_repeated(node: &Node<'_>, known: &Constants<'_>) -> Result<(), String> {
    let Some(picture) = node.inputs.first().filter(|input| !known.contains_key(*input)) else {
        return Ok(());
    };
    if picture.is_empty() || !matches!(node.operator, "Expand" | "Tile" | "Resize" | "Upsample") {
        return Ok(());
    }
    let one = Constant { count: 1, dims: None, values: None };
    let inputs: Vec<Option<&Constant>> =
        std::iter::once(Some(&one)).chain(node.inputs[1..].iter().map(|name| known.get(name))).collect();
    match sizes::bound(node, &inputs).filter(|size| size.count > MOST_REPEATED) {
        Some(size) => Err(format!(
            "{} asks for {} elements or more; at most {MOST_REPEATED} are computed",
            described(node),
            size.count
        )),
        None => Ok(()),
    }
}

/// An operation in words.
fn described(node: &Node<'_>) -> String {
    let output = node.outputs.iter().find(|name| !name.is_empty()).unwrap_or(&"");
    // Names come from the file and may be long.
    let (operator, output) = (node.operator, output.chars().take(60).collect::<String>());
    format!("the operation {} of '{output}'", operator.chars().take(60).collect::<String>())
}

/// The result of an operation on constants; `None` of one that is not computed before the picture comes.
fn result<'a>(
    node: &Node<'a>,
    known: &Constants<'a>,
    shapes: &BTreeMap<&str, &Vec<u64>>,
    elements: u64,
) -> Result<Option<Constant>, String> {
    if node.operator == "Constant" {
        let named = ["value", "value_int", "value_ints", "value_float", "value_floats"];
        return Ok(named.iter().find_map(|name| node.tensor(name)).map(Constant::from));
    }
    if node.operator == "Shape"
        && let Some(dims) = node.inputs.first().and_then(|input| shapes.get(input))
    {
        return Ok(Some(values::list(dims.iter().map(|size| *size as f64).collect())));
    }
    // Absent inputs keep their place.
    let inputs: Vec<Option<&Constant>> = node.inputs.iter().map(|name| known.get(name)).collect();
    let random = node.operator.starts_with("Random") || matches!(node.operator, "Bernoulli" | "Multinomial");
    if random || inputs.iter().all(Option::is_none) {
        return Ok(None);
    }
    if matches!(node.operator, "Loop" | "Scan" | "SequenceMap") {
        return Err(format!("{} runs over constants; export the network with its result", described(node)));
    }
    if node.operator == "If" {
        // One of its branches, which are checked by themselves.
        return Ok(Some(Constant { count: elements.max(1), dims: None, values: None }));
    }
    if let Some(values) = values::computed(node, &inputs) {
        return Ok(Some(values));
    }
    let Some(size) = sizes::bound(node, &inputs) else {
        return Err(format!(
            "{} has a size that is computed from constants in a way that is not followed; export the network with the result",
            described(node)
        ));
    };
    Ok(Some(Constant { count: size.count, dims: size.dims, values: None }))
}

#[cfg(test)]
mod tests;
