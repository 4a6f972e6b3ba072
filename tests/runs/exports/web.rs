//! The web page: what it measured once is read by every command; and, where it is built and there is a Chromium, it measures a
//! small scene, every structure passes its gate, it shows the images that `raystone render` makes, and nothing is logged.

mod visitor;

use super::{done, folder_of, text, validator};
use crate::support::{needs, tier};
use raystone::export::record_schema;
use raystone::image::{Image, read_linear};
use serde_json::Value;
use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

/// What the page measured on SwiftShader: [`QUERY`].
const SAMPLE: &str = include_str!("../../data/web-records.jsonl");
/// A small scene in few rounds, started at once, with the records left at the server.
const QUERY: &str = "start&post=/records&only=scene%3Dcornell-box&set=timing.rounds%3D6&set=timing.rays%3D4096&set=gate.rays%3D4096";
/// Settings of a small view.
const VIEWED: [&str; 2] = ["run.resolution=[48,36]", "run.seed=7"];
/// Pixels of 1728 in which a path may go another way on the browser's adapter: drivers round division, roots and sines otherwise.
const MOST_TIES: usize = 17;
/// The driver that the browser brings along.
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";
/// How long a software adapter may take, with its compiler.
const PATIENCE: Duration = Duration::from_secs(900);

fn lines(records: &str) -> Vec<Value> {
    let lines = records.lines();
    lines
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// Checks records of the page: of the schema, every structure gated and timed in five classes, on a named software adapter.
fn check(records: &str) {
    let (schema, lines) = (record_schema(), lines(records));
    for line in &lines {
        validator::validate(&schema, &schema, line).expect("a record");
    }
    let run = &lines[0]["body"];
    let environment = &run["environment"];
    assert_eq!(run["kind"], "run");
    assert_eq!(environment["backend"], "webgpu");
    assert_eq!(environment["software"], true, "{environment:#}");
    assert!(
        environment["adapter"]
            .as_str()
            .is_some_and(|a| a.contains("swiftshader")),
        "{environment:#}"
    );
    assert!(
        environment["browser"]
            .as_str()
            .is_some_and(|b| b.contains("Chrome")),
        "{environment:#}"
    );
    let structures: Vec<&Value> = lines
        .iter()
        .map(|line| &line["body"])
        .filter(|body| body["kind"] == "structure")
        .collect();
    assert_eq!(structures.len(), 10);
    for structure in structures {
        assert_eq!(structure["gate"]["passed"], true, "{structure:#}");
        assert_eq!(
            structure["gate"]["classes"].as_array().map(Vec::len),
            Some(6)
        );
        let timings = structure["timings"].as_array().expect("timings");
        assert_eq!(timings.len(), 5, "{structure:#}");
        for timing in timings {
            assert!(
                timing["mrays_s"]["value"].as_f64() > Some(0.0),
                "{timing:#}"
            );
            assert!(
                timing["ms"].as_array().is_some_and(|ms| ms.len() >= 5),
                "{timing:#}"
            );
        }
    }
    assert_eq!(lines.last().expect("lines")["body"]["kind"], "finished");
}

/// Every command that reads runs reads these records.
fn read(records: &str) {
    let folder = folder_of(records);
    let dir = text(folder.path());
    let inspected = done(&["inspect", dir]);
    assert!(inspected.contains("10 of 10 cells"), "{inspected}");
    done(&["report", dir]);
    let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
    assert!(page.contains("swiftshader") && page.contains("cwbvh"));
    assert!(done(&["export", dir, "--format", "csv"]).contains("mrays-per-s"));
    done(&["compare", dir, dir]);
    let site = folder.path().join("site");
    let gallery = done(&["gallery", dir, "--out", text(&site)]);
    assert!(gallery.contains("swiftshader"), "{gallery}");
}

#[test]
fn records_of_the_web_page_are_read_like_those_of_a_run() {
    check(SAMPLE);
    read(SAMPLE);
    // The checks can fail.
    for (what, with) in [
        ("\"passed\":true", "\"passed\":false"),
        ("\"webgpu\"", "\"vulkan\""),
        ("\"timings\":[{", "\"timings\":[7,{"),
    ] {
        let wrong = SAMPLE.replacen(what, with, 1);
        assert_ne!(wrong, SAMPLE);
        assert!(
            std::panic::catch_unwind(|| check(&wrong)).is_err(),
            "{what}"
        );
    }
}

/// The built page: in a run of everything it is built first, in others it is what was built last.
fn built() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let script = |arguments: &[&str]| {
        let mut script = Command::new(root.join("scripts/web"));
        script.args(arguments).output().expect("a shell")
    };
    if tier::is_full() {
        let has_tools = script(&["--check"]);
        if !has_tools.status.success() {
            needs::skip("wasm", String::from_utf8_lossy(&has_tools.stderr).trim());
            return None;
        }
        let made = script(&[]);
        assert!(
            made.status.success(),
            "{}",
            String::from_utf8_lossy(&made.stderr)
        );
    }
    let dist = root.join("web/dist");
    if !dist.join("index.html").exists() {
        needs::skip("wasm", "scripts/web has not built the page; --full does");
        return None;
    }
    Some(dist)
}

/// Answers one request: a file of the page, with a script in it, or what it leaves.
fn answer(
    mut stream: TcpStream,
    (dist, script): (&Path, &str),
    records: &Sender<Value>,
) -> std::io::Result<()> {
    let (mut request, mut part) = (Vec::new(), [0; 1 << 16]);
    let end = loop {
        let count = stream.read(&mut part)?;
        request.extend(&part[..count]);
        if let Some(end) = request.windows(4).position(|w| w == b"\r\n\r\n") {
            break end + 4;
        }
        if count == 0 {
            return Ok(());
        }
    };
    let head = String::from_utf8_lossy(&request[..end]).into_owned();
    let path = head.split_whitespace().nth(1).unwrap_or("/");
    if head.starts_with("POST") {
        let length = head.lines().find_map(|line| {
            line.to_lowercase()
                .strip_prefix("content-length:")?
                .trim()
                .parse()
                .ok()
        });
        let missing = (end + length.unwrap_or(0)).saturating_sub(request.len());
        let mut rest = vec![0; missing];
        stream.read_exact(&mut rest)?;
        request.extend(rest);
        let _ = records.send(serde_json::from_slice(&request[end..]).unwrap_or_default());
        return stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n");
    }
    let name = path
        .split('?')
        .next()
        .unwrap_or("/")
        .trim_start_matches('/');
    let name = if name.is_empty() { "index.html" } else { name };
    let kind = match name.rsplit('.').next() {
        Some("html") => "text/html",
        Some("css") => "text/css",
        Some("js") => "text/javascript",
        _ => "application/wasm",
    };
    let mut body = std::fs::read(dist.join(name)).unwrap_or_default();
    if name == "index.html" {
        let page = String::from_utf8_lossy(&body);
        let with = format!("<script>{script}</script></head>");
        body = page.replacen("</head>", &with, 1).into_bytes();
    }
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(&body)
}

/// A browser that ends with the test.
struct Browser(Child);

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start_browser(address: &str, profile: &Path) -> Option<Browser> {
    let log = std::fs::File::create(profile.join("console")).expect("a writable folder");
    let named = std::env::var("CHROMIUM").into_iter();
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"].map(str::to_owned);
    let started = named.chain(names).find_map(|program| {
        Command::new(program)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-dev-shm-usage",
                "--enable-unsafe-webgpu",
                "--enable-logging=stderr",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg(address)
            .stdout(Stdio::null())
            .stderr(log.try_clone().expect("a file"))
            .spawn()
            .ok()
    });
    if started.is_none() {
        needs::skip("chromium", "there is none on the path, nor in $CHROMIUM");
    }
    started.map(Browser)
}

/// What the page leaves at the server when it is opened with this query, in a browser that logs nothing.
fn told(query: &str) -> Option<Value> {
    told_with(query, "")
}

/// The same of a page with a script in it.
fn told_with(query: &str, script: &str) -> Option<Value> {
    let dist = built()?;
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let (sender, left) = channel();
    let script = script.to_owned();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (dist, script, sender) = (dist.clone(), script.clone(), sender.clone());
            std::thread::spawn(move || answer(stream, (&dist, &script), &sender));
        }
    });
    let profile = tempfile::tempdir().expect("a folder");
    let browser = start_browser(&format!("http://127.0.0.1:{port}/?{query}"), profile.path())?;
    let log = || {
        let log = std::fs::read(profile.path().join("console")).unwrap_or_default();
        let log = String::from_utf8_lossy(&log).into_owned();
        log.lines()
            .filter(|line| line.contains("CONSOLE"))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let told = left
        .recv_timeout(PATIENCE)
        .unwrap_or_else(|_| panic!("no answer: {:?}", log()));
    drop(browser);
    assert_eq!(told["trouble"], "", "{told:#}");
    assert_eq!(log(), Vec::<String>::new());
    Some(told)
}

#[test]
fn the_web_page_measures_and_every_structure_passes_its_gate() {
    let Some(told) = told(QUERY) else { return };
    let records = told["records"].as_str().expect("records");
    check(records);
    read(records);
}

/// The image that `raystone render` makes of these settings, on the adapter of the tests or with this driver of Vulkan.
fn rendered(settings: &[String], driver: Option<&Path>) -> Image {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("native.pfm");
    let mut arguments = vec!["render", "-o", text(&file)];
    arguments.extend(settings.iter().flat_map(|s| ["--set", s.as_str()]));
    let mut render = super::command(&arguments);
    if let Some(driver) = driver {
        render
            .env("VK_DRIVER_FILES", driver)
            .env("VK_ICD_FILENAMES", driver);
        render.env("WGPU_BACKEND", "vulkan");
    }
    let output = render.output().expect("the program starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    read_linear(&file).expect("an image")
}

/// Pixels whose bits differ, and those of them that differ by more than rounding: a path went another way.
fn differing(image: &Image, other: &Image) -> [usize; 2] {
    assert_eq!(image.pixels.len(), other.pixels.len());
    let beyond = |(a, b): (&[f32; 3], &[f32; 3])| {
        a.iter()
            .zip(b)
            .any(|(a, b)| (a - b).abs() > 1e-3 * a.abs().max(b.abs()))
    };
    let pairs = || image.pixels.iter().zip(&other.pixels);
    [
        pairs().filter(|(a, b)| a != b).count(),
        pairs().filter(|pair| beyond(*pair)).count(),
    ]
}

/// The image of bytes that the page left.
fn left_image(bytes: &Value) -> Image {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes: Vec<u8> = serde_json::from_value(bytes.clone()).expect("bytes");
    let file = folder.path().join("page.pfm");
    std::fs::write(&file, bytes).expect("a writable folder");
    read_linear(&file).expect("an image")
}

/// Holds an image of the page against that of `raystone render`.
fn check_image(image: &Image, settings: &[String]) {
    // With the driver that the browser brings along, no bit is another one.
    let driver = Path::new(SWIFTSHADER);
    if driver.exists() {
        assert_eq!(differing(image, &rendered(settings, Some(driver))), [0, 0]);
    }
    let [bits, beyond] = differing(image, &rendered(settings, None));
    assert!(
        beyond <= MOST_TIES,
        "{bits} pixels differ, {beyond} by more than rounding"
    );
}

#[test]
fn the_web_page_shows_the_images_of_raystone_render() {
    let settings = [
        VIEWED.map(str::to_owned).to_vec(),
        vec!["run.spp=[4]".to_owned()],
    ]
    .concat();
    let query: String = settings
        .iter()
        .map(|s| format!("&set={}", s.replace('=', "%3D")))
        .collect();
    let Some(told) = told(&format!("view&split&post=/images{query}")) else {
        return;
    };
    let images: Vec<Image> = told["images"]
        .as_array()
        .expect("two images")
        .iter()
        .map(left_image)
        .collect();
    for (side, figures) in told["figures"]["sides"]
        .as_array()
        .expect("figures")
        .iter()
        .enumerate()
    {
        assert_eq!(figures["spp"], 4, "{side}: {figures:#}");
        assert!(figures["fault"].is_null(), "{figures:#}");
        assert!(figures["mrays_s"].as_f64() > Some(0.0), "{figures:#}");
    }
    // A structure changes no image, in a browser no more than elsewhere.
    let [first, second] = &images[..] else {
        panic!("{} images", images.len())
    };
    assert_eq!(differing(first, second), [0, 0]);
    check_image(first, &settings);
    // The check can fail: another seed is another image.
    let other = [settings, vec!["run.seed=8".to_owned()]].concat();
    assert!(differing(first, &rendered(&other, None))[1] > 10 * MOST_TIES);
}
