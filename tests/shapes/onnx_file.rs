//! ONNX files, written field by field, so that tests can write what no library would.

/// Value of an attribute.
#[derive(Clone, Debug)]
pub enum Attribute {
    Int(i64),
    Ints(Vec<i64>),
    Float(f32),
    Text(String),
    /// Fields of `AttributeProto`, unchanged.
    Fields(Vec<u8>),
}

#[derive(Clone, Debug)]
pub struct Node {
    pub operator: String,
    pub domain: String,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub attributes: Vec<(String, Attribute)>,
    /// More fields of `NodeProto`.
    pub more: Vec<u8>,
}

#[derive(Clone, Debug)]
pub struct Tensor {
    pub name: String,
    pub dims: Vec<i64>,
    /// Number in `TensorProto.DataType`: 1 is float32, 7 int64.
    pub kind: u64,
    pub raw: Vec<u8>,
    /// More fields of `TensorProto`.
    pub more: Vec<u8>,
}

/// A network with the inputs `partial` and `free` and the output `occupancy`.
#[derive(Clone, Debug, Default)]
pub struct Network {
    pub nodes: Vec<Node>,
    pub tensors: Vec<Tensor>,
    /// More fields of `GraphProto`, and of `ModelProto`.
    pub more: [Vec<u8>; 2],
}

pub const FLOAT: u64 = 1;
pub const INT64: u64 = 7;

fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// A field with a whole number.
pub fn number(field: u64, value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    varint(&mut out, field << 3);
    varint(&mut out, value);
    out
}

/// A field with text, bytes or a message.
pub fn bytes(field: u64, content: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    varint(&mut out, field << 3 | 2);
    varint(&mut out, content.len() as u64);
    out.extend(content);
    out
}

fn float(field: u64, value: f32) -> Vec<u8> {
    let mut out = Vec::new();
    varint(&mut out, field << 3 | 5);
    out.extend(value.to_le_bytes());
    out
}

fn numbers(field: u64, values: &[i64]) -> Vec<u8> {
    values.iter().flat_map(|value| number(field, *value as u64)).collect()
}

impl Attribute {
    fn fields(&self) -> Vec<u8> {
        match self {
            Self::Int(value) => [number(3, *value as u64), number(20, 2)].concat(),
            Self::Ints(values) => [numbers(8, values), number(20, 7)].concat(),
            Self::Float(value) => [float(2, *value), number(20, 1)].concat(),
            Self::Text(text) => [bytes(4, text.as_bytes()), number(20, 3)].concat(),
            Self::Fields(fields) => fields.clone(),
        }
    }
}

impl Tensor {
    pub fn bytes(&self) -> Vec<u8> {
        let name = bytes(8, self.name.as_bytes());
        [numbers(1, &self.dims), number(2, self.kind), name, bytes(9, &self.raw), self.more.clone()].concat()
    }
}

impl Node {
    fn bytes(&self) -> Vec<u8> {
        let names = |field, list: &[String]| -> Vec<u8> {
            list.iter().flat_map(|name| bytes(field, name.as_bytes())).collect()
        };
        let attributes = self
            .attributes
            .iter()
            .flat_map(|(name, value)| bytes(5, &[bytes(1, name.as_bytes()), value.fields()].concat()));
        [
            names(1, &self.inputs),
            names(2, &self.outputs),
            bytes(3, self.outputs.first().map_or(&b""[..], |name| name.as_bytes())),
            bytes(4, self.operator.as_bytes()),
            attributes.collect(),
            bytes(7, self.domain.as_bytes()),
            self.more.clone(),
        ]
        .concat()
    }
}

impl Network {
    /// Adds a constant of single precision; returns its name.
    pub fn floats(&mut self, dims: &[i64], values: &[f32]) -> String {
        self.tensor(dims, FLOAT, values.iter().flat_map(|value| value.to_le_bytes()).collect())
    }

    /// Adds a constant of single precision with one value throughout.
    pub fn filled(&mut self, dims: &[i64], value: f32) -> String {
        self.floats(dims, &vec![value; dims.iter().product::<i64>() as usize])
    }

    /// Adds a list of whole numbers; returns its name.
    pub fn wholes(&mut self, values: &[i64]) -> String {
        self.tensor(&[values.len() as i64], INT64, values.iter().flat_map(|value| value.to_le_bytes()).collect())
    }

    fn tensor(&mut self, dims: &[i64], kind: u64, raw: Vec<u8>) -> String {
        let name = format!("c{}", self.tensors.len());
        self.tensors.push(Tensor { name: name.clone(), dims: dims.to_vec(), kind, raw, more: Vec::new() });
        name
    }

    /// Adds a node with one output; returns its name.
    pub fn node(&mut self, operator: &str, inputs: &[&str], attributes: &[(&str, Attribute)]) -> String {
        let output = format!("t{}", self.nodes.len());
        self.node_to(operator, inputs, &[&output], attributes);
        output
    }

    /// Adds a node with these outputs.
    pub fn node_to(&mut self, operator: &str, inputs: &[&str], outputs: &[&str], attributes: &[(&str, Attribute)]) {
        let owned = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
        self.nodes.push(Node {
            operator: operator.to_owned(),
            domain: String::new(),
            inputs: owned(inputs),
            outputs: owned(outputs),
            attributes: attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect(),
            more: Vec::new(),
        });
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let dimension = |side: u64| bytes(1, &number(1, side));
        let shape: Vec<u8> = [1, 1, 40, 40, 40].into_iter().flat_map(dimension).collect();
        let tensor_type = bytes(1, &[number(1, FLOAT), bytes(2, &shape)].concat());
        let end = |field, name: &str| bytes(field, &[bytes(1, name.as_bytes()), bytes(2, &tensor_type)].concat());
        let mut graph: Vec<u8> = self.nodes.iter().flat_map(|node| bytes(1, &node.bytes())).collect();
        graph.extend(self.tensors.iter().flat_map(|tensor| bytes(5, &tensor.bytes())));
        graph.extend([end(11, "partial"), end(11, "free"), end(12, "occupancy"), self.more[0].clone()].concat());
        let set = bytes(8, &[bytes(1, b""), number(2, 18)].concat());
        [number(1, 9), bytes(7, &graph), set, self.more[1].clone()].concat()
    }
}
