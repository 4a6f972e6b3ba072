//! Data encoded by meshoptimizer 1.3 itself, and what its own decoder makes of it.

use super::gltf_document::Item;
use super::gltf_meshopt::decode;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

fn bytes(text: &str) -> Vec<u8> {
    STANDARD.decode(text).expect("base64")
}

fn decoded(mode: &str, filter: &str, count: usize, stride: usize, data: &[u8]) -> Vec<u8> {
    try_decode(mode, filter, count, stride, data).unwrap_or_else(|e| panic!("{mode} {filter}: {e}"))
}

fn try_decode(
    mode: &str,
    filter: &str,
    count: usize,
    stride: usize,
    data: &[u8],
) -> Result<Vec<u8>, String> {
    let packed = json!({"mode": mode, "filter": filter, "count": count, "byteStride": stride});
    decode(Item::new(&packed), data)
}

/// Smooth, rough and linear bytes, which need all sizes of groups.
fn uneven(count: usize, stride: usize) -> Vec<u8> {
    let byte = |i: usize, k: usize| match k % 4 {
        1 => i >> 2,
        2 => i * k,
        3 => (i * i * 31 + k * 17) >> 3,
        _ => 0,
    };
    let elements = (0..count).flat_map(|i| (0..stride).map(move |k| byte(i, k) as u8));
    elements.collect()
}

const VERSION_0: &str = "oAAVAICAgICAgICAgAAAKgREREREREREREREREREREREREREAAAAAB8ACBYoNkZUZnSEkqSywtDi8P/x39HBs6GTg3VjVUU3Jf//AAAXBwYYJjZEVgAVAICAgICAgICAgAAAKgzMzMzMzMzMzMzMzMzMzMzMzMzMAAAAAB8ACBgmNkZWZHSElKKywtLg8P/v4dHBsaOTg3NlVUU1J///AAAXBwgWJjZGVAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAYAAAAO";
const VERSION_1: &str = "odbWFQCAgICAgICAgIAAACoERERERERERERERERERERERERERAAAAAAACBYoNkZUZnSEkqSywtDi8P/x39HBs6GTg3VjVUU3JRcHBhgmNkRWFQCAgICAgICAgIAAACoMzMzMzMzMzMzMzMzMzMzMzMzMzAAAAAAACBgmNkZWZHSElKKywtLg8P/v4dHBsaOTg3NlVUU1JxcHCBYmNkZUAAAAAAAAAAAAAAAAAAAAAAAGAAAADgAA";
const FLOATS: &str = "obo6ABAQEBAQEBAQEBAQEBAQEBAICAgAgACgYGBAMDAwMCgYGBgYGBgYGAEGAIABAAAAAAAAAAAAAAAAAAAAAIA/AAAAgAEB";
const SHORTS: &str = "od+eAMBBw0HHQMFDwUDPQcNBx0DBQ8EAwkTNWsZI91rONF32UjDTdtI8VQUHTcd0AwcDDwPdAAAABwMAw0TLPkvYS/5L1DNe81Az3nPUKwAXMRtpP+E7adcxS9lPwUvZt1H7AgU9f0PX801/HT0dDwAEAw0EAAAAAAAAAAAAAAAAAAAAAAkDFAYAAEJi";

#[test]
fn attributes_of_both_versions_are_what_was_encoded() {
    for data in [VERSION_0, VERSION_1] {
        let found = decoded("ATTRIBUTES", "NONE", 40, 8, &bytes(data));
        assert_eq!(found, uneven(40, 8));
    }
    let pairs = (0..20).flat_map(|i| [1.0 + i as f32 / 16.0, -3.0 * i as f32]);
    let floats: Vec<u8> = pairs.flat_map(f32::to_le_bytes).collect();
    assert_eq!(decoded("ATTRIBUTES", "NONE", 20, 8, &bytes(FLOATS)), floats);
    let short = |i: u32| if i % 4 == 3 { 0 } else { i * 777 + ((i * i) >> 1) } as u16;
    let shorts: Vec<u8> = (0..80).flat_map(|i| short(i).to_le_bytes()).collect();
    assert_eq!(decoded("ATTRIBUTES", "NONE", 20, 8, &bytes(SHORTS)), shorts);
}

const TRIANGLES: &str =
    "4f4eEA4QDhAOzh4WDhUOFA7OHhQOFA4UDv///g8KHyUO/8IPyQ/ID/+StgjVxQgAdodWZ3iphmWJaJgBaQAA";
const INDICES: &str = "0QAEEA4UAg4EEA4UAg4EEA4UAg4EEA4UAgoEEA4UAg4EEA4UAg4EEA4UAg4EEA4UAgoEEA4UAg4EEA4UAg4EEA4UAg4EEA4UAkZMLqEfDgMIAKXsEAAAAAA=";

#[test]
fn indices_of_triangles_and_of_lists_are_what_was_encoded() {
    // A grid of 4 by 3 squares, then triangles that share no edge.
    let square = |a: u32| [[a, a + 1, a + 5], [a + 1, a + 6, a + 5]];
    let squares = (0..3).flat_map(|y| (0..4).flat_map(move |x| square(5 * y + x)));
    let mut list: Vec<[u32; 3]> = squares.collect();
    list.extend([[0, 19, 7], [1000, 3, 999], [5, 5, 70_000]]);
    let words = |bytes: Vec<u8>| -> Vec<u32> {
        let words = bytes.as_chunks().0.iter();
        words.map(|word| u32::from_le_bytes(*word)).collect()
    };
    let found = words(decoded("INDICES", "NONE", 81, 4, &bytes(INDICES)));
    assert_eq!(found, list.as_flattened());
    // The encoder turns triangles, and keeps their order.
    let turned = |t: &[u32; 3]| {
        let least = (0..3)
            .min_by_key(|k| (t[*k], t[(k + 1) % 3]))
            .expect("three");
        [0, 1, 2].map(|k| t[(least + k) % 3])
    };
    let found = words(decoded("TRIANGLES", "NONE", 81, 4, &bytes(TRIANGLES)));
    let found: Vec<_> = found.as_chunks().0.iter().map(turned).collect();
    assert_eq!(found, list.iter().map(turned).collect::<Vec<_>>());
    let narrow = decoded("INDICES", "NONE", 81, 2, &bytes(INDICES));
    assert_eq!(narrow[..4], [0, 0, 1, 0]);
}

#[test]
fn filters_give_what_the_original_decoder_does() {
    for (filter, stride, data, expected) in [
        (
            "OCTAHEDRAL",
            4,
            "oe8AAq7+CaEAZmb+nScA/v3+/f4AAAAAAAAAAAAAAAAAAAAAAAAAVlx/AAA=",
            "PEapABXEkn+aueUAR2YbfzzrbgC6xll/",
        ),
        (
            "OCTAHEDRAL",
            8,
            "of/aABS4ApU3AAAVEAAJABiCAwGPABkIEAkDARmQAAAA/v3+/f4AAAAAAAAAAAAAAAAAAGkF0gX/BwAAAAA=",
            "iTvCRoCnAADJFK7ClpH/f5iYj7kF5QAAokZNZ+Ea/3/CPIbql24AACS5lMR+WP9/",
        ),
        (
            "QUATERNION",
            8,
            "of+fAGd91lCSAF5HNhUwAP97w3hzAFk6ExkKAGH1BZmYAC9oRStkACAAAQAAAAAAAAAAAAAAAAAA4OUgGgAA/R8AAA==",
            "AADmSRq25klmvjFNeToGzCJQnFTy018dGO0UeoEhAAADrmtbAADk27VWskRl6Uk8",
        ),
        (
            "EXPONENTIAL",
            8,
            "od/fAPCqAGAaAAsTUgwBAAgAAgAEAgoICAB7VgCA+wAJVWwNEgAEAAIABAAKCAgAAAAAAAAAAAAAAAAAADPw//AT2v/wAAE=",
            "ANB8vQC0F74AqKq+AKwqvwAAgL8AAAAAAAAQQQAAWEIAAHNDAABzRADQY0UACE1G",
        ),
        (
            "COLOR",
            4,
            "of8AKCaZKCYAS0vPS0sAi4s0i4sAU1RTVFMAAAAAAAAAAAAAAAAAAAAAAAAAfwB//wA=",
            "AP4A/zTMgKtnmf//mGYAq8w0gP//Af+r",
        ),
        (
            "COLOR",
            8,
            "of//AGhmmWhmAAICCQICAMvLMMvLAAQEEwQEAMvLy8vLAAcHAgcHAKyrrKusAAMEAwQDAAAAAAAAAAAAAAAAAAD/BwAA/wf/DwEA",
            "AADv/wAA//9DM8zMCIC6qnZmmZn/////iZlmZgAAuqrMzEMzCID/////EAD//7qq",
        ),
    ] {
        let found = decoded("ATTRIBUTES", filter, 6, stride, &bytes(data));
        assert_eq!(found, bytes(expected), "{filter} {stride}");
    }
}

#[test]
fn damaged_data_is_refused() {
    for (mode, count, stride, data) in [
        ("ATTRIBUTES", 40, 8, VERSION_0),
        ("ATTRIBUTES", 40, 8, VERSION_1),
        ("TRIANGLES", 81, 4, TRIANGLES),
        ("INDICES", 81, 4, INDICES),
    ] {
        let data = bytes(data);
        for length in 0..data.len() {
            let cut = try_decode(mode, "NONE", count, stride, &data[..length]);
            // A list of triangles does not say how many bytes its far vertices take.
            let may_end_early = mode == "TRIANGLES" && length > 16 + count / 3;
            assert!(cut.is_err() || may_end_early, "{mode} of {length} bytes");
        }
        for count in [usize::MAX, 1 << 40] {
            assert!(try_decode(mode, "NONE", count, stride, &data).is_err());
        }
        for stride in [0, 3, 1 << 40] {
            assert!(try_decode(mode, "NONE", count, stride, &data).is_err());
        }
        let message = try_decode(mode, "SPIRAL", count, stride, &data).unwrap_err();
        assert!(message.contains("filter `SPIRAL`"), "{message}");
    }
    let message = try_decode("LINES", "NONE", 1, 4, &[]).unwrap_err();
    assert!(message.contains("unknown mode `LINES`"), "{message}");
}
