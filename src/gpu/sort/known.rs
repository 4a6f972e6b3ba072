//! Known sizes of sorts, and known keys sorted on the device: where a sort only brings like rays together, a wrong one gives the
//! same hits and images, and other times.

use super::{Pairs, RadixSort};
use crate::{Gpu, GpuError, Recording, Storage};

/// Pairs, bits, kernels, and bytes of scratch: two words a pair, 256 counts for each 2048 pairs and one of all.
const SIZES: [(u32, u32, u32, u64); 4] = [
    (1, 1, 3, 2056),
    (2048, 8, 3, 18_432),
    (2049, 9, 6, 19_464),
    (5000, 32, 12, 44_096),
];
/// Pairs and bits that are sorted: two tiles and one key, with as many digits as bring it back; few, which end elsewhere; and more
/// tiles than a workgroup has lanes, which are scanned in two turns.
const SORTED: [(u32, u32); 3] = [(4097, 32), (301, 17), (2048 * 64 + 1, 8)];

/// Computes the sizes.
///
/// # Errors
/// One is not what it should be: of which, and both values.
pub fn check_sizes() -> Result<(), String> {
    SIZES.into_iter().try_for_each(|(count, bits, passes, bytes)| {
        let found = (RadixSort::passes(bits), RadixSort::scratch_bytes(count));
        (found == (passes, bytes)).then_some(()).ok_or_else(|| {
            format!(
                "a sort of {count} pairs by {bits} bits has (kernels, bytes) {found:?}, and should have {:?}: this program \
                 shows wrong figures; build it anew, and report what stays wrong",
                (passes, bytes)
            )
        })
    })
}

/// Sorts known keys on the device. Returns what is wrong with their order, the kernels or the scratch of it, or `None`.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub fn fault_of_sort(gpu: &Gpu) -> Result<Option<String>, GpuError> {
    let sort = RadixSort::new(gpu)?;
    for (count, bits) in SORTED {
        let keys = keys(count, bits);
        let fault = fault_of(gpu, &sort, &keys, bits)?;
        if let Some(fault) = fault {
            return Ok(Some(format!(
                "a sort of {count} pairs by {bits} bits {fault}"
            )));
        }
    }
    Ok(None)
}

fn fault_of(
    gpu: &Gpu,
    sort: &RadixSort,
    keys: &[u32],
    bits: u32,
) -> Result<Option<String>, GpuError> {
    let count = keys.len() as u32;
    let mut order: Vec<u32> = (0..count).collect();
    let given = Pairs {
        keys: Storage::from(&gpu.storage("known keys", keys)?),
        values: Storage::from(&gpu.storage("known values", &order)?),
        count,
    };
    let mut recording = Recording::new();
    let sorted = sort.record(&mut recording, &given, bits);
    let found = (
        recording.run_count() as u32,
        recording.scratch_bytes(|_| true),
    );
    let promised = (RadixSort::passes(bits), RadixSort::scratch_bytes(count));
    if found != promised {
        return Ok(Some(format!(
            "has (kernels, bytes) {found:?}, and says {promised:?}"
        )));
    }
    recording
        .download("keys", &sorted.keys)
        .download("values", &sorted.values);
    let played = gpu.play(&recording)?;
    // Scratch that was lent before may be longer.
    let answers = played.download::<u32>("keys")?.into_iter();
    order.sort_by_key(|place| keys[*place as usize]);
    let mut answers = answers.zip(played.download::<u32>("values")?).zip(&order);
    let is_wrong = |(answer, right): ((u32, u32), &u32)| answer != (keys[*right as usize], *right);
    let wrong = answers.position(is_wrong);
    Ok(wrong.map(|place| format!("has another at place {place}")))
}

/// Keys with all their bits, of which a third are equal; the first is the greatest and the last the least.
fn keys(count: u32, bits: u32) -> Vec<u32> {
    let most = u32::MAX >> (32 - bits);
    let key = |k: u32| match k {
        0 => most,
        _ if k + 1 == count => 0,
        _ if k.is_multiple_of(3) => most / 3,
        _ => k.wrapping_mul(0x9e37_79b9) >> (32 - bits),
    };
    (0..count).map(key).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn sizes_are_as_by_hand() {
        assert_eq!(super::check_sizes(), Ok(()));
    }
}
