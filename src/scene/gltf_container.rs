//! The binary glTF (GLB) container: a header and chunks.

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";

type Chunks<'a> = (&'a [u8], Option<&'a [u8]>);

/// Returns the JSON text and the optional binary chunk. A file without a GLB header is all text.
///
/// # Errors
/// Byte offset and description of the fault.
pub(super) fn split(bytes: &[u8]) -> Result<Chunks<'_>, (usize, String)> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let there = bytes.len();
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(<[u8]>::first_chunk);
        let word = word.map(|word| u32::from_le_bytes(*word) as usize);
        word.ok_or_else(|| (there, "the file ends in the middle of a header".to_owned()))
    };
    let version = word(4)?;
    if version != 2 {
        let problem = format!("version {version} of binary glTF; only version 2 can be read");
        return Err((4, problem));
    }
    // Chunks say where they end. The length of the file is often written wrong.
    word(8)?;
    let (mut json, mut binary) = (None, None);
    let mut at = HEADER_BYTES;
    while at < there {
        let is_whole = there - at >= 8;
        if json.is_some() && (binary.is_some() || !is_whole) {
            break; // whatever follows is not needed
        }
        let chunk_length = word(at)?;
        word(at + 4)?;
        let (kind, rest) = bytes[at + 4..].split_at(4);
        let left = rest.len();
        let chunk = match rest.get(..chunk_length) {
            Some(chunk) => chunk,
            // A chunk cut short misses something only where that is used.
            None if json.is_some() && kind == BINARY => rest,
            None => {
                let problem =
                    format!("a chunk of {chunk_length} bytes is announced, {left} are there");
                return Err((at, problem));
            }
        };
        match kind {
            JSON if json.is_none() && !chunk.starts_with(MAGIC) => json = Some(chunk),
            BINARY if json.is_some() && binary.is_none() => binary = Some(chunk),
            // Skip chunks of other types, but the first must be the text.
            _ if json.is_some() => {}
            _ => return Err((at + 4, "the first chunk is not JSON text".to_owned())),
        }
        at += 8 + chunk.len();
        // Some leave the padding out of the length.
        let next = at.next_multiple_of(4);
        let is_binary = |at: usize| bytes.get(at + 4..).is_some_and(|b| b.starts_with(BINARY));
        if !is_binary(at) && is_binary(next) {
            at = next;
        }
    }
    let json = json.ok_or((at, "there is no chunk of JSON text".to_owned()))?;
    Ok((json, binary))
}
