//! Parser for the statements of material libraries (MTL).

use super::MaterialSource;
use super::obj_statements::{number, without_comment};
use super::tally::Unread;

/// A `newmtl` with its statements.
#[derive(Default)]
pub(super) struct Definition {
    pub name: String,
    /// Line of `newmtl`.
    pub line: usize,
    pub diffuse: Option<[f32; 3]>,
    pub emission: Option<[f32; 3]>,
    pub source: MaterialSource,
    /// Textures of the diffuse colour, the emission, the opacity, and the normal.
    pub maps: [Option<Map>; 4],
    /// Textures that are not rendered.
    pub unused: Vec<&'static str>,
    /// `Tr`, with its line.
    transparency: Option<(f32, usize)>,
    /// Whether `Pr` is given; where it is not, `Ns` tells the roughness.
    pub has_roughness: bool,
}

/// Diffuse colours up to this are those of glass.
pub(super) const BLACK: f32 = 0.05;

/// The text after the keyword of a texture.
pub(super) struct Map {
    pub text: String,
    pub line: usize,
}

/// Parses a library. Keywords are read in any case.
pub(super) fn read(text: &str, unread: &mut Unread) -> Vec<Definition> {
    let mut found: Vec<Definition> = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.trim();
        let Some(keyword) = without_comment(content).split_whitespace().next() else {
            continue;
        };
        // Names may contain `#`.
        let rest = content[keyword.len()..].trim();
        if keyword.eq_ignore_ascii_case("newmtl") {
            found.push(Definition {
                name: rest.to_owned(),
                line,
                ..Definition::default()
            });
        } else if let Some(material) = found.last_mut() {
            material.statement(keyword, rest, line, unread);
        } else {
            unread.see("statements before the first `newmtl`", line);
        }
    }
    let is_opacity = transparency_is_opacity(&found);
    for material in &mut found {
        material.complete(is_opacity, unread);
    }
    found
}

/// Whether `Tr` is the opacity in this library: nobody writes materials that cannot be seen, but VTK and others write `Tr 1`
/// for opaque ones. Where some `Tr` is 0, it is the transparency.
fn transparency_is_opacity(materials: &[Definition]) -> bool {
    let alone = materials.iter().filter(|m| m.source.opacity.is_none());
    let mut given = alone.filter_map(|m| m.transparency.map(|(value, _)| value));
    given.clone().any(|value| value == 1.0) && given.all(|value| value != 0.0)
}

impl Definition {
    fn statement(&mut self, keyword: &str, rest: &str, line: usize, unread: &mut Unread) {
        let values = numbers(rest);
        let first = values.first().copied();
        let words = without_comment(rest).split_whitespace().count();
        let color = match values[..] {
            [r, g, b, ..] => Some([r, g, b]),
            [grey] if words == 1 => Some([grey; 3]),
            _ => None,
        };
        let source = &mut self.source;
        let key = keyword.to_ascii_lowercase();
        if color.is_some_and(|parts| parts.iter().any(|part| *part < 0.0))
            && COLORS.contains(&&*key)
        {
            unread.see(&format!("what is below 0 in `{keyword}`"), line);
        }
        if values_of(&key).is_some_and(|most| words > most) {
            unread.see(
                &format!("what stands behind the values of `{keyword}`"),
                line,
            );
        }
        let is_read = match key.as_str() {
            "ka" => true,
            "kd" => set(&mut self.diffuse, color),
            "ke" => set(&mut self.emission, color),
            "ks" => set(&mut source.specular, color),
            "tf" => set(&mut source.filter, color),
            "ns" => set(&mut source.shininess, first),
            "ni" => set(&mut source.ior, first),
            "d" => {
                let is_halo = rest.starts_with("-halo") && first != Some(1.0);
                unread.see_if(is_halo, "`-halo` of `d`", line);
                set(&mut source.opacity, first)
            }
            "tr" => set(&mut self.transparency, first.map(|t| (t, line))),
            "pr" => set(&mut source.roughness, first),
            "pm" => set(&mut source.metallic, first),
            "illum" => set(&mut source.illum, first.and_then(model)),
            "map_kd" | "map_ke" | "map_d" | "norm" => {
                let text = rest.to_owned();
                let map = (!rest.is_empty()).then_some(Map { text, line });
                let place = MAPS.iter().position(|name| *name == key);
                place.is_some_and(|place| set(&mut self.maps[place], map))
            }
            "map_ks" => self.leave("map_Ks", rest),
            "map_ns" => self.leave("map_Ns", rest),
            "map_bump" | "bump" => self.leave("a bump map", rest),
            _ => return unread.see(keyword, line),
        };
        if !is_read {
            unread.see(&format!("the value of `{keyword}`"), line);
        }
    }

    fn leave(&mut self, what: &'static str, rest: &str) -> bool {
        if !rest.is_empty() && !self.unused.contains(&what) {
            self.unused.push(what);
        }
        !rest.is_empty()
    }

    /// Completes properties that follow from others; `is_opacity` says what `Tr` is where there is no `d`.
    fn complete(&mut self, is_opacity: bool, unread: &mut Unread) {
        // Beckmann roughness of a Phong lobe: alpha^2 = 2 / (n + 2) (Walter et al. 2007); glTF's
        // roughness is the square root of alpha.
        let phong = |n: f32| (2.0 / (n.max(0.0) + 2.0)).powf(0.25);
        let source = &mut self.source;
        if source.roughness.is_some() && source.metallic.is_none() {
            unread.see("`Pr` without `Pm`", self.line);
        }
        self.has_roughness = source.roughness.is_some();
        source.roughness = source.roughness.or(source.shininess.map(phong));
        if let Some((opacity, line)) = self.transparency.filter(|_| is_opacity)
            && source.opacity.is_none()
        {
            source.opacity = Some(opacity);
            unread.see(
                "`Tr` as transparency: 1 would hide the material, so it is taken as opacity",
                line,
            );
        } else if let Some((transparency, line)) = self.transparency {
            let opacity = *source.opacity.get_or_insert(1.0 - transparency);
            // Some programs write the opacity as `Tr`, too.
            if (opacity + transparency - 1.0).abs() > 1e-3 {
                unread.see("`Tr` that is not 1 − `d`", line);
            }
        }
        if self.shows_its_surface() {
            self.source.illum = Some(HIGHLIGHTS);
        }
    }

    /// Whether the surface itself shows under an illumination model of glass. The models 4 and 9 are those of opaque surfaces
    /// with `d`, and have no transmitted term; exporters write 4 for all surfaces (Maya), 6 and 9 for those whose `d` is
    /// below 1 (Blender), 7 without an index (Cinema 4D). Metals transmit nothing. Where `d` is 0, glass is all that can be meant.
    fn shows_its_surface(&self) -> bool {
        let opacity = self.source.opacity.unwrap_or(1.0);
        let is_coloured = self.maps[0].is_some()
            || (self.diffuse).is_some_and(|kd| kd.iter().any(|part| *part > BLACK));
        let is_covered_in_part = 0.0 < opacity && opacity < 1.0 || self.maps[2].is_some();
        let is_unstated = self.source.ior.is_none() && self.source.filter.is_none();
        let is_metal = self.source.metallic.is_some_and(|metallic| metallic >= 0.5);
        match self.source.illum {
            Some(4 | 9) => is_metal || is_covered_in_part || opacity >= 1.0 && is_coloured,
            Some(6) => is_metal || is_covered_in_part || is_coloured && is_unstated,
            Some(7) => is_metal || is_coloured && is_unstated,
            _ => false,
        }
    }
}

/// The illumination model of surfaces with highlights.
const HIGHLIGHTS: u8 = 2;

/// Most values that a statement takes, if it takes numbers alone.
fn values_of(key: &str) -> Option<usize> {
    match key {
        "kd" | "ke" | "ks" | "tf" => Some(3),
        "ns" | "ni" | "tr" | "pr" | "pm" | "illum" => Some(1),
        _ => None,
    }
}

/// Keywords of colours.
const COLORS: [&str; 4] = ["kd", "ke", "ks", "tf"];

/// Keywords of [`Definition::maps`].
const MAPS: [&str; 4] = ["map_kd", "map_ke", "map_d", "norm"];

/// Sets a property; false if there is no value.
fn set<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    let is_some = value.is_some();
    *place = value.or(place.take());
    is_some
}

/// The finite numbers at the beginning of a statement, behind `-halo`, which `d` may have.
fn numbers(text: &str) -> Vec<f32> {
    let words = text.split_whitespace().skip_while(|word| *word == "-halo");
    let finite = |word| number(word).filter(|x: &f32| x.is_finite());
    words.map_while(finite).take(3).collect()
}

/// An illumination model.
fn model(value: f32) -> Option<u8> {
    ((0.0..=10.0).contains(&value) && value.fract() == 0.0).then_some(value as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_statements_are_named_with_their_line_and_the_rest_is_kept() {
        let text = "Kd 1 1 1\nnewmtl a\nkd 0.5 # grey\nKs 1 x 1\nNs\nillum 999\n\tKe\t1 2 3e0 4\nKs\n\
                    d -halo 0.25\nTr 0.25\nnewmtl\nKd 1 0\nTr 0.25\nNs 1.0D+01\nillum 2.0\n";
        let mut unread = Unread::default();
        let found = read(text, &mut unread);
        let [a, nameless] = &found[..] else {
            panic!("{} materials", found.len());
        };
        assert_eq!((a.name.as_str(), nameless.name.as_str()), ("a", ""));
        assert_eq!((a.diffuse, nameless.diffuse), (Some([0.5; 3]), None));
        assert_eq!(a.emission, Some([1.0, 2.0, 3.0]));
        assert_eq!((a.source.specular, a.source.illum), (None, None));
        assert_eq!(
            [a.source.opacity, nameless.source.opacity],
            [Some(0.25), Some(0.75)]
        );
        assert_eq!(
            (nameless.source.shininess, nameless.source.illum),
            (Some(10.0), Some(2))
        );
        let note = unread.note().unwrap();
        for part in [
            "statements before the first `newmtl` (line 1)",
            "the value of `Ks` (2 times, first: line 4)",
            "the value of `Ns` (line 5)",
            "the value of `illum` (line 6)",
            "the value of `Kd` (line 12)",
            "`-halo` of `d` (line 9)",
            "what stands behind the values of `Ke` (line 7)",
            "`Tr` that is not 1 − `d` (line 10)",
        ] {
            assert!(note.contains(part), "{note} lacks {part}");
        }
        assert_eq!(note.matches("line ").count(), 8, "{note}");
    }
}
