//! Elements of short lists: shapes, repeats and scales are computed in a few operations.

use super::Constant;
use crate::network::onnx_graph::{MOST_VALUES, Node, count};

/// A list of numbers.
pub(super) fn list(values: Vec<f64>) -> Constant {
    let count = values.len() as u64;
    Constant { count, dims: Some(vec![count]), values: Some(values) }
}

/// The result of an operation on short lists; `None` of other operations and of what is not known.
pub(super) fn computed(node: &Node<'_>, inputs: &[Option<&Constant>]) -> Option<Constant> {
    let values = |k: usize| inputs.get(k).copied().flatten().and_then(|c| c.values.as_deref());
    // A list has one dimension, a number none.
    let flat = |k: usize| {
        let dims = inputs.get(k).copied().flatten()?.dims.as_deref()?;
        (dims.len() <= 1).then(|| values(k)).flatten()
    };
    let first = inputs.first().copied().flatten();
    let out = match node.operator {
        "Identity" => return first.cloned(),
        "Shape" if node.all_numbers().is_empty() => {
            first?.dims.as_ref()?.iter().map(|size| *size as f64).collect()
        }
        "Size" => vec![count(first?.dims.as_ref()?) as f64],
        "Cast" => {
            let to_real = matches!(node.numbers("to")?.first()?, 1 | 10 | 11 | 16);
            let values = flat(0)?.iter().map(|v| if to_real { *v } else { v.trunc() }).collect();
            return Some(Constant { values: Some(values), ..first?.clone() });
        }
        "Unsqueeze" | "Squeeze" | "Flatten" if first?.count == 1 => values(0)?.to_vec(),
        "Squeeze" | "Unsqueeze" => {
            // The numbers stay, their shape is not followed.
            let values = flat(0)?.to_vec();
            return Some(Constant { count: values.len() as u64, dims: None, values: Some(values) });
        }
        "Concat" => (0..inputs.len()).map(flat).collect::<Option<Vec<_>>>()?.concat(),
        "Gather" => {
            let data = flat(0)?;
            let at = |index: &f64| {
                let index = if *index < 0.0 { index + data.len() as f64 } else { *index };
                (index >= 0.0).then(|| data.get(index as usize).copied()).flatten()
            };
            flat(1)?.iter().map(at).collect::<Option<_>>()?
        }
        "Slice" if inputs.len() < 5 => {
            let data = flat(0)?;
            let end = data.len() as f64;
            let place = |v: f64| (if v < 0.0 { v + end } else { v }).clamp(0.0, end) as usize;
            let (from, to) = (place(*flat(1)?.first()?), place(*flat(2)?.first()?));
            data.get(from..to).unwrap_or_default().to_vec()
        }
        "Neg" => flat(0)?.iter().map(|v| -v).collect(),
        "Floor" => flat(0)?.iter().map(|v| v.floor()).collect(),
        "Ceil" => flat(0)?.iter().map(|v| v.ceil()).collect(),
        "ReduceProd" if inputs.len() == 1 => vec![flat(0)?.iter().product()],
        "ConstantOfShape" => {
            let shape = values(0)?;
            let total: f64 = shape.iter().product();
            let fill =
                node.tensor("value").and_then(|t| t.values).map_or(Some(0.0), |v| v.first().copied())?;
            let few = shape.len() <= 1 && (0.0..=MOST_VALUES as f64).contains(&total);
            few.then(|| vec![fill; total as usize])?
        }
        "Add" | "Sub" | "Mul" | "Div" | "Min" | "Max" if inputs.len() == 2 => {
            pairs(node.operator, flat(0)?, flat(1)?)?
        }
        _ => return None,
    };
    (out.len() <= MOST_VALUES).then(|| list(out))
}

/// Numbers of two lists, of which one may be a single number.
fn pairs(operator: &str, left: &[f64], right: &[f64]) -> Option<Vec<f64>> {
    let length = if left.len() == 1 { right.len() } else { left.len() };
    let at =
        |list: &[f64], k: usize| if list.len() == 1 { list.first().copied() } else { list.get(k).copied() };
    let fits = [left, right].iter().all(|list| list.len() == 1 || list.len() == length);
    let one = |k: usize| {
        let (a, b) = (at(left, k)?, at(right, k)?);
        Some(match operator {
            "Add" => a + b,
            "Sub" => a - b,
            "Mul" => a * b,
            "Div" => a / b,
            "Min" => a.min(b),
            _ => a.max(b),
        })
    };
    fits.then(|| (0..length).map(one).collect()).flatten()
}
