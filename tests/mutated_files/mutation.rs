//! Ways to break files.
#![allow(clippy::ptr_arg)] // All mutations have one type; most of them change the length.

/// A small deterministic generator (PCG-RXS-M-XS with 64 bits of state; O'Neill 2014).
pub struct Pcg(u64);

impl Pcg {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x853c_49e6_748f_ea9b)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let word =
            ((self.0 >> ((self.0 >> 59) + 5)) ^ self.0).wrapping_mul(12_605_985_483_714_917_081);
        (word >> 43) ^ word
    }

    /// An integer in `0..n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }

    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// Numbers as text that readers have stumbled over.
const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "255",
    "256",
    "65536",
    "-2147483649",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "99999999999999999999999",
    "1e38",
    "-1e39",
    "1e-45",
    "1e999",
    "NaN",
    "nan",
    "inf",
    "-Infinity",
    "0x7f",
    "1_0",
];

/// The same as words of 32 bits: counts, indices, NaN, infinity, the largest number, a denormal.
const WORDS: [u32; 12] = [
    0,
    1,
    3,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    0x7fc0_0000,
    0x7f80_0000,
    0xff7f_ffff,
    0x0000_0001,
];

/// Beginnings of nested values.
const OPENINGS: [&str; 5] = ["[", "{\"a\":", "[[", "{a=", "("];

type Mutation = fn(&mut Vec<u8>, &[u8], &mut Pcg);

const MUTATIONS: [Mutation; 14] = [
    flip_a_bit,
    replace_a_byte,
    truncate,
    remove_a_line,
    duplicate_a_line,
    swap_lines,
    replace_a_number,
    replace_a_number,
    nudge_a_number,
    overwrite_a_word,
    insert_noise,
    nest_deeply,
    repeat_a_slice,
    splice,
];

/// `bytes` after one to four changes; `other` is another file of the same kind to take parts from.
pub fn mutate(bytes: &[u8], other: &[u8], random: &mut Pcg) -> Vec<u8> {
    let mut mutant = bytes.to_vec();
    for _ in 0..1 + random.below(4) {
        random.pick(&MUTATIONS)(&mut mutant, other, random);
    }
    mutant
}

fn flip_a_bit(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let at = random.below(bytes.len());
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(8);
    }
}

fn replace_a_byte(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let at = random.below(bytes.len());
    if let Some(byte) = bytes.get_mut(at) {
        *byte = random.next() as u8;
    }
}

fn truncate(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    bytes.truncate(random.below(bytes.len()));
}

fn lines(bytes: &[u8]) -> Vec<Vec<u8>> {
    bytes
        .split_inclusive(|byte| *byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect()
}

fn remove_a_line(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let mut lines = lines(bytes);
    if !lines.is_empty() {
        lines.remove(random.below(lines.len()));
    }
    *bytes = lines.concat();
}

fn duplicate_a_line(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let mut lines = lines(bytes);
    if !lines.is_empty() {
        let line = lines[random.below(lines.len())].clone();
        lines.insert(random.below(lines.len() + 1), line);
    }
    *bytes = lines.concat();
}

fn swap_lines(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let mut lines = lines(bytes);
    if !lines.is_empty() {
        let [a, b] = [0; 2].map(|_| random.below(lines.len()));
        lines.swap(a, b);
    }
    *bytes = lines.concat();
}

/// Returns the range of the first digits after a random place.
fn number(bytes: &[u8], random: &mut Pcg) -> Option<std::ops::Range<usize>> {
    let from = random.below(bytes.len());
    let first = from + bytes[from..].iter().position(u8::is_ascii_digit)?;
    let length = bytes[first..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    Some(first..first + length)
}

fn replace_a_number(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    if let Some(range) = number(bytes, random) {
        bytes.splice(range, random.pick(&NUMBERS).bytes());
    }
}

/// An index or a count that is off by a little, or negative.
fn nudge_a_number(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let Some(range) = number(bytes, random) else {
        return;
    };
    let text = String::from_utf8_lossy(&bytes[range.clone()]);
    let value: i64 = text.parse().unwrap_or(0);
    let changed = match random.below(4) {
        0 => value.wrapping_add(1),
        1 => value.wrapping_sub(1),
        2 => value.wrapping_neg(),
        _ => value.wrapping_mul(1000),
    };
    bytes.splice(range, changed.to_string().into_bytes());
}

fn overwrite_a_word(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let at = random.below(bytes.len().saturating_sub(3));
    let word = random.pick(&WORDS);
    let word = if random.below(2) == 0 {
        word.to_le_bytes()
    } else {
        word.to_be_bytes()
    };
    for (to, from) in bytes.iter_mut().skip(at).zip(word) {
        *to = from;
    }
}

fn insert_noise(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let printable = random.below(2) == 0;
    let noise: Vec<u8> = (0..1 + random.below(16))
        .map(|_| random.next() as u8)
        .map(|byte| if printable { b' ' + byte % 95 } else { byte })
        .collect();
    let at = random.below(bytes.len() + 1);
    bytes.splice(at..at, noise);
}

fn nest_deeply(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let depth = 1 << (4 + random.below(10));
    let at = random.below(bytes.len() + 1);
    let nested = random.pick(&OPENINGS).repeat(depth);
    bytes.splice(at..at, nested.into_bytes());
}

fn slice<'a>(bytes: &'a [u8], longest: usize, random: &mut Pcg) -> &'a [u8] {
    let first = random.below(bytes.len());
    let length = random.below((bytes.len() - first).min(longest) + 1);
    &bytes[first..][..length]
}

fn repeat_a_slice(bytes: &mut Vec<u8>, _: &[u8], random: &mut Pcg) {
    let repeated = slice(bytes, 64, random).repeat(1 + random.below(256));
    let at = random.below(bytes.len() + 1);
    bytes.splice(at..at, repeated);
}

fn splice(bytes: &mut Vec<u8>, other: &[u8], random: &mut Pcg) {
    let part = slice(other, 256, random).to_vec();
    let at = random.below(bytes.len() + 1);
    let end = at + random.below((bytes.len() - at).min(256) + 1);
    bytes.splice(at..end, part);
}
