//! Buffer views compressed by meshoptimizer: `EXT_meshopt_compression` and its successor
//! `KHR_meshopt_compression`, decoded as their specifications say (A. Kapoulkine).

use super::gltf_document::Item;

/// The extension under its names, all of which mean the same.
pub(super) const COMPRESSIONS: [&str; 3] = [
    "KHR_meshopt_compression",
    "EXT_meshopt_compression",
    "MESHOPT_compression",
];

/// The extension of a buffer view that is compressed, or of the buffer that it would have without.
pub(super) fn compression(view: Item<'_>) -> Option<Item<'_>> {
    let found = COMPRESSIONS.iter().map(|name| view.extension(name));
    found.into_iter().find_map(Item::given)
}

/// Decodes the data of a compressed view.
///
/// # Errors
/// What is wrong with it; begins with a verb.
pub(super) fn decode(packed: Item<'_>, data: &[u8]) -> Result<Vec<u8>, String> {
    let (count, stride) = (packed.index("count"), packed.index("byteStride"));
    let (Some(count), Some(stride)) = (count, stride) else {
        return Err("has no count or no stride".to_owned());
    };
    let mode = packed.text("mode").unwrap_or_default();
    let decoded = match mode {
        "ATTRIBUTES" => attributes(data, count, stride),
        "TRIANGLES" => triangles(data, count).and_then(|list| narrowed(&list, stride)),
        "INDICES" => sequence(data, count).and_then(|list| narrowed(&list, stride)),
        _ => return Err(format!("has an unknown mode `{mode}`")),
    };
    let mut decoded = decoded.ok_or_else(|| format!("is damaged (mode `{mode}`)"))?;
    let filter = packed.text("filter").unwrap_or("NONE");
    let fits = match (filter, mode) {
        ("NONE", _) => true,
        (_, "ATTRIBUTES") => unfilter(filter, stride, &mut decoded),
        _ => false,
    };
    let problem = || format!("has a filter `{filter}` that does not fit its {stride} bytes");
    fits.then_some(decoded).ok_or_else(problem)
}

/// Reads bytes from the front.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|taken| taken[0])
    }

    /// A number in groups of seven bits, least significant first.
    fn leb128(&mut self) -> Option<u32> {
        let mut number = 0_u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// Sixteen bytes, most of which fit into so many bits each; those that do not follow.
    fn group(&mut self, bits: usize) -> Option<[u8; 16]> {
        let mut group = [0; 16];
        match bits {
            0 => {}
            8 => group.copy_from_slice(self.take(16)?),
            _ => {
                let packed = self.take(2 * bits)?;
                let most = (1_u8 << bits) - 1;
                for (k, byte) in group.iter_mut().enumerate() {
                    let bit = k * bits % 8;
                    // Single bits begin with the least significant one, all others end there.
                    let shift = if bits == 1 { bit } else { 8 - bits - bit };
                    *byte = packed[k * bits / 8] >> shift & most;
                    if *byte == most {
                        *byte = self.byte()?;
                    }
                }
            }
        }
        Some(group)
    }
}

fn unzigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

/// Bits of a group by its two header bits: in version 0, and in version 1 by the control of the byte.
const BITS: [[usize; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// Elements of `stride` bytes, as differences per byte in blocks.
fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    if !stride.is_multiple_of(4) || !(4..=256).contains(&stride) {
        return None;
    }
    let (version, channels, padded) = match data.first()? {
        0xa0 => (0, 0, 32),
        0xa1 => (1, stride / 4, 24),
        _ => return None,
    };
    let tail = stride + channels;
    let mut bytes = Bytes(data.get(1..data.len().checked_sub(tail.max(padded))?)?);
    let (last, channels) = data[data.len() - tail..].split_at(stride);
    let mut last = last.to_vec();
    let block = ((0x2000 / stride) & !15).min(256);
    let mut decoded = Vec::new();
    let mut left = count;
    while left > 0 {
        let count = left.min(block);
        left -= count;
        let planes = planes(&mut bytes, version, count, stride)?;
        for element in 0..count {
            for word in (0..stride).step_by(4) {
                let delta = |k: usize| planes[(word + k) * count.next_multiple_of(16) + element];
                let channel = channels.get(word / 4).copied().unwrap_or(0);
                let was = last[word..].first_chunk_mut::<4>()?;
                *was = sum(*was, std::array::from_fn(delta), channel)?;
            }
            decoded.extend_from_slice(&last);
        }
    }
    bytes.0.is_empty().then_some(decoded)
}

/// The differences of a block, byte by byte of the elements.
fn planes(bytes: &mut Bytes<'_>, version: u8, count: usize, stride: usize) -> Option<Vec<u8>> {
    let groups = count.div_ceil(16);
    let controls = if version == 0 {
        &[]
    } else {
        bytes.take(stride / 4)?
    };
    let mut planes = Vec::with_capacity(stride * groups * 16);
    for byte in 0..stride {
        let control = controls.get(byte / 4).map(|c| c >> (byte % 4 * 2) & 3);
        let bits = match control {
            None => BITS[0],
            Some(control @ 0..2) => BITS[1 + usize::from(control)],
            Some(control) => {
                let given = if control == 2 {
                    &[]
                } else {
                    bytes.take(count)?
                };
                planes.extend_from_slice(given);
                planes.resize((byte + 1) * groups * 16, 0);
                continue;
            }
        };
        let modes = bytes.take(groups.div_ceil(4))?;
        for group in 0..groups {
            let mode = modes[group / 4] >> (group % 4 * 2) & 3;
            planes.extend(bytes.group(bits[usize::from(mode)])?);
        }
    }
    Some(planes)
}

/// Four bytes plus their difference: as bytes, as two numbers of 16 bits, or by exclusive or.
fn sum(was: [u8; 4], delta: [u8; 4], channel: u8) -> Option<[u8; 4]> {
    match channel & 3 {
        0 => Some(std::array::from_fn(|k| {
            was[k].wrapping_add(unzigzag(u32::from(delta[k])) as u8)
        })),
        1 => {
            let half = |from: [u8; 4], k: usize| u16::from_le_bytes([from[k], from[k + 1]]);
            let sum = |k| half(was, k).wrapping_add(unzigzag(u32::from(half(delta, k))) as u16);
            let [[a, b], [c, d]] = [0, 2].map(|k| sum(k).to_le_bytes());
            Some([a, b, c, d])
        }
        2 => {
            let turned = u32::from_le_bytes(delta).rotate_right(u32::from(channel >> 4));
            Some((u32::from_le_bytes(was) ^ turned).to_le_bytes())
        }
        _ => None,
    }
}

/// The latest `N` values.
struct Latest<T, const N: usize> {
    values: [T; N],
    next: usize,
}

impl<T: Copy + Default, const N: usize> Latest<T, N> {
    fn new() -> Self {
        Self {
            values: [T::default(); N],
            next: 0,
        }
    }

    fn push(&mut self, value: T) {
        self.values[self.next % N] = value;
        self.next += 1;
    }

    /// The value that came `ago` before the latest.
    fn get(&self, ago: usize) -> T {
        self.values[(self.next + 2 * N - 1 - ago) % N]
    }
}

/// Reads the vertices of triangles, most of which share an edge with an earlier one.
struct Corners<'a> {
    bytes: Bytes<'a>,
    edges: Latest<[u32; 2], 16>,
    vertices: Latest<u32, 16>,
    /// The vertex after the greatest so far, and the one that differences refer to.
    next: u32,
    last: u32,
}

impl Corners<'_> {
    fn fresh(&mut self) -> u32 {
        self.next = self.next.wrapping_add(1);
        self.next.wrapping_sub(1)
    }

    /// A vertex at a difference from the one before it.
    fn near(&mut self, difference: u32) -> u32 {
        self.last = self.last.wrapping_add(difference);
        self.last
    }

    fn far(&mut self) -> Option<u32> {
        let difference = unzigzag(self.bytes.leb128()?);
        Some(self.near(difference))
    }

    /// A vertex by four bits: a new one, a recent one, or if `can_be_far` one anywhere.
    fn by(&mut self, code: u8, can_be_far: bool) -> Option<u32> {
        match code {
            0 => Some(self.fresh()),
            15 if can_be_far => self.far(),
            _ => Some(self.vertices.get(usize::from(code) - 1)),
        }
    }

    fn third(&mut self, code: u8) -> Option<u32> {
        let vertex = match code {
            0 => self.fresh(),
            13 => self.near(u32::MAX),
            14 => self.near(1),
            15 => self.far()?,
            _ => return Some(self.vertices.get(usize::from(code))),
        };
        self.vertices.push(vertex);
        Some(vertex)
    }

    /// A triangle without a recent edge, by a byte of two codes.
    fn apart(&mut self, code: u8, table: &[u8]) -> Option<[u32; 3]> {
        let is_listed = code < 14;
        let pair = if is_listed {
            table[usize::from(code)]
        } else {
            self.bytes.byte()?
        };
        if !is_listed && pair == 0 {
            self.next = 0;
        }
        let a = match code {
            15 => self.far()?,
            _ => self.fresh(),
        };
        let (z, w) = (pair >> 4, pair & 15);
        let b = self.by(z, !is_listed)?;
        let c = self.by(w, !is_listed)?;
        self.vertices.push(a);
        for (code, vertex) in [(z, b), (w, c)] {
            if code == 0 || code == 15 && !is_listed {
                self.vertices.push(vertex);
            }
        }
        Some([a, b, c])
    }
}

fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (0xe1, rest) = data.split_first()? else {
        return None;
    };
    let (rest, table) = rest.split_last_chunk::<16>()?;
    let (codes, rest) = rest.split_at_checked(count / 3)?;
    let mut corners = Corners {
        bytes: Bytes(rest),
        edges: Latest::new(),
        vertices: Latest::new(),
        next: 0,
        last: 0,
    };
    let mut list = Vec::with_capacity(3 * codes.len());
    for code in codes {
        let (edge, code) = (code >> 4, code & 15);
        let triangle = if edge < 15 {
            let [a, b] = corners.edges.get(usize::from(edge));
            let c = corners.third(code)?;
            corners.edges.push([c, b]);
            corners.edges.push([a, c]);
            [a, b, c]
        } else {
            let [a, b, c] = corners.apart(code, table)?;
            for edge in [[b, a], [c, b], [a, c]] {
                corners.edges.push(edge);
            }
            [a, b, c]
        };
        list.extend(triangle);
    }
    count.is_multiple_of(3).then_some(list)
}

/// Indices as differences from one of two earlier ones.
fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let (0xd1, rest) = data.split_first()? else {
        return None;
    };
    let (rest, _) = rest.split_last_chunk::<4>()?;
    let mut bytes = Bytes(rest);
    let mut last = [0_u32; 2];
    let index = |_| {
        let code = bytes.leb128()?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(unzigzag(code >> 1));
        Some(*last)
    };
    (count <= rest.len()).then(|| (0..count).map(index).collect())?
}

fn narrowed(list: &[u32], stride: usize) -> Option<Vec<u8>> {
    match stride {
        2 => Some(
            list.iter()
                .flat_map(|x| (*x as u16).to_le_bytes())
                .collect(),
        ),
        4 => Some(list.iter().flat_map(|x| x.to_le_bytes()).collect()),
        _ => None,
    }
}

/// Undoes a filter in place. False if there is none of this name for elements of this size.
fn unfilter(filter: &str, stride: usize, bytes: &mut [u8]) -> bool {
    match (filter, stride) {
        ("EXPONENTIAL", _) => bytes.as_chunks_mut().0.iter_mut().for_each(exponential),
        ("OCTAHEDRAL", 4) => each(bytes, i8::from_le_bytes, i8::to_le_bytes, |v| {
            octahedral(v.map(f32::from), 127.0).map(|x| x as i8)
        }),
        ("OCTAHEDRAL", 8) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, |v| {
            octahedral(v.map(f32::from), 32_767.0).map(|x| x as i16)
        }),
        ("QUATERNION", 8) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, quaternion),
        ("COLOR", 4) => each(bytes, u8::from_le_bytes, u8::to_le_bytes, |v| {
            let signed = |k: usize| f32::from(v[k] as i8);
            color([f32::from(v[0]), signed(1), signed(2)], v[3].into(), 255.0).map(|x| x as u8)
        }),
        ("COLOR", 8) => each(bytes, u16::from_le_bytes, u16::to_le_bytes, |v| {
            let signed = |k: usize| f32::from(v[k] as i16);
            color([f32::from(v[0]), signed(1), signed(2)], v[3], 65_535.0).map(|x| x as u16)
        }),
        _ => return false,
    }
    true
}

/// Replaces every four numbers of `N` bytes each.
fn each<T: Copy, const N: usize>(
    bytes: &mut [u8],
    from: fn([u8; N]) -> T,
    to: fn(T) -> [u8; N],
    change: impl Fn([T; 4]) -> [T; 4],
) {
    for four in bytes.as_chunks_mut::<N>().0.as_chunks_mut::<4>().0 {
        *four = change(four.map(from)).map(to);
    }
}

/// A unit vector from its projection on an octahedron; the fourth number is kept.
fn octahedral([x, y, one, w]: [f32; 4], most: f32) -> [f32; 4] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    let (x, y) = (x - below.copysign(x), y - below.copysign(y));
    let scale = most / (x * x + y * y + z * z).sqrt();
    [
        (x * scale).round(),
        (y * scale).round(),
        (z * scale).round(),
        w,
    ]
}

/// A unit quaternion from its three smaller numbers, and the place of the greatest.
fn quaternion(v: [i16; 4]) -> [i16; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(v[3] | 3);
    let [x, y, z] = [v[0], v[1], v[2]].map(|x| f32::from(x) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let most = (v[3] & 3) as usize;
    let mut turned = [0; 4];
    for (k, value) in [w, x, y, z].into_iter().enumerate() {
        turned[(most + k) % 4] = (value * 32_767.0).round() as i16;
    }
    turned
}

/// A float from a number of 24 bits and an exponent of 8.
fn exponential(bytes: &mut [u8; 4]) {
    let word = i32::from_le_bytes(*bytes);
    let power = f32::from_bits((((word >> 24) + 127) as u32) << 23);
    *bytes = (power * ((word << 8) >> 8) as f32).to_le_bytes();
}

/// A colour from luma and two differences; the greatest bit of `alpha` says how many bits are used.
fn color([y, co, cg]: [f32; 3], alpha: u16, most: f32) -> [f32; 4] {
    let bits = 16 - alpha.leading_zeros();
    let range = (1_u32 << bits) - 1;
    let kept = u32::from(alpha) & (range >> 1);
    let alpha = kept << 1 | kept & 1;
    let scale = most / range as f32;
    [y + co - cg, y + cg, y - co - cg, alpha as f32].map(|x| (x * scale).round())
}
