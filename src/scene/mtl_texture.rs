//! Texture statements of material libraries: options, then the file.

use super::obj_statements::number;
use super::{AlphaChannel, TextureUse, Wrap};
use glam::{Mat2, Vec2};

/// A parsed statement such as `-s 2 2 -clamp on wall.png`.
pub(super) struct Statement {
    /// Path as it is written.
    pub file: String,
    /// Its use, with a placeholder texture index, for coordinates with v pointing down.
    pub place: TextureUse,
    /// The channel used as a scalar (`-imfchan`), if given.
    pub channel: Option<AlphaChannel>,
    /// Options that are not read.
    pub skipped: Vec<String>,
}

/// Reads the options `-s`, `-o`, `-clamp`, `-bm` and `-imfchan`, and names others that would change
/// the texture.
pub(super) fn statement(text: &str) -> Statement {
    let mut place = TextureUse::plain(0);
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let mut channel = None;
    let mut skipped = Vec::new();
    let mut rest = text.trim();
    while rest.starts_with('-') {
        let (written, after) = first_word(rest);
        let option = &*written.to_ascii_lowercase();
        // The file, whose name may begin so, too.
        if after.is_empty() && !OPTIONS.contains(&option) {
            break;
        }
        rest = after;
        let (value, _) = first_word(rest);
        // -o, -s, -t take one to three numbers, -mm two, the others one word.
        let (least, most) = match option {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            _ => (1, 1),
        };
        let mut numbers = Vec::new();
        for taken in 0..most {
            let (word, after) = first_word(rest);
            let number = number(word);
            if option == "-imfchan" {
                channel = channel_of(word);
            }
            // The last word is the file, whatever it looks like: `nano.png` is no number that a program wrote oddly.
            if taken >= least && (number.is_none() || after.is_empty()) {
                break;
            }
            numbers.extend(number.filter(|x: &f32| x.is_finite()));
            rest = after;
        }
        let pair = |default: Vec2| {
            let part = |k: usize| numbers.get(k).copied().unwrap_or(default[k]);
            Vec2::new(part(0), part(1))
        };
        match option {
            "-s" => scale = pair(scale),
            "-o" => offset = pair(offset),
            "-bm" => place.scale = numbers.first().copied().unwrap_or(1.0),
            "-clamp" if value.eq_ignore_ascii_case("on") => place.wrap = [Wrap::Clamp; 2],
            "-clamp" if value.eq_ignore_ascii_case("off") => {}
            "-imfchan" if channel.is_some() => {}
            "-mm" if numbers == [0.0, 1.0] => {}
            "-blendu" | "-blendv" if value.eq_ignore_ascii_case("on") => {}
            "-cc" if value.eq_ignore_ascii_case("off") => {}
            _ => skipped.push(written.to_owned()),
        }
    }
    // v' = s v + o pointing up is v' = s v + 1 - s - o pointing down.
    place.linear = Mat2::from_diagonal(scale);
    place.offset = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    Statement {
        file: rest.to_owned(),
        place,
        channel,
        skipped,
    }
}

/// The options of the standard.
const OPTIONS: [&str; 12] = [
    "-blendu", "-blendv", "-bm", "-boost", "-cc", "-clamp", "-imfchan", "-mm", "-o", "-s", "-t",
    "-texres",
];

fn channel_of(letter: &str) -> Option<AlphaChannel> {
    Some(match letter {
        "r" => AlphaChannel::Red,
        "g" => AlphaChannel::Green,
        "b" => AlphaChannel::Blue,
        "m" => AlphaChannel::Alpha,
        "l" => AlphaChannel::Luminance,
        _ => return None,
    })
}

fn first_word(text: &str) -> (&str, &str) {
    let (word, after) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, after.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_or_skipped() {
        for (text, file) in [
            ("a b.png", "a b.png"),
            ("-s 1 1 1 -o 0 0 a.png", "a.png"),
            ("-clamp off -mm 0 1 dir\\a.png", "dir\\a.png"),
            ("-S 1 1 1 -CLAMP off a.png", "a.png"),
            ("-s 1 1 1 -tex.png", "-tex.png"),
            ("-s", ""),
        ] {
            let found = statement(text);
            assert_eq!(found.file, file, "{text}");
            assert!(found.place.is_plain(), "{text}: {:?}", found.place);
        }
        let found = statement("-s 2 4 -o 0.5 0.25 -clamp on -bm 0.5 a.png");
        assert_eq!(found.file, "a.png");
        let masked = statement("-imfchan r -s 2 2 leaf.png");
        assert_eq!(masked.channel, Some(AlphaChannel::Red));
        assert_eq!((masked.file.as_str(), found.channel), ("leaf.png", None));
        let place = found.place;
        assert_eq!((place.wrap, place.scale), ([Wrap::Clamp; 2], 0.5));
        // The surface's upper left corner, v = 0 pointing down, is v = 1 pointing up.
        let corner = place.linear * Vec2::ZERO + place.offset;
        assert_eq!(corner, Vec2::new(0.5, 1.0 - (4.0 + 0.25)));
        let odd = statement("-blendu on -blendv off -mm 0.1 1 -boost 2 a.png");
        assert_eq!(odd.file, "a.png");
        assert_eq!(odd.skipped, ["-blendv", "-mm", "-boost"]);
        let odd = statement("-imfchan z -clamp ON -clamp maybe a.png");
        assert_eq!((odd.place.wrap, odd.channel), ([Wrap::Clamp; 2], None));
        assert_eq!(odd.skipped, ["-imfchan", "-clamp"]);
        for (text, file) in [
            ("-s 2 2 nano_tex.png", "nano_tex.png"),
            ("-o 0.5 nandina.png", "nandina.png"),
            ("-t 0 tile.#1.png", "tile.#1.png"),
            ("-s 2 2 2 infinity.png", "infinity.png"),
            ("-bm 1 1.png", "1.png"),
        ] {
            assert_eq!(statement(text).file, file);
        }
        assert_eq!(
            statement("-s 2 a.png").place.linear,
            Mat2::from_diagonal(Vec2::new(2.0, 1.0))
        );
    }
}
