//! Instances that stand elsewhere than where the scene put them.

use super::{SceneData, Transform};
use glam::Vec3;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Ways of instances by their numbers, scene units.
pub type Shifts = BTreeMap<u32, Vec3>;

/// Reads ways as the parameter `shifts` has them: `7 0.5 0 0, 9 0 1 -2`.
///
/// # Errors
/// Anything but numbers of instances, each with three finite coordinates, or an instance twice.
pub fn parse_shifts(text: &str) -> Result<Shifts, String> {
    let mut ways = Shifts::new();
    for part in text.split(',').filter(|_| !text.trim().is_empty()) {
        let words: Vec<&str> = part.split_whitespace().collect();
        let way = |words: &[&str]| -> Option<(u32, Vec3)> {
            let [instance, x, y, z] = words else {
                return None;
            };
            let number = |word: &str| word.parse().ok().filter(|x: &f32| x.is_finite());
            Some((
                instance.parse().ok()?,
                Vec3::new(number(x)?, number(y)?, number(z)?),
            ))
        };
        let (instance, way) = way(&words).ok_or_else(|| {
            format!("`{}` is no instance with its way: write `7 0.5 0 0` for number 7, and commas between several", part.trim())
        })?;
        if ways.insert(instance, way).is_some() {
            return Err(format!("instance {instance} has two ways: add them up"));
        }
    }
    Ok(ways)
}

/// The text that [`parse_shifts`] reads as these ways, to the bit.
pub fn shifts_text(ways: &Shifts) -> String {
    let mut text = String::new();
    for (instance, way) in ways {
        let comma = if text.is_empty() { "" } else { ", " };
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{comma}{instance} {:?} {:?} {:?}",
            way.x, way.y, way.z
        );
    }
    text
}

impl SceneData {
    /// The scene with some instances shifted.
    ///
    /// # Errors
    /// There is no such instance, or it cannot be placed.
    pub fn shifted(mut self, ways: &Shifts) -> Result<Self, String> {
        self.shift(ways.iter().map(|(instance, way)| (*instance, *way)))?;
        self.hash = format!("{}, shifted by {ways:?}", self.hash);
        Ok(self)
    }

    /// Shifts instances by these ways.
    ///
    /// # Errors
    /// There is no such instance, or it cannot be placed.
    pub fn shift(&mut self, ways: impl Iterator<Item = (u32, Vec3)>) -> Result<(), String> {
        let assembly = self.assembly.as_mut();
        let assembly = assembly.ok_or("the scene has no instances that could move")?;
        for (instance, way) in ways {
            let instance = instance as usize;
            let now = assembly.instances().get(instance);
            let mut to_world = now.map_or(Transform::IDENTITY, |now| now.to_world);
            for (row, by) in to_world.rows.iter_mut().zip(way.to_array()) {
                row[3] += by;
            }
            let placed = assembly.move_to(instance, to_world);
            placed.map_err(|e| e.to_string())?;
        }
        let instances = assembly.instances().iter();
        self.triangles = instances.flat_map(|i| assembly.copy(i)).collect();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LoadOptions, load};
    use raystone_core::params::{ParamValue, Params, Variant};

    #[test]
    fn ways_read_back_to_the_bit_and_nonsense_is_refused() {
        let ways = Shifts::from([
            (0, Vec3::new(0.1, -2.3e-7, 1e7)),
            (7, Vec3::new(1.0 / 3.0, 0.0, -1.0)),
        ]);
        assert_eq!(parse_shifts(&shifts_text(&ways)), Ok(ways));
        assert_eq!(parse_shifts(" "), Ok(Shifts::new()));
        for text in [
            "7",
            "7 0 0",
            "7 0 0 0 0",
            "-1 0 0 0",
            "7 a 0 0",
            "7 0 0 inf",
            "7 0 0 0,",
        ] {
            assert!(
                parse_shifts(text).unwrap_err().contains("no instance"),
                "{text}"
            );
        }
        assert!(
            parse_shifts("7 0 0 0, 7 1 0 0")
                .unwrap_err()
                .contains("two ways")
        );
    }

    fn with(name: &str, shifts: &str) -> Result<SceneData, crate::SceneError> {
        let shifts = ("shifts".to_owned(), ParamValue::Name(shifts.to_owned()));
        let variant = Variant {
            name: name.to_owned(),
            params: Params([shifts].into()),
            ..Variant::default()
        };
        load(&variant, &LoadOptions::default())
    }

    #[test]
    fn a_parameter_moves_the_triangles_of_an_instance_and_no_others() {
        let scene = with("instances", "").unwrap();
        let moved = with("instances", "3 0.5 -1 0.25").unwrap();
        assert_ne!(scene.hash, moved.hash);
        let assembly = scene.assembly.as_ref().unwrap();
        let counts = assembly
            .instances()
            .iter()
            .map(|i| assembly.copy(i).count());
        let counts: Vec<usize> = counts.collect();
        let first: usize = counts[..3].iter().sum();
        let way = Vec3::new(0.5, -1.0, 0.25);
        for (k, (a, b)) in scene.triangles.iter().zip(&moved.triangles).enumerate() {
            let is_its = (first..first + counts[3]).contains(&k);
            let by = if is_its { way } else { Vec3::ZERO };
            for (a, b) in a.vertices.iter().zip(&b.vertices) {
                assert!(
                    (*b - *a - by).abs().max_element() <= 1e-5 * f32::from(u8::from(is_its)),
                    "{k}"
                );
            }
        }
        let refused = |name: &str, shifts: &str| with(name, shifts).unwrap_err().to_string();
        assert!(refused("cornell-box", "0 1 0 0").contains("no instances"));
        assert!(refused("instances", "64 1 0 0").contains("64"));
        assert!(refused("instances", "1 x").contains("`1 x` is no instance"));
    }
}
