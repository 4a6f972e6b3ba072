//! The document as one self-contained page.

use super::ReportError;
use super::document::Document;
use minijinja::value::Serde;
use minijinja::{Environment, context};

/// The page: plots inlined as SVG, pictures as `data:` addresses, no script, nothing fetched.
pub fn page(document: &Document) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    // The name's extension turns escaping on.
    environment.add_template("page.html", include_str!("template.html"))?;
    Ok(environment
        .get_template("page.html")?
        .render(context! { doc => Serde(document) })?)
}
