use motorcade_testing::protobuf::{field, number};

use super::*;

/// A constant of whole numbers in a graph.
fn whole(name: &str, values: &[i64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|v| number(7, *v as u64)).collect();
    field(5, &[number(1, values.len() as u64), number(2, 7), data, field(8, name.as_bytes())].concat())
}

/// A constant of real numbers, as raw bytes.
fn real(name: &str, values: &[f32]) -> Vec<u8> {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let dims = number(1, values.len() as u64);
    field(5, &[dims, number(2, 1), field(8, name.as_bytes()), field(9, &raw)].concat())
}

/// An operation: "output = Operator input input".
fn node(text: &str) -> Vec<u8> {
    node_with(text, &[])
}

fn node_with(text: &str, attributes: &[u8]) -> Vec<u8> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let inputs: Vec<u8> = words[3..].iter().flat_map(|w| field(1, w.trim_matches('-').as_bytes())).collect();
    field(
        1,
        &[inputs, field(2, words[0].as_bytes()), field(4, words[2].as_bytes()), attributes.to_vec()].concat(),
    )
}

fn checked(parts: &[Vec<u8>]) -> Result<(), String> {
    let model = field(7, &parts.concat());
    assert_eq!(super::super::onnx_bounds::check(&model), Ok(()));
    check(&model)
}

const MILLION: i64 = 1_000_000;

#[test]
fn sizes_that_a_constant_states_are_bounded() {
    let one = || real("one", &[1.0]);
    for (parts, operator) in [
        (vec![whole("s", &[MILLION, MILLION]), node("y = ConstantOfShape s")], "ConstantOfShape"),
        (vec![one(), whole("s", &[MILLION, MILLION]), node("y = Expand one s")], "Expand"),
        (vec![one(), whole("s", &[MILLION * MILLION]), node("y = Tile one s")], "Tile"),
        (
            vec![
                whole("a", &[0]),
                whole("b", &[MILLION * MILLION]),
                whole("c", &[1]),
                node("y = Range a b c"),
            ],
            "Range",
        ),
        (vec![real("a", &[0.0]), real("b", &[1e12]), real("c", &[1e-9]), node("y = Range a b c")], "Range"),
        (vec![one(), whole("p", &[0, MILLION * MILLION]), node("y = Pad one p")], "Pad"),
        (vec![one(), real("s", &[1e12]), node("y = Resize one - s")], "Resize"),
        (vec![one(), whole("s", &[MILLION * MILLION]), node("y = Resize one - - s")], "Resize"),
        (vec![one(), real("s", &[1e12]), node("y = Upsample one s")], "Upsample"),
        (
            vec![
                whole("i", &[0]),
                whole("d", &[MILLION * MILLION]),
                real("v", &[0.0, 1.0]),
                node("y = OneHot i d v"),
            ],
            "OneHot",
        ),
    ] {
        let problem = checked(&parts).unwrap_err();
        assert!(problem.contains(&format!("the operation {operator} of 'y' asks for")), "{problem}");
    }
    // Small ones pass.
    for parts in [
        vec![whole("s", &[1, 3, 32, 32]), node("y = ConstantOfShape s")],
        vec![one(), whole("s", &[80, 80]), node("y = Expand one s")],
        vec![whole("a", &[0]), whole("b", &[8400]), whole("c", &[1]), node("y = Range a b c")],
        vec![one(), real("s", &[2.0]), node("y = Resize one - s")],
    ] {
        assert_eq!(checked(&parts), Ok(()));
    }
}

#[test]
fn sizes_that_are_computed_are_followed() {
    let thousand = || whole("k", &[1000]);
    // 10^12 by a product, in the wrong order of the file, and of many that are small alone.
    let steps = ["b = Mul a a", "a = Mul k k", "c = Concat b k", "y = ConstantOfShape c"].map(node);
    assert!(checked(&[vec![thousand()], steps.to_vec()].concat()).unwrap_err().contains("ConstantOfShape"));
    // A column and a row of a million each: their sum has 10^12.
    let parts = [
        whole("r", &[1, MILLION]),
        whole("c", &[MILLION, 1]),
        node("a = ConstantOfShape r"),
        node("b = ConstantOfShape c"),
        node("y = Add a b"),
    ];
    assert!(
        checked(&parts).unwrap_err().contains("the operation Add of 'y' asks for 1000000000000 elements")
    );
    let many: Vec<Vec<u8>> = (0..40).map(|k| node(&format!("y{k} = ConstantOfShape s"))).collect();
    assert!(checked(&[vec![whole("s", &[MILLION])], many].concat()).unwrap_err().contains("in all"));
    // A size that is not followed.
    let parts = [real("x", &[30.0]), node("e = Exp x"), node("y = ConstantOfShape e")];
    assert!(checked(&parts).unwrap_err().contains("not followed"));
    // The shape of the picture, where it is stated.
    let side = |size: u64| field(1, &number(1, size));
    let shape = field(2, &[side(1), side(1000)].concat());
    let input =
        field(11, &[field(1, b"picture"), field(2, &field(1, &[number(1, 1), shape].concat()))].concat());
    let steps = ["s = Shape picture", "m = Mul s f", "y = ConstantOfShape m"].map(node);
    let parts = [vec![input, whole("f", &[MILLION])], steps.to_vec()].concat();
    assert!(checked(&parts).unwrap_err().contains("ConstantOfShape"));
}

#[test]
fn graphs_within_graphs_are_checked() {
    let branch = [whole("s", &[MILLION, MILLION]), node("y = ConstantOfShape s")].concat();
    let attribute = field(5, &[field(1, b"then_branch"), field(6, &branch)].concat());
    let problem = checked(&[node_with("z = If condition", &attribute)]).unwrap_err();
    assert!(problem.contains("ConstantOfShape of 'y'"), "{problem}");
    // With a constant of the graph around it.
    let attribute = field(5, &[field(1, b"then_branch"), field(6, &node("y = ConstantOfShape s"))].concat());
    let parts = [whole("s", &[MILLION, MILLION]), node_with("z = If condition", &attribute)];
    assert!(checked(&parts).is_err());
    let body = field(5, &[field(1, b"body"), field(6, &node("y = Identity s"))].concat());
    assert!(checked(&[whole("n", &[MILLION]), node_with("z = Loop n", &body)]).unwrap_err().contains("Loop"));
}

#[test]
fn networks_of_the_program_pass() {
    for bytes in [
        include_bytes!("../../../../../models/scene.onnx").as_slice(),
        include_bytes!("../../../../../models/vehicle.onnx"),
    ] {
        assert_eq!(check(bytes), Ok(()));
    }
}

#[test]
fn a_picture_is_not_repeated_beyond_what_fits() {
    for parts in [
        vec![whole("s", &[1, 3, MILLION, 1000]), node("y = Expand picture s")],
        vec![whole("s", &[1, 1, 1000, MILLION]), node("y = Tile picture s")],
        vec![real("s", &[1.0, 1.0, 2e4, 2e4]), node("y = Resize picture - s")],
        vec![whole("s", &[1, 3, MILLION, MILLION]), node("y = Resize picture - - s")],
        // The picture is known to be one only by what no constant gives.
        vec![whole("s", &[MILLION, MILLION]), node("y = Tile x s"), node("x = Relu picture")],
    ] {
        let problem = checked(&parts).unwrap_err();
        assert!(problem.contains("of 'y' asks for") && problem.contains("elements or more"), "{problem}");
    }
    for parts in [
        vec![real("s", &[1.0, 1.0, 2.0, 2.0]), node("y = Resize picture - s")],
        vec![whole("s", &[1, 64, 320, 1024]), node("y = Resize picture - - s")],
        vec![whole("s", &[1, 8400, 4]), node("y = Expand picture s")],
    ] {
        assert_eq!(checked(&parts), Ok(()));
    }
}
