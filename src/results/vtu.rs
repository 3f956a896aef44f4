//! VTK unstructured grids (`.vtu`), version 1.0: XML with the arrays appended as raw little-endian bytes, each after its
//! length as a 64-bit integer, as the VTK file-format document describes; ParaView opens them.

use std::fmt::Write as _;

/// VTK cell types that are written.
pub const POLY_VERTEX: u8 = 2;
pub const LINE: u8 = 3;
pub const POLY_LINE: u8 = 4;
pub const TRIANGLE: u8 = 5;

/// The numbers of one array, element after element.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I64(Vec<i64>),
    I32(Vec<i32>),
    U8(Vec<u8>),
}

impl Values {
    fn vtk_type(&self) -> &'static str {
        match self {
            Values::F64(_) => "Float64",
            Values::F32(_) => "Float32",
            Values::I64(_) => "Int64",
            Values::I32(_) => "Int32",
            Values::U8(_) => "UInt8",
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Values::F64(v) => 8 * v.len(),
            Values::F32(v) => 4 * v.len(),
            Values::I64(v) => 8 * v.len(),
            Values::I32(v) => 4 * v.len(),
            Values::U8(v) => v.len(),
        }
    }

    fn append(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&(self.bytes() as u64).to_le_bytes());
        match self {
            Values::F64(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            Values::F32(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            Values::I64(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            Values::I32(v) => v.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            Values::U8(v) => out.extend_from_slice(v),
        }
    }
}

/// A named array over points or cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    pub name: String,
    /// Numbers per point or cell.
    pub width: usize,
    pub values: Values,
}

impl Array {
    pub fn new(name: impl Into<String>, width: usize, values: Values) -> Self {
        Self { name: name.into(), width, values }
    }
}

/// One unstructured grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// x, y, z of each point, m.
    pub points: Vec<f64>,
    pub connectivity: Vec<i64>,
    /// Where each cell ends in `connectivity`.
    pub offsets: Vec<i64>,
    pub types: Vec<u8>,
    pub point_data: Vec<Array>,
    pub cell_data: Vec<Array>,
    /// s.
    pub time: f64,
}

impl Grid {
    /// Adds a cell over these points.
    pub fn cell(&mut self, kind: u8, points: impl IntoIterator<Item = i64>) {
        self.connectivity.extend(points);
        self.offsets.push(self.connectivity.len() as i64);
        self.types.push(kind);
    }

    /// The file's bytes.
    pub fn to_bytes(self) -> Vec<u8> {
        let (points, cells) = (self.points.len() / 3, self.types.len());
        let mut file = Appended::default();
        file.xml.push_str("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" ");
        file.xml.push_str("byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n");
        file.xml.push_str("<FieldData>\n");
        file.array(&Array::new("TimeValue", 1, Values::F64(vec![self.time])), true);
        file.xml.push_str("</FieldData>\n");
        // Writing into a String never fails.
        let _ = writeln!(file.xml, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">");
        file.group("PointData", &self.point_data);
        file.group("CellData", &self.cell_data);
        file.group("Points", &[Array::new("Points", 3, Values::F64(self.points))]);
        file.group(
            "Cells",
            &[
                Array::new("connectivity", 1, Values::I64(self.connectivity)),
                Array::new("offsets", 1, Values::I64(self.offsets)),
                Array::new("types", 1, Values::U8(self.types)),
            ],
        );
        file.xml.push_str("</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
        let mut bytes = file.xml.into_bytes();
        bytes.append(&mut file.data);
        bytes.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
        bytes
    }
}

/// The XML and the block of bytes that it points into.
#[derive(Default)]
struct Appended {
    xml: String,
    data: Vec<u8>,
}

impl Appended {
    fn group(&mut self, tag: &str, arrays: &[Array]) {
        let _ = writeln!(self.xml, "<{tag}>");
        arrays.iter().for_each(|array| self.array(array, false));
        let _ = writeln!(self.xml, "</{tag}>");
    }

    fn array(&mut self, array: &Array, of_field: bool) {
        let (kind, name, width) = (array.values.vtk_type(), escape(&array.name), array.width);
        let shape =
            if of_field { "NumberOfTuples=\"1\"".to_owned() } else { format!("NumberOfComponents=\"{width}\"") };
        let offset = self.data.len();
        let _ = writeln!(
            self.xml,
            "<DataArray type=\"{kind}\" Name=\"{name}\" {shape} format=\"appended\" offset=\"{offset}\"/>"
        );
        array.values.append(&mut self.data);
    }
}

/// XML text for a name.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c => safe.push(c),
        }
    }
    safe
}
