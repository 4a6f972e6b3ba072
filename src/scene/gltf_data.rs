//! The numbers of glTF documents: buffers, views and accessors.

use super::gltf_document::Item;
use super::gltf_files::Files;
use super::gltf_meshopt;
use std::borrow::Cow;
use std::cell::OnceCell;

/// Buffers, and views that had to be decoded. What cannot be had is a fault only once it is used.
pub(super) struct Data<'a> {
    document: Item<'a>,
    buffers: Vec<Result<Vec<u8>, String>>,
    /// Decoded bytes of compressed views, once they were asked for.
    decoded: Vec<OnceCell<Result<Vec<u8>, String>>>,
    /// Limit on bytes that the file does not hold: accessors may be zeros without any data.
    most_zeros: usize,
    /// True if integers may be texture coordinates as they are.
    is_quantised: bool,
}

/// Zero bytes that every file may ask for, and as many again for each of its bytes.
const ZEROS: [usize; 2] = [16 << 10, 64];

/// The elements of an accessor, one after the other.
pub(super) struct Values {
    bytes: Vec<u8>,
    kind: Component,
    width: usize,
    is_normalised: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Component {
    fn of(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5124 => Self::I32,
            5125 => Self::U32,
            5126 => Self::F32,
            5130 => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value that normalised integers divide by; `None` for floats.
    fn largest(self) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => return None,
        })
    }

    /// Reads a component of [`Self::size`] bytes.
    fn read(self, bytes: &[u8]) -> f64 {
        fn of<const N: usize>(bytes: &[u8]) -> [u8; N] {
            *bytes.first_chunk().expect("components are whole")
        }
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(of(bytes))),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(of(bytes))),
            Self::U16 => f64::from(u16::from_le_bytes(of(bytes))),
            Self::I32 => f64::from(i32::from_le_bytes(of(bytes))),
            Self::U32 => f64::from(u32::from_le_bytes(of(bytes))),
            Self::F32 => f64::from(f32::from_le_bytes(of(bytes))),
            Self::F64 => f64::from_le_bytes(of(bytes)),
        }
    }
}

impl Values {
    /// Vectors of floats or integers, the latter from −1 to 1 if the file says normalised.
    ///
    /// # Errors
    /// The elements have another number of components.
    pub(crate) fn vectors<const N: usize>(&self) -> Result<Vec<[f32; N]>, String> {
        if self.width != N {
            return Err(format!("have {} components, not {N}", self.width));
        }
        let size = self.kind.size();
        let largest = self.kind.largest().filter(|_| self.is_normalised);
        let number = |bytes: &[u8]| match (self.kind.read(bytes), largest) {
            (x, Some(largest)) => (x as f32 / largest as f32).max(-1.0),
            (x, None) => x as f32,
        };
        let elements = self.bytes.chunks_exact(N * size);
        let vector = |element: &[u8]| std::array::from_fn(|k| number(&element[k * size..]));
        Ok(elements.map(vector).collect())
    }

    /// [`Self::vectors`] of integers that are normalised whether or not the file says so.
    pub(crate) fn unit_vectors<const N: usize>(mut self) -> Result<Vec<[f32; N]>, String> {
        self.is_normalised = true;
        self.vectors()
    }

    /// Number of components of an element.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Indices, and the value of their type that restarts a strip.
    ///
    /// # Errors
    /// They are not whole numbers from 0.
    pub(crate) fn indices(&self) -> Result<(Vec<u32>, u32), String> {
        let restart = match (self.width, self.kind.largest()) {
            (1, Some(largest)) => largest as u32,
            _ => return Err("are not whole numbers".to_owned()),
        };
        let elements = self.bytes.chunks_exact(self.kind.size());
        let index = |bytes: &[u8]| match self.kind.read(bytes) {
            // A signed −1 restarts, too; all other negative ones are too large to exist.
            x if x < 0.0 => u32::MAX,
            x => x as u32,
        };
        Ok((elements.map(index).collect(), restart))
    }
}

impl<'a> Data<'a> {
    /// Reads all buffers: the binary chunk, data URIs and separate files.
    pub(crate) fn new(
        files: &Files,
        document: Item<'a>,
        file_bytes: usize,
        mut chunk: Option<Vec<u8>>,
    ) -> Self {
        let read = |(index, buffer): (usize, Item<'_>)| {
            let bytes = match buffer.text("uri") {
                Some(uri) => files.read(uri),
                None => {
                    let packed = gltf_meshopt::compression(buffer);
                    let is_fallback = packed.and_then(|packed| packed.flag("fallback"));
                    let own = is_fallback != Some(true);
                    let chunk = own.then(|| chunk.take()).flatten();
                    chunk.ok_or_else(|| "it names no file, and no binary chunk is there".to_owned())
                }
            };
            bytes.map_err(|problem| format!("buffer {index}: {problem}"))
        };
        let buffers: Vec<_> = document.list("buffers").enumerate().map(read).collect();
        let there: usize = buffers.iter().flatten().map(Vec::len).sum();
        let [free, each] = ZEROS;
        let uses = |key: &str, name: &str| document.list(key).any(|x| x.as_text() == Some(name));
        let quantisation = "KHR_mesh_quantization";
        let views = document.list("bufferViews").len();
        Self {
            document,
            buffers,
            decoded: std::iter::repeat_with(OnceCell::new).take(views).collect(),
            most_zeros: (file_bytes + there)
                .saturating_mul(each)
                .saturating_add(free),
            is_quantised: uses("extensionsUsed", quantisation)
                || uses("extensionsRequired", quantisation),
        }
    }

    /// True if integers count as they are unless the file says that they are normalised, which in
    /// the standard itself they always are.
    pub(crate) fn is_quantised(&self) -> bool {
        self.is_quantised
    }

    fn buffer(&self, index: usize) -> Result<&[u8], String> {
        match self.buffers.get(index) {
            Some(Ok(bytes)) => Ok(bytes),
            Some(Err(problem)) => Err(problem.clone()),
            None => Err(format!("there is no buffer {index}")),
        }
    }

    /// Bytes of a buffer from `byteOffset` on, `byteLength` of them or as many as are there.
    fn range(&self, part: Item<'_>) -> Result<&[u8], String> {
        let index = part.index("buffer").ok_or("it names no buffer")?;
        let bytes = self.buffer(index)?;
        let rest = bytes.get(part.index("byteOffset").unwrap_or(0)..);
        let rest = rest.unwrap_or_default();
        let length = part.index("byteLength").unwrap_or(rest.len());
        Ok(&rest[..length.min(rest.len())])
    }

    /// The bytes of a buffer view, decoded if it is compressed.
    ///
    /// # Errors
    /// The view, or what is wrong with it.
    pub(crate) fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = self.document.at("bufferViews", index);
        let view = view.ok_or_else(|| format!("there is no buffer view {index}"))?;
        let Some(packed) = gltf_meshopt::compression(view) else {
            return self.range(view);
        };
        let decoded = self.decoded[index].get_or_init(|| {
            let decoded = gltf_meshopt::decode(packed, self.range(packed)?);
            decoded.map_err(|problem| format!("buffer view {index}: its compressed data {problem}"))
        });
        decoded.as_deref().map_err(Clone::clone)
    }

    /// Distance between the elements of a view, if it says so.
    fn stride(&self, view: usize) -> Option<usize> {
        let view = self.document.at("bufferViews", view)?;
        let stride = |part: Item<'_>| part.index("byteStride").filter(|stride| *stride > 0);
        let packed = gltf_meshopt::compression(view);
        let packed = packed.filter(|packed| packed.text("mode") == Some("ATTRIBUTES"));
        stride(view).or_else(|| stride(packed?))
    }

    /// True for an accessor of no elements, which exporters write for parts without any.
    pub(crate) fn is_empty(&self, index: usize) -> bool {
        let accessor = self.document.at("accessors", index);
        accessor.and_then(|accessor| accessor.index("count")) == Some(0)
    }

    /// Reads an accessor: zeros or a part of a view, with its sparse values laid over.
    ///
    /// # Errors
    /// What is wrong with it; begins with a verb.
    pub(crate) fn accessor(&self, index: usize) -> Result<Values, String> {
        let accessor = self.document.at("accessors", index);
        let accessor =
            accessor.ok_or_else(|| format!("are missing: there is no accessor {index}"))?;
        let kind = accessor.index("componentType").and_then(Component::of);
        let width = accessor.text("type").and_then(width);
        let (Some(kind), Some(width)) = (kind, width) else {
            return Err(format!("are of an unknown type (accessor {index})"));
        };
        let count = accessor.index("count").filter(|count| *count > 0);
        let count = count.ok_or_else(|| format!("are empty (accessor {index})"))?;
        let size = width * kind.size();
        let sparse = accessor.get("sparse").given();
        let mut bytes = match accessor.index("bufferView") {
            Some(_) => self.elements(accessor, count, size)?.into_owned(),
            None => {
                let all = count
                    .checked_mul(size)
                    .filter(|all| *all <= self.most_zeros);
                let problem = || format!("are {count} zeros, too many for so small a file");
                vec![0; all.ok_or_else(problem)?]
            }
        };
        if let Some(sparse) = sparse {
            let replaced = |problem: String| format!("are replaced by some that {problem}");
            self.replace(sparse, size, &mut bytes).map_err(replaced)?;
        }
        let is_normalised = accessor.flag("normalized") == Some(true);
        Ok(Values {
            bytes,
            kind,
            width,
            is_normalised,
        })
    }

    fn replace(&self, sparse: Item<'_>, size: usize, bytes: &mut [u8]) -> Result<(), String> {
        let count = sparse.index("count").unwrap_or(0);
        if count == 0 {
            return Ok(());
        }
        let indices = sparse.get("indices");
        let kind = indices.index("componentType").and_then(Component::of);
        let kind = kind.ok_or("have indices of an unknown type")?;
        let values = self.elements(sparse.get("values"), count, size)?;
        let places = self.elements(indices, count, kind.size())?;
        let places = Values {
            bytes: places.into_owned(),
            kind,
            width: 1,
            is_normalised: false,
        };
        let (places, _) = places.indices()?;
        for (place, value) in places.into_iter().zip(values.chunks_exact(size)) {
            let start = (place as usize).saturating_mul(size);
            let element = bytes.get_mut(start..).and_then(|rest| rest.get_mut(..size));
            let element =
                element.ok_or_else(|| format!("have an index {place} that is too large"))?;
            element.copy_from_slice(value);
        }
        Ok(())
    }

    /// `count` elements of `size` bytes from the `bufferView` and `byteOffset` of a part.
    fn elements(&self, part: Item<'_>, count: usize, size: usize) -> Result<Cow<'_, [u8]>, String> {
        let view = part.index("bufferView").ok_or("have no buffer view")?;
        let problem = |problem| format!("cannot be read: {problem}");
        let bytes = self.view(view).map_err(problem)?;
        // Elements do not overlap: a smaller distance is a mistake for none.
        let stride = self.stride(view).map_or(size, |stride| stride.max(size));
        let bytes = bytes.get(part.index("byteOffset").unwrap_or(0)..);
        let last = (count - 1).checked_mul(stride);
        let end = last.and_then(|last| last.checked_add(size));
        let fitting = bytes.and_then(|bytes| bytes.get(..end?));
        let fitting = fitting.ok_or_else(|| {
            format!("are outside their buffer ({count} elements in buffer view {view})")
        })?;
        if stride == size {
            return Ok(Cow::Borrowed(fitting));
        }
        let elements = fitting.chunks(stride).flat_map(|element| &element[..size]);
        Ok(Cow::Owned(elements.copied().collect()))
    }
}

fn width(kind: &str) -> Option<usize> {
    Some(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}
