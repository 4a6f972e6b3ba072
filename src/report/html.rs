//! The document as one self-contained page.

use super::ReportError;
use super::document::Document;
use minijinja::value::Serde;
use minijinja::{Environment, context};

/// Placeholder of the nonce until that is known.
const PLACE: &str = "NONCE-OF-THIS-PAGE";

/// Returns the page: plots inlined as SVG, pictures as `data:` addresses, nothing fetched. Its policy allows no script
/// but its own, marked by a nonce: the hash of the page, which nothing in the page can know beforehand.
///
/// # Errors
/// [`ReportError::Template`].
pub fn page(document: &Document) -> Result<String, ReportError> {
    let mut environment = Environment::new();
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
