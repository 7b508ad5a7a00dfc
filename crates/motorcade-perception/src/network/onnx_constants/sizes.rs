//! Bounds of the elements of a result, by operation.

use super::Constant;
use crate::network::onnx_graph::{Node, count};

/// Multiplications at most of one product of matrices.
const MOST_PRODUCTS: u64 = 1 << 33;

/// Elements at most, and the shape where it is known.
pub(super) struct Size {
    pub count: u64,
    pub dims: Option<Vec<u64>>,
}

impl Size {
    fn of(dims: Vec<u64>) -> Self {
        Self { count: count(&dims), dims: Some(dims) }
    }
    fn up_to(count: u64) -> Self {
        Self { count, dims: None }
    }
}

/// A bound of the result; `None` where it hangs on a number that is not known.
pub(super) fn bound(node: &Node<'_>, inputs: &[Option<&Constant>]) -> Option<Size> {
    let input = |k: usize| inputs.get(k).copied().flatten();
    let values = |k: usize| input(k).and_then(|c| c.values.as_deref());
    let sizes = |k: usize| values(k).map(|values| values.iter().map(|v| whole(*v)).collect::<Vec<u64>>());
    let product =
        || inputs.iter().flatten().fold(1, |product: u64, c| product.saturating_mul(c.count.max(1)));
    let sum = || inputs.iter().flatten().fold(0, |sum: u64, c| sum.saturating_add(c.count));
    Some(match node.operator {
        "ConstantOfShape" => Size::of(sizes(0)?),
        "Expand" => {
            let shape = sizes(1)?;
            match &input(0)?.dims {
                Some(dims) => broadcast([dims, &shape]),
                None => Size::up_to(count(&shape).saturating_mul(input(0)?.count.max(1))),
            }
        }
        "Tile" => Size::up_to(input(0)?.count.saturating_mul(count(&sizes(1)?))),
        "Range" => {
            let [from, to, step] = [values(0)?.first()?, values(1)?.first()?, values(2)?.first()?];
            Size::of(vec![whole(((to - from) / step).ceil())])
        }
        "Pad" => {
            let given = node.numbers("pads").map(|pads| pads.iter().map(|p| *p as f64).collect::<Vec<_>>());
            let pads = given.or_else(|| values(1).map(<[f64]>::to_vec))?;
            // A side of d elements grows to at most d (1 + p) by p others.
            let grown = |count: u64, pad: &f64| count.saturating_mul(whole(*pad).saturating_add(1));
            Size::up_to(pads.iter().fold(input(0)?.count.max(1), grown))
        }
        "Resize" | "Upsample" => match sizes(3).filter(|sizes| !sizes.is_empty()) {
            Some(sizes) => Size::of(sizes),
            None => {
                let scales = if node.operator == "Upsample" { values(1)? } else { values(2)? };
                let grown = |count: u64, scale: &f64| count.saturating_mul(whole(scale.ceil()));
                Size::up_to(scales.iter().fold(input(0)?.count, grown))
            }
        },
        "OneHot" => Size::up_to(input(0)?.count.saturating_mul(whole(*values(1)?.first()?))),
        "Reshape" => {
            let shape = values(1).filter(|shape| shape.iter().all(|size| *size > 0.0)).and_then(|_| sizes(1));
            Size {
                count: input(0)?.count,
                dims: shape.filter(|dims| count(dims) == input(0).map_or(0, |c| c.count)),
            }
        }
        "Gather" => {
            let (data, indices) = (input(0)?, input(1)?);
            let axis = node.numbers("axis").and_then(|axis| axis.first().copied()).unwrap_or(0);
            let dims = data.dims.as_deref().unwrap_or_default();
            let axis = if axis < 0 { axis + dims.len() as i64 } else { axis };
            let side = usize::try_from(axis).ok().and_then(|axis| dims.get(axis)).copied().unwrap_or(1);
            Size::up_to((data.count / side.max(1)).saturating_mul(indices.count))
        }
        "MatMul" | "Gemm" | "MatMulInteger" => {
            let inner = input(0)?.dims.as_ref().and_then(|dims| dims.last()).copied().unwrap_or(1).max(1);
            let inner = if node.operator == "Gemm" { 1 } else { inner };
            let result = (input(0)?.count / inner).saturating_mul(input(1)?.count.div_ceil(inner));
            (result.saturating_mul(inner) <= MOST_PRODUCTS).then(|| Size::up_to(result))?
        }
        operator if BROADCAST.contains(&operator) => {
            match inputs.iter().flatten().map(|c| c.dims.as_deref()).collect::<Option<Vec<_>>>() {
                Some(dims) => broadcast(dims),
                None => Size::up_to(product()),
            }
        }
        operator if LIKE.contains(&operator) => Size { count: sum(), dims: input(0)?.dims.clone() },
        operator if operator.starts_with("Reduce") || NO_LARGER.contains(&operator) => {
            Size::up_to(sum().saturating_mul(MOST_DIMENSIONS))
        }
        _ => {
            let numbers = node.all_numbers();
            let grown =
                |count: u64, number: &i64| count.saturating_mul(number.unsigned_abs().saturating_add(1));
            Size::up_to(numbers.iter().fold(product(), grown))
        }
    })
}

/// A size; a negative one is zero, one that is no number too large for everything.
fn whole(value: f64) -> u64 {
    if value.is_nan() { u64::MAX } else { value as u64 }
}

/// Shape of element-wise operations on shapes that fit each other.
fn broadcast<'a>(shapes: impl IntoIterator<Item = &'a (impl AsRef<[u64]> + ?Sized + 'a)> + Clone) -> Size {
    let length = shapes.clone().into_iter().map(|shape| shape.as_ref().len()).max().unwrap_or(0);
    let side = |k: usize| {
        let from_end = |shape: &[u64]| {
            (length - k).checked_sub(1).and_then(|back| shape.iter().rev().nth(back)).copied()
        };
        let sides: Vec<u64> =
            shapes.clone().into_iter().filter_map(|shape| from_end(shape.as_ref())).collect();
        sides.iter().copied().filter(|size| *size != 1).max().unwrap_or(1)
    };
    Size::of((0..length).map(side).collect())
}

/// Dimensions of a tensor at most, for operations that list places.
const MOST_DIMENSIONS: u64 = 8;

/// Element-wise operations on several inputs.
const BROADCAST: [&str; 24] = [
    "Add",
    "And",
    "BitShift",
    "BitwiseAnd",
    "BitwiseOr",
    "BitwiseXor",
    "Div",
    "Equal",
    "Greater",
    "GreaterOrEqual",
    "Less",
    "LessOrEqual",
    "Max",
    "Mean",
    "Min",
    "Mod",
    "Mul",
    "Or",
    "PRelu",
    "Pow",
    "Sub",
    "Sum",
    "Where",
    "Xor",
];

/// Element-wise operations on one.
const LIKE: [&str; 34] = [
    "Abs",
    "Cast",
    "CastLike",
    "Ceil",
    "Clip",
    "Cos",
    "CumSum",
    "DequantizeLinear",
    "Elu",
    "Erf",
    "Exp",
    "EyeLike",
    "Floor",
    "Gelu",
    "HardSigmoid",
    "HardSwish",
    "IsInf",
    "IsNaN",
    "LeakyRelu",
    "Log",
    "LogSoftmax",
    "Neg",
    "Not",
    "QuantizeLinear",
    "Reciprocal",
    "Relu",
    "Round",
    "Sigmoid",
    "Sign",
    "Sin",
    "Softmax",
    "Sqrt",
    "Tanh",
    "Trilu",
];

/// Operations that move, join or drop elements.
const NO_LARGER: [&str; 20] = [
    "ArgMax",
    "ArgMin",
    "BatchNormalization",
    "Compress",
    "Concat",
    "DepthToSpace",
    "Flatten",
    "LayerNormalization",
    "NonZero",
    "ScatterElements",
    "ScatterND",
    "Shape",
    "Size",
    "Slice",
    "SpaceToDepth",
    "Split",
    "Squeeze",
    "TopK",
    "Transpose",
    "Unsqueeze",
];
