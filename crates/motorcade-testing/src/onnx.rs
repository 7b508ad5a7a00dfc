//! The smallest networks there can be: no network has to come with the tests.

use crate::protobuf::{field, number};

/// `ValueInfoProto`: a name and a tensor of `f32`.
fn tensor(name: &str, shape: &[u64]) -> Vec<u8> {
    let dimensions: Vec<u8> = shape.iter().flat_map(|size| field(1, &number(1, *size))).collect();
    let tensor = [number(1, 1), field(2, &dimensions)].concat();
    [field(1, name.as_bytes()), field(2, &field(1, &tensor))].concat()
}

/// A network that adds a constant of this shape to its input of 32 × 32 px: small as a file, as large in memory as one likes.
pub fn hungry(shape: &[u64]) -> Vec<u8> {
    // TensorProto: dims, data_type 7 (INT64), int64_data, name.
    let sizes: Vec<u8> = shape.iter().flat_map(|size| number(7, *size)).collect();
    let initializer = [number(1, shape.len() as u64), number(2, 7), sizes, field(8, b"shape")].concat();
    let constant = [field(1, b"shape"), field(2, b"large"), field(4, b"ConstantOfShape")].concat();
    let sum = [field(1, b"x0"), field(1, b"large"), field(2, b"y"), field(4, b"Add")].concat();
    let mut graph =
        [field(1, &constant), field(1, &sum), field(2, b"hungry"), field(5, &initializer)].concat();
    graph.extend(field(11, &tensor("x0", &[1, 3, 32, 32])));
    graph.extend(field(12, &tensor("y", shape)));
    [number(1, 8), field(7, &graph), field(8, &number(2, 13))].concat()
}

/// A network that repeats its input of 32 × 32 px so many times along each axis: the size of what comes out is known when it runs.
pub fn tiled(repeats: &[u64; 4]) -> Vec<u8> {
    // TensorProto: dims, data_type 7 (INT64), int64_data, name.
    let values: Vec<u8> = repeats.iter().flat_map(|count| number(7, *count)).collect();
    let initializer = [number(1, 4), number(2, 7), values, field(8, b"repeats")].concat();
    let tile = [field(1, b"x0"), field(1, b"repeats"), field(2, b"y"), field(4, b"Tile")].concat();
    let mut graph = [field(1, &tile), field(2, b"tiled"), field(5, &initializer)].concat();
    let input = [1, 3, 32, 32];
    graph.extend(field(11, &tensor("x0", &input)));
    let output: Vec<u64> = input.iter().zip(repeats).map(|(size, count)| size * count).collect();
    graph.extend(field(12, &tensor("y", &output)));
    [number(1, 8), field(7, &graph), field(8, &number(2, 13))].concat()
}

/// An ONNX file: inputs of these shapes, of which the first comes out as it went in (`Relu`, opset 13).
pub fn network(inputs: &[&[u64]]) -> Vec<u8> {
    let node = [field(1, b"x0"), field(2, b"y"), field(4, b"Relu")].concat();
    let mut graph = [field(1, &node), field(2, b"tiny")].concat();
    for (i, shape) in inputs.iter().enumerate() {
        graph.extend(field(11, &tensor(&format!("x{i}"), shape)));
    }
    graph.extend(field(12, &tensor("y", inputs.first().copied().unwrap_or_default())));
    [number(1, 8), field(7, &graph), field(8, &number(2, 13))].concat()
}
