//! The document as one self-contained page.

use super::ReportError;
use super::document::Document;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, context};
use raystone_core::text::escape::xml;

/// Placeholder of the nonce until that is known.
const PLACE: &str = "NONCE-OF-THIS-PAGE";

/// Returns the page: plots inlined as SVG, pictures as `data:` addresses, nothing fetched. Its policy allows no script
/// but its own, marked by a nonce: the hash of the page, which nothing in the page can know beforehand.
///
/// # Errors
/// [`ReportError::Template`].
pub fn page(document: &Document) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.add_filter("breakable", |text: &str| marked(text, breakable));
    environment.add_filter("words", |text: &str| marked(text, xml));
    // The name's extension turns escaping on.
    environment.add_template("page.html", include_str!("template.html"))?;
    let page = environment.get_template("page.html")?.render(context! {
        doc => Serde(document),
        css => include_str!("page.css"),
        js => include_str!("page.js"),
        nonce => PLACE,
    })?;
    let nonce = blake3::hash(page.as_bytes()).to_hex();
    let (policy, rest) = page.split_once(PLACE).unwrap_or((&page, ""));
    let (body, script) = rest.rsplit_once(PLACE).unwrap_or((rest, ""));
    Ok([policy, body, script].join(&nonce))
}

/// A text with what stands between two backticks as code; each part is escaped by `escaped`.
fn marked(text: &str, escaped: fn(&str) -> String) -> Value {
    let parts: Vec<&str> = text.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return Value::from_safe_string(escaped(text));
    }
    let part = |(number, part): (usize, &&str)| match number % 2 {
        0 => escaped(part),
        _ => format!("<code>{}</code>", escaped(part)),
    };
    Value::from_safe_string(parts.iter().enumerate().map(part).collect())
}

/// A text of a cell, in which lines may break behind the commas of a label, which no blank follows, and no digit as in numbers.
fn breakable(text: &str) -> String {
    let mut parts = text.split(',');
    let first = xml(parts.next().unwrap_or_default());
    parts.fold(first, |whole, part| {
        let is_label = part.starts_with(char::is_alphabetic);
        let comma = if is_label { ",<wbr>" } else { "," };
        whole + comma + &xml(part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_break_behind_commas_and_stay_escaped() {
        assert_eq!(breakable("a(b=1,c=2)"), "a(b=1,<wbr>c=2)");
        assert_eq!(breakable("<b>&, 65,536"), "&lt;b&gt;&amp;, 65,536");
    }

    #[test]
    fn names_between_backticks_are_code() {
        let words = |text| marked(text, xml).to_string();
        assert_eq!(
            words("`a<b` and `c`"),
            "<code>a&lt;b</code> and <code>c</code>"
        );
        assert_eq!(words("a ` alone"), "a ` alone");
        let label = marked("see `a(b=1,c=2)`", breakable).to_string();
        assert_eq!(label, "see <code>a(b=1,<wbr>c=2)</code>");
    }
}
