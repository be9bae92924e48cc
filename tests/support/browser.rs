//! A real Chromium, as a visitor has one: pages are opened, looked at and waited for by its DevTools protocol, which it speaks
//! over a pair of pipes. There is no port, and nothing of the pages knows of it.

use crate::server::{PATIENCE, Process};
use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};
use std::{
    collections::HashMap,
    fs,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{ChildStdin, Command, Stdio},
    sync::{
        Arc, Condvar, Mutex, MutexGuard,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};
use tempfile::TempDir;

/// What Chromium is called on Debian, on Ubuntu and by its maker.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Between two looks at a page that is waited for.
const LOOK: Duration = Duration::from_millis(50);

/// A browser without a window. Dropping it ends it.
#[derive(Debug)]
pub struct Browser {
    wire: Wire,
    _process: Process,
    _profile: TempDir,
}

/// Through what a page is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct View {
    pub width: u32,
    pub height: u32,
    /// The visitor prefers dark pages.
    pub dark: bool,
    pub scripts: bool,
    /// Where the visitor's clock is.
    pub time_zone: &'static str,
}

impl View {
    /// A window on a desk.
    pub const DESK: Self = Self {
        width: 1280,
        height: 900,
        dark: false,
        scripts: true,
        time_zone: "UTC",
    };
    pub const PROJECTOR: Self = Self {
        width: 2560,
        height: 1440,
        ..Self::DESK
    };
    /// The narrowest that pages are made for.
    pub const PHONE: Self = Self {
        width: 320,
        height: 640,
        ..Self::DESK
    };

    /// The same in the dark.
    #[must_use]
    pub const fn dark(self) -> Self {
        Self { dark: true, ..self }
    }

    /// The same where scripts are switched off.
    #[must_use]
    pub const fn without_scripts(self) -> Self {
        Self {
            scripts: false,
            ..self
        }
    }
}

impl Browser {
    /// Starts one whose profile is below `scratch`.
    ///
    /// # Panics
    /// If no Chromium is installed, or it does not start.
    #[must_use]
    pub fn start(scratch: &Path) -> Self {
        let name = NAMES
            .into_iter()
            .find(|name| Command::new(name).arg("--version").output().is_ok())
            .expect("a Chromium is installed; `make setup-test` installs one");
        let profile = tempfile::tempdir_in(scratch).expect("a scratch folder can be made");
        // It reads its orders from descriptor 3 and answers on 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null"])
            .arg(name)
            .args([
                "--headless",
                "--remote-debugging-pipe",
                "--no-sandbox",
                "--disable-gpu",
                // The replay draws in space, here without a graphics card.
                "--enable-unsafe-swiftshader",
                "--disable-quic",
                "--disable-dev-shm-usage",
                "--hide-scrollbars",
                "--no-first-run",
                "--no-proxy-server",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the browser can be started");
        let orders = child.stdin.take().expect("standard input is piped");
        let answers = child.stdout.take().expect("standard output is piped");
        let wire = Wire::new(orders, BufReader::new(answers));
        let browser = Self {
            wire,
            _process: Process(child),
            _profile: profile,
        };
        browser.wire.ask(None, "Browser.getVersion", &json!({}));
        browser
    }

    /// Opens an address on a desk and waits until it is loaded.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn open(&self, url: &str) -> Page<'_> {
        self.open_in(View::DESK, url)
    }

    /// Opens an address in a window of its own, which shares no cookies with others, and waits until it is loaded.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn open_in(&self, view: View, url: &str) -> Page<'_> {
        let context = self
            .wire
            .ask(None, "Target.createBrowserContext", &json!({}));
        let target = self.wire.ask(
            None,
            "Target.createTarget",
            &json!({ "url": "about:blank", "browserContextId": context["browserContextId"] }),
        );
        let attached = self.wire.ask(
            None,
            "Target.attachToTarget",
            &json!({ "targetId": target["targetId"], "flatten": true }),
        );
        let session = attached["sessionId"].as_str();
        let page = Page {
            wire: &self.wire,
            session: session.expect("a session has an id").to_owned(),
        };
        for domain in ["Page", "Runtime", "Log"] {
            page.ask(&format!("{domain}.enable"), &json!({}));
        }
        page.look_through(view);
        page.go(url);
        page
    }
}

/// A window of a browser.
#[derive(Debug)]
pub struct Page<'a> {
    wire: &'a Wire,
    session: String,
}

impl Page<'_> {
    /// Makes the window another.
    ///
    /// # Panics
    /// If the browser has ended.
    pub fn look_through(&self, view: View) {
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            &json!({ "width": view.width, "height": view.height, "deviceScaleFactor": 1, "mobile": false }),
        );
        let scheme = if view.dark { "dark" } else { "light" };
        self.ask(
            "Emulation.setEmulatedMedia",
            &json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] }),
        );
        self.ask(
            "Emulation.setTimezoneOverride",
            &json!({ "timezoneId": view.time_zone }),
        );
        self.ask(
            "Emulation.setScriptExecutionDisabled",
            &json!({ "value": !view.scripts }),
        );
    }

    /// Goes to an address of another document and waits until it is loaded.
    ///
    /// # Panics
    /// If it cannot be loaded at all.
    pub fn go(&self, url: &str) {
        self.mark();
        let gone = self.ask("Page.navigate", &json!({ "url": url }));
        assert!(gone["errorText"].is_null(), "{url}: {}", gone["errorText"]);
        self.wait_for_another();
    }

    /// Does what leads to another document, and waits until that is loaded.
    ///
    /// # Panics
    /// If the expression throws.
    pub fn leave_by(&self, expression: &str) {
        self.mark();
        let _ = self.evaluate(expression);
        self.wait_for_another();
    }

    fn mark(&self) {
        let _ = self.evaluate("window.isBefore = true");
    }

    fn wait_for_another(&self) {
        self.wait_until(
            "window.isBefore === undefined && location.href != 'about:blank' && document.readyState == 'complete'",
        );
    }

    /// Runs a script before those of each document that is loaded from now on.
    ///
    /// # Panics
    /// If the browser has ended.
    pub fn before_scripts(&self, script: &str) {
        let params = json!({ "source": script });
        self.ask("Page.addScriptToEvaluateOnNewDocument", &params);
    }

    /// Bytes that its scripts hold, once what nobody needs is gone.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn script_bytes(&self) -> f64 {
        self.ask("HeapProfiler.collectGarbage", &json!({}));
        let usage = self.ask("Runtime.getHeapUsage", &json!({}));
        usage["usedSize"].as_f64().expect("a number of bytes")
    }

    /// CPU time that its scripts have taken since it was asked first, in s.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn script_s(&self) -> f64 {
        self.ask(
            "Performance.enable",
            &json!({ "timeDomain": "threadTicks" }),
        );
        let measured = self.ask("Performance.getMetrics", &json!({}));
        let metrics = measured["metrics"].as_array().into_iter().flatten();
        let of_scripts = metrics
            .into_iter()
            .find(|metric| metric["name"] == "ScriptDuration");
        let taken = of_scripts.and_then(|metric| metric["value"].as_f64());
        taken.expect("the browser measures it")
    }

    /// Fills fields of the page's form, by their names, and sends it as its button does.
    ///
    /// # Panics
    /// If there is no such form or field.
    pub fn send_form(&self, form: &str, fields: &[(&str, &str)]) {
        self.leave_by(&format!(
            "(() => {{
                const form = document.querySelector({});
                for (const [name, value] of {}) form.elements[name].value = value;
                form.requestSubmit();
            }})()",
            json!(form),
            json!(fields)
        ));
    }

    /// What an expression comes to, after it is settled if it is a promise.
    ///
    /// # Panics
    /// If it throws.
    #[must_use]
    pub fn evaluate(&self, expression: &str) -> Value {
        let answer = self.ask("Runtime.evaluate", &evaluation(expression));
        assert!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {}",
            answer["exceptionDetails"]
        );
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true. What a page that is just being replaced throws is no answer.
    ///
    /// # Panics
    /// After [`PATIENCE`], with the page.
    pub fn wait_until(&self, expression: &str) {
        let started = Instant::now();
        loop {
            let answer = self.wire.call(
                Some(&self.session),
                "Runtime.evaluate",
                &evaluation(&format!("Boolean({expression})")),
            );
            if answer.is_ok_and(|answer| answer["result"]["value"] == true) {
                return;
            }
            assert!(
                started.elapsed() < PATIENCE,
                "still waiting for {expression}:\n{}",
                self.html()
            );
            // Looking now and then is what a visitor does; the pause keeps the CPU for the server.
            thread::sleep(LOOK);
        }
    }

    /// Waits until the page has an element that a selector finds.
    ///
    /// # Panics
    /// After [`PATIENCE`], with the page.
    pub fn wait_for(&self, selector: &str) {
        self.wait_until(&format!("document.querySelector({})", json!(selector)));
    }

    /// The words of the first element that a selector finds, as they are shown.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn text(&self, selector: &str) -> String {
        let text = self.evaluate(&format!(
            "document.querySelector({})?.innerText",
            json!(selector)
        ));
        let text = text.as_str();
        text.unwrap_or_else(|| panic!("{selector} is not on the page"))
            .to_owned()
    }

    /// The document as it is now.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn html(&self) -> String {
        let html = self.evaluate("document.documentElement.outerHTML");
        html.as_str().unwrap_or_default().to_owned()
    }

    /// Presses a key, as `Tab` or `Enter`.
    ///
    /// # Panics
    /// If the browser has ended.
    pub fn press(&self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let code = match key {
                "Tab" => 9,
                "Enter" => 13,
                _ => 0,
            };
            let pressed =
                json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            self.ask("Input.dispatchKeyEvent", &pressed);
        }
    }

    /// A picture of all of the page, as PNG.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn screenshot(&self, file: &Path) {
        self.capture(true, file);
    }

    /// A picture of what its window shows.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn window(&self, file: &Path) {
        self.capture(false, file);
    }

    fn capture(&self, beyond_window: bool, file: &Path) {
        let params = json!({ "captureBeyondViewport": beyond_window });
        let taken = self.ask("Page.captureScreenshot", &params);
        let picture = STANDARD.decode(taken["data"].as_str().unwrap_or_default());
        fs::write(file, picture.expect("a picture in base 64")).expect("a file can be written");
    }

    /// How many CSS pixels the document is wider than its window.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn overflow(&self) -> i64 {
        let root = "document.documentElement";
        let wider = self.evaluate(&format!("{root}.scrollWidth - {root}.clientWidth"));
        wider.as_i64().expect("widths are whole numbers")
    }

    /// What the browser has complained of since the window was opened: exceptions, errors on the console, what
    /// could not be loaded and what the page's own policy refused.
    ///
    /// # Panics
    /// If a thread of the test has panicked.
    #[must_use]
    pub fn console_errors(&self) -> Vec<String> {
        let inbox = self.wire.inbox();
        let of_page = inbox
            .events
            .iter()
            .filter(|event| event["sessionId"] == self.session.as_str());
        of_page.filter_map(complaint).collect()
    }

    fn ask(&self, method: &str, params: &Value) -> Value {
        self.wire.ask(Some(&self.session), method, params)
    }
}

fn evaluation(expression: &str) -> Value {
    json!({ "expression": expression, "awaitPromise": true, "returnByValue": true })
}

/// What an event complains of, if it is a complaint.
fn complaint(event: &Value) -> Option<String> {
    let params = &event["params"];
    let is_error = match event["method"].as_str()? {
        "Runtime.exceptionThrown" => true,
        "Runtime.consoleAPICalled" => params["type"] == "error",
        "Log.entryAdded" => params["entry"]["level"] == "error",
        _ => false,
    };
    is_error.then(|| params.to_string())
}

/// Two pipes: orders, and what comes back.
#[derive(Debug)]
struct Wire {
    orders: Mutex<ChildStdin>,
    next: AtomicU64,
    came: Arc<(Mutex<Inbox>, Condvar)>,
}

/// What has come back.
#[derive(Debug, Default)]
struct Inbox {
    answers: HashMap<u64, Value>,
    events: Vec<Value>,
    has_ended: bool,
}

impl Wire {
    fn new(orders: ChildStdin, mut answers: impl BufRead + Send + 'static) -> Self {
        let came = Arc::new((Mutex::<Inbox>::default(), Condvar::new()));
        // It ends with the browser.
        thread::spawn({
            let came = Arc::clone(&came);
            move || {
                let mut message = Vec::new();
                loop {
                    message.clear();
                    let read = answers.read_until(0, &mut message);
                    let is_end = read.is_err() || message.pop() != Some(0);
                    let (inbox, signal) = &*came;
                    let mut inbox = inbox.lock().expect("nobody panics with the inbox");
                    if is_end {
                        inbox.has_ended = true;
                    } else if let Ok(message) = serde_json::from_slice::<Value>(&message) {
                        match message["id"].as_u64() {
                            Some(id) => drop(inbox.answers.insert(id, message)),
                            None => inbox.events.push(message),
                        }
                    }
                    signal.notify_all();
                    if is_end {
                        return;
                    }
                }
            }
        });
        Self {
            orders: Mutex::new(orders),
            next: AtomicU64::new(1),
            came,
        }
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.came.0.lock().expect("nobody panics with the inbox")
    }

    /// What a method answers, which must not refuse.
    fn ask(&self, session: Option<&str>, method: &str, params: &Value) -> Value {
        self.call(session, method, params)
            .unwrap_or_else(|refusal| panic!("{method}: {refusal}"))
    }

    /// What a method answers, or why it does not.
    fn call(&self, session: Option<&str>, method: &str, params: &Value) -> Result<Value, Value> {
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        let mut order = json!({ "id": id, "method": method, "params": params });
        if let Some(session) = session {
            order["sessionId"] = json!(session);
        }
        let mut bytes = order.to_string().into_bytes();
        bytes.push(0);
        let mut orders = self.orders.lock().expect("nobody panics with the pipe");
        orders.write_all(&bytes).expect("the browser reads");
        drop(orders);
        let waiting = |inbox: &mut Inbox| !inbox.has_ended && !inbox.answers.contains_key(&id);
        let (mut inbox, _) = self
            .came
            .1
            .wait_timeout_while(self.inbox(), PATIENCE, waiting)
            .expect("nobody panics with the inbox");
        let answer = inbox.answers.remove(&id);
        let mut answer = answer.unwrap_or_else(|| panic!("{method}: the browser has ended"));
        match answer["error"].take() {
            Value::Null => Ok(answer["result"].take()),
            error => Err(error),
        }
    }
}
