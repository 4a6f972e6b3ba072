//! Elementary intervals.

use super::*;

/// True if each elementary interval of area 2^-m contains exactly one of 2^m points.
fn is_net(points: &[[u32; 2]], m: u32) -> bool {
    assert_eq!(points.len(), 1 << m);
    (0..=m).all(|columns| {
        let mut seen = vec![false; 1 << m];
        points.iter().all(|&[x, y]| {
            let leading = |x: u32, bits: u32| if bits == 0 { 0 } else { x >> (32 - bits) };
            let cell = leading(x, columns) << (m - columns) | leading(y, m - columns);
            !std::mem::replace(&mut seen[cell as usize], true)
        })
    })
}

/// True if every prefix of 2^m points is a net.
pub fn has_nets(points: &[[u32; 2]]) -> bool {
    (0..=points.len().ilog2()).all(|m| is_net(&points[..1 << m], m))
}

#[test]
fn prefixes_of_sobol_and_of_what_keeps_its_digits_are_nets_in_every_pixel() {
    let plain = sampler("sobol", "none", &demand(4096, 6));
    let mut net = points(&plain, 4096, [0, 1]);
    assert!(has_nets(&net));
    net[1] = net[2];
    assert!(!has_nets(&net), "a point twice must be seen");
    // Not every pair of dimensions is one: negative control.
    assert!(!has_nets(&points(&plain, 256, [4, 5])));
    for (sequence, decorrelation) in [
        ("sobol", "digital-shift"),
        ("sobol", "owen-hash"),
        ("sobol", "linear-scramble"),
        ("pmj02", "linear-scramble"),
        ("owen-sobol", "none"),
        ("pmj02", "none"),
        ("pmj02", "digital-shift"),
    ] {
        let sampler = sampler(sequence, decorrelation, &demand(4096, 2));
        for pixel in [0, 1, 77] {
            let points = points_of(&sampler, 4096, [0, 1], pixel);
            assert!(has_nets(&points), "{}, pixel {pixel}", sampler.label());
        }
    }
    // A shift modulo 1 breaks them.
    let shifted = sampler("sobol", "cranley-patterson", &demand(4096, 2));
    assert!(!has_nets(&points(&shifted, 4096, [0, 1])));
}

#[test]
fn blocks_of_shuffled_indices_stay_blocks() {
    let sampler = sampler("sobol", "owen-hash", &demand(64, 2));
    let mut moved = 0;
    for block in 0..16_u32 {
        let index = |i| {
            let at = at(16 * block + i, 0);
            sampler.decorrelation.index(&sampler.table, at)
        };
        let mut indices: Vec<u32> = (0..16).map(index).collect();
        moved += usize::from(indices.is_sorted());
        indices.sort_unstable();
        assert!(indices.windows(2).all(|w| w[1] == w[0] + 1) && indices[0].is_multiple_of(16));
    }
    assert!(moved < 4, "nothing is shuffled");
}

#[test]
fn every_pair_of_pmj02_is_a_net_of_its_own_at_every_length() {
    for count in [1, 2, 8, 64, 512, 1 << 13, 1 << 16] {
        let sampler = sampler("pmj02", "none", &demand(count, 6));
        let sets = [[0, 1], [2, 3], [4, 5]].map(|pair| points(&sampler, count, pair));
        assert!(sets.iter().all(|set| has_nets(set)), "{count} points");
        assert!(sets[0] != sets[1] && sets[1] != sets[2]);
    }
}

#[test]
fn published_pmj02_sets_have_the_same_nets() {
    let Some(folder) = shared_table("pmj02") else {
        return;
    };
    for set in 1..=4 {
        let file = folder.join(format!("pmj02_4096_set0{set}.txt"));
        let text = std::fs::read_to_string(file).expect("a readable table");
        let point = |line: &str| -> [u32; 2] {
            let mut numbers = line
                .split_whitespace()
                .map(|n| n.parse::<f64>().expect("a number"));
            [(); 2].map(|()| (numbers.next().expect("two numbers") * 2.0_f64.powi(32)) as u32)
        };
        let mut points: Vec<_> = text
            .lines()
            .filter(|l| !l.starts_with('#'))
            .map(point)
            .collect();
        assert_eq!(points.len(), 4096);
        assert!(has_nets(&points), "set {set}");
        points.swap(0, 5);
        points.swap(1, 9);
        points.swap(2, 11);
        assert!(!has_nets(&points), "the order counts");
    }
}
