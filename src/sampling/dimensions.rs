//! The fixed table of dimensions: (bounce, purpose) → dimension. A draw added in one branch of an
//! integrator cannot shift the dimensions of another. CPU version of
//! `kernels/sampling/dimensions.wesl`.

/// Position in the pixel, two dimensions.
pub const PIXEL: u32 = 0;
/// First dimension of bounce 0.
pub const FIRST_BOUNCE: u32 = 2;
/// Direction of the next ray, two dimensions, within a bounce.
pub const DIRECTION: u32 = 0;
/// Point on the emitter, two dimensions, within a bounce.
pub const LIGHT_POINT: u32 = 2;
/// Choice of the emitter, within a bounce.
pub const LIGHT_CHOICE: u32 = 4;
/// Russian roulette, within a bounce.
pub const ROULETTE: u32 = 5;
/// Dimensions of one bounce.
pub const PER_BOUNCE: u32 = 6;

/// Dimension of `purpose` at `bounce`.
pub fn at_bounce(bounce: u32, purpose: u32) -> u32 {
    FIRST_BOUNCE + bounce * PER_BOUNCE + purpose
}

/// Dimensions that a path of `max_depth` bounces uses.
pub fn needed(max_depth: u32) -> u32 {
    at_bounce(max_depth, 0)
}

/// Description of the path's use of a dimension.
pub(crate) fn purpose(dimension: u32) -> String {
    if dimension < FIRST_BOUNCE {
        return format!("pixel {}", ["x", "y"][dimension as usize]);
    }
    let bounce = (dimension - FIRST_BOUNCE) / PER_BOUNCE;
    let what = match (dimension - FIRST_BOUNCE) % PER_BOUNCE {
        0 => "direction 1",
        1 => "direction 2",
        2 => "light point 1",
        3 => "light point 2",
        4 => "light choice",
        _ => "roulette",
    };
    format!("bounce {bounce}: {what}")
}

/// Description of the path's use of a pair of dimensions.
pub fn pair_purpose([a, b]: [u32; 2]) -> String {
    let (a, b) = (purpose(a), purpose(b));
    match (a.strip_suffix(" 1"), b.strip_suffix(" 2")) {
        (Some(first), Some(second)) if first == second => first.to_owned(),
        _ if a == "pixel x" && b == "pixel y" => "pixel position".to_owned(),
        _ => format!("{a} and {b}"),
    }
}
