//! Chromium without a window: a page in a frame of some width, with a script that examines it.

use crate::support::needs;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The package fetched from npm, once.
const AXE: &str = "axe-core@4.10.3";

/// A browser that was found.
pub struct Browser {
    program: PathBuf,
    axe: Option<String>,
}

/// The results of a visit.
#[derive(Debug)]
pub struct Seen {
    found: Value,
    /// The console log of the page.
    pub console: Vec<String>,
}

impl Browser {
    /// The browser in `$CHROMIUM`, else on the path; reports if there is none.
    pub fn find() -> Option<Self> {
        let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
        let names = ["chromium", "chromium-browser", "google-chrome", "chrome"].map(PathBuf::from);
        let runs = |program: &PathBuf| {
            let said = Command::new(program).arg("--version").output();
            said.is_ok_and(|said| said.status.success())
        };
        let found = named.into_iter().chain(names).find(runs);
        if found.is_none() {
            needs::skip("chromium", "there is none on the path, nor in $CHROMIUM");
        }
        found.map(|program| Self {
            program,
            axe: axe(),
        })
    }

    /// The document after loading, as text.
    pub fn dump(&self, page: &Path) -> String {
        let (dom, _) = self.run(page, &[]);
        dom
    }

    fn run(&self, page: &Path, more: &[&str]) -> (String, String) {
        let profile = tempfile::tempdir().expect("a folder");
        let page = page.canonicalize().expect("a page");
        let said = Command::new(&self.program)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--window-size=1500,1000",
            ])
            .args([
                "--virtual-time-budget=300000",
                "--enable-logging=stderr",
                "--dump-dom",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(more)
            .arg(format!("file://{}", page.display()))
            .output()
            .expect("a browser");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (text(&said.stdout), text(&said.stderr))
    }

    /// Examines a page in a frame of this width: sorts the table whose caption begins with `table` by `column`, and
    /// compares images at `pixel`.
    pub fn visit(
        &self,
        page: &str,
        width: u32,
        dark: bool,
        table: &str,
        column: usize,
        pixel: [u32; 2],
    ) -> Seen {
        let nonce = page
            .split("script-src 'nonce-")
            .nth(1)
            .and_then(|rest| rest.split('\'').next());
        let nonce = nonce.expect("a policy");
        let wanted = serde_json::json!({ "table": table, "column": column, "pixel": pixel });
        let axe = self.axe.as_deref().unwrap_or_default();
        let checks = include_str!("checks.js");
        let script = |text: &str| format!("<script nonce=\"{nonce}\">{text}</script>");
        let scripts =
            script(&format!("window.WANTED = {wanted};")) + &script(axe) + &script(checks);
        let end = page.rfind("</body>").expect("a body");
        let page = format!("{}{scripts}{}", &page[..end], &page[end..]);
        let page = serde_json::to_string(&page)
            .expect("a text")
            .replace("</", "<\\/");
        let outer = format!(
            "<!DOCTYPE html><meta charset=utf-8><body style=\"margin:0\"><iframe id=frame width={width} height=900 style=\"border:0\"></iframe>\
             <pre id=result></pre><script>addEventListener('message', (e) => {{ result.textContent = e.data; }}); frame.srcdoc = {page};</script>"
        );
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("outer.html");
        std::fs::write(&file, outer).expect("a page");
        let scheme = if dark { "0" } else { "1" };
        let scheme = format!("--blink-settings=preferredColorScheme={scheme}");
        // The browser's time does not wait for its frames: on a busy machine none may show the images before it is over.
        let visit = || Seen::of(&self.run(&file, &[&scheme]));
        let mut seen = visit();
        for _ in 0..2 {
            if seen.is("asleep") {
                seen = visit();
            }
        }
        seen
    }
}

impl Seen {
    fn of((dom, log): &(String, String)) -> Self {
        let result = dom
            .rsplit("<pre id=\"result\">")
            .next()
            .and_then(|rest| rest.split("</pre>").next());
        let result = result
            .unwrap_or_default()
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&nbsp;", "\u{a0}")
            .replace("&amp;", "&");
        let console = log
            .lines()
            .filter(|line| line.contains(":CONSOLE"))
            .map(str::to_owned);
        Self {
            found: serde_json::from_str(&result).unwrap_or(Value::Null),
            console: console.collect(),
        }
    }

    /// A finding; none if it was not looked for.
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.found.get(name)
    }

    /// Returns `true` if a finding is true.
    pub fn is(&self, name: &str) -> bool {
        self.found[name] == true
    }

    /// A finding as JSON.
    pub fn text(&self, name: &str) -> String {
        self.found[name].to_string()
    }

    /// A finding that is a text.
    pub fn string(&self, name: &str) -> &str {
        self.found[name].as_str().unwrap_or_default()
    }

    /// A finding that is a number; 0 if it was not looked for.
    pub fn number(&self, name: &str) -> f64 {
        self.found[name].as_f64().unwrap_or(0.0)
    }

    /// A finding that is a list of numbers.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        let list = self.found[name].as_array().expect("a list");
        list.iter().map(|v| v.as_f64().expect("a number")).collect()
    }

    /// A finding that is a list of texts.
    pub fn texts(&self, name: &str) -> Vec<&str> {
        let list = self.found[name].as_array();
        list.map_or(Vec::new(), |list| {
            list.iter().filter_map(Value::as_str).collect()
        })
    }

    /// A finding that is a colour.
    pub fn colour(&self, name: &str) -> [u8; 3] {
        colour(&self.found[name])
    }
}

/// Red, green and blue.
pub fn colour(value: &Value) -> [u8; 3] {
    [0, 1, 2].map(|c| {
        value[c]
            .as_u64()
            .and_then(|v| u8::try_from(v).ok())
            .expect("a colour")
    })
}

/// The text of axe-core, from npm or from an earlier visit there; reports if it cannot be fetched.
fn axe() -> Option<String> {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join(AXE);
    let file = cache.join("package/axe.min.js");
    if !file.exists() {
        std::fs::create_dir_all(&cache).expect("a folder below target");
        let packed = Command::new("npm")
            .args(["pack", "--silent", AXE])
            .current_dir(&cache)
            .output();
        let name = packed.ok().filter(|packed| packed.status.success());
        let unpacked = name.and_then(|packed| {
            let name = String::from_utf8(packed.stdout).ok()?;
            Command::new("tar")
                .args(["xzf", name.trim()])
                .current_dir(&cache)
                .status()
                .ok()
        });
        if !unpacked.is_some_and(|status| status.success()) {
            needs::skip("npm", format!("it does not give {AXE}"));
            return None;
        }
    }
    // It ends no script element of the page that it is put into.
    let text = std::fs::read_to_string(file).expect("axe-core is unpacked");
    Some(text.replace("</script", "<\\/script"))
}
