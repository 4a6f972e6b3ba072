//! Escapes text for LaTeX, Markdown, XML and terminals. Labels come from untrusted files, so every
//! text is shown and never interpreted; all writers of this program escape here.

use std::fmt::Write as _;

/// Makes text safe for terminals and pages: control, bidirectional and zero-width characters are
/// shown as numbers, and line ends as blanks.
pub fn visible(text: &str) -> String {
    let acts = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
    };
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' => out.push(' '),
            c if acts(c) => number(&mut out, c, ["[", "]"]),
            c => out.push(c),
        }
    }
    out
}

fn number(out: &mut String, c: char, [open, close]: [&str; 2]) {
    let _ = write!(out, "{open}U+{:04X}{close}", u32::from(c));
}

/// Escapes a line of Markdown, also for forges: no markup, tags, links, or mentions.
pub fn markdown(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Pages turn addresses into links.
    for c in visible(text).replace("://", ":\u{2060}//").chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '@' => out += "&#64;",
            '#' => out += "&#35;",
            '\\' | '`' | '*' | '_' | '|' | '[' | ']' | '~' | '!' | '$' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

/// Escapes text or an attribute of XML 1.0, and so SVG; control characters are shown as numbers.
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' => out += "&#10;",
            '\t' => out += "&#9;",
            '\u{0}'..='\u{1f}' | '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => {
                number(&mut out, c, ["[", "]"]);
            }
            c => out.push(c),
        }
    }
    out
}

/// Superscript characters and their plain counterparts.
const RAISED: [&str; 2] = ["⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺ⁿ", "0123456789-+n"];
/// Subscript characters and their plain counterparts.
const LOWERED: [&str; 2] = ["₀₁₂₃₄₅₆₇₈₉ᵢ", "0123456789i"];

/// Maps a character of the first list to the second.
fn counterpart(c: char, [from, to]: [&str; 2]) -> Option<char> {
    let mut pairs = from.chars().zip(to.chars());
    pairs.find(|(known, _)| *known == c).map(|(_, other)| other)
}

/// Raises digits and signs; other characters are unchanged.
pub fn raised(exponent: &str) -> String {
    let up = |c| counterpart(c, [RAISED[1], RAISED[0]]).unwrap_or(c);
    exponent.chars().map(up).collect()
}

/// Escapes a paragraph or table cell of LaTeX, for pdfTeX, XeTeX and LuaTeX alike. Brackets and
/// stars are protected from `\\`, which would take them as arguments, and hyphens from each other;
/// non-ASCII characters without a command are shown as numbers.
pub fn latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars();
    while let Some(c) = rest.clone().next() {
        // Consecutive raised characters are one exponent: two in a row are an error.
        for (mark, table) in [('^', RAISED), ('_', LOWERED)] {
            let inside: String = rest.clone().map_while(|c| counterpart(c, table)).collect();
            if let Some(last) = inside.chars().count().checked_sub(1) {
                let _ = write!(out, "${mark}{{{inside}}}$");
                rest.nth(last);
            }
        }
        if counterpart(c, RAISED).or(counterpart(c, LOWERED)).is_some() {
            continue;
        }
        rest.next();
        match latex_command(c) {
            Some(command) => out += command,
            None if "[]*-".contains(c) => out.extend(['{', c, '}']),
            None if "#$%&_{}".contains(c) => out.extend(['\\', c]),
            None if matches!(c, ' '..='~') => out.push(c),
            None => number(&mut out, c, ["{[}", "{]}"]),
        }
    }
    out
}

/// The command for a character that LaTeX interprets or cannot read.
#[rustfmt::skip]
fn latex_command(c: char) -> Option<&'static str> {
    Some(match c {
        '\n' | '\t' | '\r' => " ",
        '\\' => "\\textbackslash{}", '~' => "\\textasciitilde{}", '^' => "\\textasciicircum{}",
        '<' => "\\textless{}", '>' => "\\textgreater{}", '|' => "\\textbar{}", '"' => "{\\char34}",
        '\'' => "\\textquotesingle{}", '`' => "\\textasciigrave{}", '’' => "\\textquoteright{}",
        '–' | '─' => "--", '—' => "---", '…' => "\\dots{}", '\u{a0}' | '\u{202f}' => "~", '\u{2060}' => "",
        '−' => "$-$", '×' => "$\\times$", '·' => "$\\cdot$", '±' => "$\\pm$", '∓' => "$\\mp$", '÷' => "$\\div$",
        '≤' => "$\\le$", '≥' => "$\\ge$", '≠' => "$\\ne$", '≈' => "$\\approx$", '√' => "$\\surd$", '∞' => "$\\infty$",
        '∂' => "$\\partial$", '∫' => "$\\int$", 'Σ' | '∑' => "$\\Sigma$", 'Π' => "$\\Pi$", 'Λ' => "$\\Lambda$", 'Δ' => "$\\Delta$",
        '⌊' => "$\\lfloor$", '⌋' => "$\\rfloor$", '⌈' => "$\\lceil$", '⌉' => "$\\rceil$", '‖' => "$\\Vert$", '′' => "$'$",
        '→' => "$\\to$", '←' => "$\\gets$", '°' => "$^\\circ$", '½' => "$\\frac12$", '∎' => "$\\bullet$",
        '†' => "$\\dagger$", '‡' => "$\\ddagger$", '§' => "\\S{}",
        'α' => "$\\alpha$", 'β' => "$\\beta$", 'γ' => "$\\gamma$", 'δ' => "$\\delta$", 'ε' => "$\\varepsilon$",
        'θ' => "$\\theta$", 'κ' => "$\\kappa$", 'λ' => "$\\lambda$", 'µ' | 'μ' => "$\\mu$", 'π' => "$\\pi$",
        'ρ' => "$\\rho$", 'σ' => "$\\sigma$", 'τ' => "$\\tau$", 'φ' => "$\\varphi$", 'χ' => "$\\chi$", 'ω' => "$\\omega$",
        'ä' => "{\\\"a}", 'ö' => "{\\\"o}", 'ü' => "{\\\"u}", 'Ä' => "{\\\"A}", 'Ö' => "{\\\"O}", 'Ü' => "{\\\"U}", 'ß' => "\\ss{}",
        'á' => "{\\'a}", 'é' => "{\\'e}", 'í' => "{\\'i}", 'ó' => "{\\'o}", 'è' => "{\\`e}", 'ñ' => "{\\~n}",
        'č' => "{\\v c}", 'š' => "{\\v s}",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latex_shows_every_character_and_runs_none() {
        for (text, expected) in [
            (
                "\\input{/etc/passwd}%$x_1^2&#",
                "\\textbackslash{}input\\{/etc/passwd\\}\\%\\$x\\_1\\textasciicircum{}2\\&\\#",
            ),
            ("[1] *", "{[}1{]} {*}"),
            ("中\u{1b}", "{[}U+4E2D{]}{[}U+001B{]}"),
            ("6.33·10⁻⁴", "6.33$\\cdot$10$^{-4}$"),
            ("−1.23·10¹²³ ‡", "$-$1.23$\\cdot$10$^{123}$ $\\ddagger$"),
            ("x₁₂², 5 %", "x$_{12}$$^{2}$, 5 \\%"),
            (
                "≥ ≤ – √×μ ~ ö",
                "$\\ge$ $\\le$ -- $\\surd$$\\times$$\\mu$ \\textasciitilde{} {\\\"o}",
            ),
            ("", ""),
        ] {
            assert_eq!(latex(text), expected, "{text}");
        }
        let ascii: String = (0..128u8).map(char::from).collect();
        assert!(latex(&ascii).is_ascii());
    }

    #[test]
    fn raised_digits_come_back_from_latex() {
        for exponent in ["-4", "6", "123", "-308", "0", "+7"] {
            assert_eq!(latex(&raised(exponent)), format!("$^{{{exponent}}}$"));
        }
    }

    #[test]
    fn markdown_and_xml_show_what_would_be_markup() {
        assert_eq!(
            markdown("a|b <i> @x #1 http://y\n\u{202e}"),
            "a\\|b &lt;i&gt; &#64;x &#35;1 http:\u{2060}//y \\[U+202E\\]"
        );
        assert_eq!(
            xml("<a b=\"&\">\n\u{1}λ"),
            "&lt;a b=&quot;&amp;&quot;&gt;&#10;[U+0001]λ"
        );
        assert_eq!(visible("a\u{202e}b\u{feff}\n"), "a[U+202E]b[U+FEFF] ");
    }
}
