//! The page as a host: JavaScript functions that show, keep and wait.

use crate::{Host, Shell};
use js_sys::Promise;
use raystone_gpu::{Gpu, GpuError, KernelLibrary, open_in_browser};
use raystone_record::Line;
use serde_json::Value;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

#[wasm_bindgen]
extern "C" {
    /// What the worker hands in.
    pub type Page;

    #[wasm_bindgen(method)]
    fn write(this: &Page, line: &str);
    #[wasm_bindgen(method)]
    fn say(this: &Page, what: &str, share: f64);
    /// Resolves when the page may go on.
    #[wasm_bindgen(method)]
    fn allowed(this: &Page) -> Promise;
    /// What the browser says of its adapter.
    #[wasm_bindgen(method)]
    fn adapter(this: &Page) -> String;
    #[wasm_bindgen(method)]
    fn browser(this: &Page) -> String;
}

impl Host for Page {
    async fn open(&self, kernels: KernelLibrary) -> Result<Gpu, GpuError> {
        open_in_browser(&self.adapter(), kernels).await
    }

    async fn allowed(&self) {
        // The page never rejects it; if it did, there would be nothing to wait for.
        let _ = JsFuture::from(Page::allowed(self)).await;
    }

    fn write(&self, line: &Line) {
        match serde_json::to_string(line) {
            Ok(line) => Page::write(self, &line),
            Err(error) => Page::say(self, &format!("a record cannot be written: {error}"), 0.0),
        }
    }

    fn say(&self, what: &str, share: f64) {
        Page::say(self, what, share);
    }

    fn browser(&self) -> Option<String> {
        Some(Page::browser(self))
    }
}

#[wasm_bindgen]
extern "C" {
    /// What the worker of a view hands in.
    pub type Canvas;

    #[wasm_bindgen(method)]
    fn ask(this: &Canvas) -> Option<String>;
    #[wasm_bindgen(method)]
    fn glance(this: &Canvas) -> Option<String>;
    #[wasm_bindgen(method)]
    fn file(this: &Canvas, place: usize) -> Vec<u8>;
    #[wasm_bindgen(method)]
    fn overtaken(this: &Canvas) -> bool;
    #[wasm_bindgen(method)]
    fn allowed(this: &Canvas, idle: bool) -> Promise;
    #[wasm_bindgen(method)]
    fn tell(this: &Canvas, news: &str);
    #[wasm_bindgen(method)]
    fn draw(this: &Canvas, figures: &str, width: u32, height: u32, picture: &[u8]);
    #[wasm_bindgen(method)]
    fn save(this: &Canvas, name: &str, bytes: &[u8]);
    #[wasm_bindgen(method)]
    fn adapter(this: &Canvas) -> String;
}

impl Shell for Canvas {
    async fn open(&self, kernels: KernelLibrary) -> Result<Gpu, GpuError> {
        open_in_browser(&self.adapter(), kernels).await
    }

    async fn allowed(&self, idle: bool) {
        // The page never rejects it; if it did, there would be nothing to wait for.
        let _ = JsFuture::from(Canvas::allowed(self, idle)).await;
    }

    fn ask(&self) -> Option<String> {
        Canvas::ask(self)
    }

    fn glance(&self) -> Option<String> {
        Canvas::glance(self)
    }

    fn file(&self, place: usize) -> Vec<u8> {
        Canvas::file(self, place)
    }

    fn is_overtaken(&self) -> bool {
        self.overtaken()
    }

    fn tell(&self, news: &Value) {
        Canvas::tell(self, &news.to_string());
    }

    fn draw(&self, figures: &Value, [width, height]: [u32; 2], picture: &[u8]) {
        Canvas::draw(self, &figures.to_string(), width, height, picture);
    }

    fn save(&self, name: &str, bytes: &[u8]) {
        Canvas::save(self, name, bytes);
    }
}

#[wasm_bindgen]
extern "C" {
    /// Tells the page of a fault of this program, after which nothing answers.
    #[wasm_bindgen(js_name = raystoneFault)]
    fn fault(text: &str);
}

/// Measures the embedded experiment with `overrides` (`section.key=value`) and filters `only` (`axis=pattern`), each one a line.
///
/// # Errors
/// What to show to the visitor.
#[wasm_bindgen]
pub async fn measure(page: Page, overrides: String, only: String) -> Result<(), JsValue> {
    tell_of_panics();
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let measured = crate::run(&page, &lines(&overrides), &lines(&only)).await;
    measured.map_err(|reason| JsValue::from_str(&reason))
}

/// Shows what the page asks for, until its worker is ended.
///
/// # Errors
/// What to show to the visitor.
#[wasm_bindgen]
pub async fn view(canvas: Canvas) -> Result<(), JsValue> {
    tell_of_panics();
    let ended = crate::view(&canvas).await;
    ended.map_err(|reason| JsValue::from_str(&reason))
}

/// Nothing here is meant to panic; if something does, the visitor reads it in place of a page that waits for ever.
fn tell_of_panics() {
    std::panic::set_hook(Box::new(|info| fault(&info.to_string())));
}
