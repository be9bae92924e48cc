//! A real Chromium, controlled by its DevTools protocol over a pair of pipes. It opens no port, and pages need no changes
//! for it.

use crate::server::{Process, TIMEOUT};
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

/// Names of the program: on Debian, on Ubuntu, and of Google Chrome.
const PROGRAMS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Pause between two checks of a condition on a page.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// A host name that the browser resolves to the loopback address. Browsers trust connections to the loopback's own names even
/// without TLS; this one stands for a machine in the local network, to which they send fewer headers.
pub const LAN_HOST: &str = "faceoff.test";

/// A browser without a window. Dropping it ends it.
#[derive(Debug)]
pub struct Browser {
    devtools: DevTools,
    _process: Process,
    _profile: TempDir,
}

/// The window and the preferences of a visitor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct View {
    pub width: u32,
    pub height: u32,
    /// The visitor prefers the dark colour scheme.
    pub dark: bool,
    /// JavaScript is enabled.
    pub scripts: bool,
    /// The visitor's time zone.
    pub time_zone: &'static str,
}

impl View {
    pub const DESKTOP: Self = Self {
        width: 1280,
        height: 900,
        dark: false,
        scripts: true,
        time_zone: "UTC",
    };
    pub const PROJECTOR: Self = Self {
        width: 2560,
        height: 1440,
        ..Self::DESKTOP
    };
    /// The narrowest supported window.
    pub const PHONE: Self = Self {
        width: 320,
        height: 640,
        ..Self::DESKTOP
    };

    /// This view with the dark colour scheme.
    #[must_use]
    pub const fn dark(self) -> Self {
        Self { dark: true, ..self }
    }

    /// This view with scripts disabled.
    #[must_use]
    pub const fn without_scripts(self) -> Self {
        Self {
            scripts: false,
            ..self
        }
    }
}

impl Browser {
    /// Starts a browser with its profile below `scratch`.
    ///
    /// # Panics
    /// If no Chromium is installed, or it does not start.
    #[must_use]
    pub fn start(scratch: &Path) -> Self {
        let name = PROGRAMS
            .into_iter()
            .find(|name| Command::new(name).arg("--version").output().is_ok())
            .expect("a Chromium is installed; `make setup-test` installs one");
        let profile = tempfile::tempdir_in(scratch).expect("a scratch folder can be made");
        // Chromium reads commands from descriptor 3 and answers on descriptor 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null"])
            .arg(name)
            .args([
                "--headless",
                "--remote-debugging-pipe",
                "--no-sandbox",
                "--disable-gpu",
                // The replay needs WebGL, here without a graphics card.
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
            .arg(format!("--host-resolver-rules=MAP {LAN_HOST} 127.0.0.1"))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the browser can be started");
        let commands = child.stdin.take().expect("standard input is piped");
        let answers = child.stdout.take().expect("standard output is piped");
        let devtools = DevTools::new(commands, BufReader::new(answers));
        let browser = Self {
            devtools,
            _process: Process(child),
            _profile: profile,
        };
        browser
            .devtools
            .call(None, "Browser.getVersion", &json!({}));
        browser
    }

    /// Opens an address in a desktop window and waits until it is loaded.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn open(&self, url: &str) -> Page<'_> {
        self.open_in(View::DESKTOP, url)
    }

    /// Opens an address in a new window, which shares no cookies with others, and waits until it is loaded.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn open_in(&self, view: View, url: &str) -> Page<'_> {
        let context = self
            .devtools
            .call(None, "Target.createBrowserContext", &json!({}));
        let target = self.devtools.call(
            None,
            "Target.createTarget",
            &json!({ "url": "about:blank", "browserContextId": context["browserContextId"] }),
        );
        let attached = self.devtools.call(
            None,
            "Target.attachToTarget",
            &json!({ "targetId": target["targetId"], "flatten": true }),
        );
        let session = attached["sessionId"].as_str();
        let page = Page {
            devtools: &self.devtools,
            session: session.expect("a session has an id").to_owned(),
        };
        for domain in ["Page", "Runtime", "Log"] {
            page.call(&format!("{domain}.enable"), &json!({}));
        }
        page.set_view(view);
        page.go_to(url);
        page
    }
}

/// A window of a browser.
#[derive(Debug)]
pub struct Page<'a> {
    devtools: &'a DevTools,
    session: String,
}

impl Page<'_> {
    /// Changes the window and the visitor's preferences.
    ///
    /// # Panics
    /// If the browser has ended.
    pub fn set_view(&self, view: View) {
        self.call(
            "Emulation.setDeviceMetricsOverride",
            &json!({ "width": view.width, "height": view.height, "deviceScaleFactor": 1, "mobile": false }),
        );
        let scheme = if view.dark { "dark" } else { "light" };
        self.call(
            "Emulation.setEmulatedMedia",
            &json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] }),
        );
        self.call(
            "Emulation.setTimezoneOverride",
            &json!({ "timezoneId": view.time_zone }),
        );
        self.call(
            "Emulation.setScriptExecutionDisabled",
            &json!({ "value": !view.scripts }),
        );
    }

    /// Goes to an address of another document and waits until it is loaded.
    ///
    /// # Panics
    /// If it cannot be loaded at all.
    pub fn go_to(&self, url: &str) {
        self.mark_document();
        let navigated = self.call("Page.navigate", &json!({ "url": url }));
        let error = &navigated["errorText"];
        assert!(error.is_null(), "{url}: {error}");
        self.wait_for_new_document();
    }

    /// Evaluates an expression that navigates to another document, and waits until that is loaded.
    ///
    /// # Panics
    /// If the expression throws.
    pub fn navigate_by(&self, expression: &str) {
        self.mark_document();
        let _ = self.evaluate(expression);
        self.wait_for_new_document();
    }

    fn mark_document(&self) {
        let _ = self.evaluate("window.isBefore = true");
    }

    fn wait_for_new_document(&self) {
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
        self.call("Page.addScriptToEvaluateOnNewDocument", &params);
    }

    /// Bytes that the page's scripts use after garbage collection.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn script_bytes(&self) -> f64 {
        self.call("HeapProfiler.collectGarbage", &json!({}));
        let usage = self.call("Runtime.getHeapUsage", &json!({}));
        usage["usedSize"].as_f64().expect("a number of bytes")
    }

    /// CPU time of the page's scripts since the first call, in s.
    ///
    /// # Panics
    /// If the browser has ended.
    #[must_use]
    pub fn script_cpu_s(&self) -> f64 {
        self.call(
            "Performance.enable",
            &json!({ "timeDomain": "threadTicks" }),
        );
        let measured = self.call("Performance.getMetrics", &json!({}));
        let metrics = measured["metrics"].as_array().into_iter().flatten();
        let script_duration = metrics
            .into_iter()
            .find(|metric| metric["name"] == "ScriptDuration");
        let seconds = script_duration.and_then(|metric| metric["value"].as_f64());
        seconds.expect("the browser measures it")
    }

    /// Fills fields of a form by their names, submits it, and waits for the next document.
    ///
    /// # Panics
    /// If there is no such form or field.
    pub fn send_form(&self, form: &str, fields: &[(&str, &str)]) {
        self.navigate_by(&format!(
            "(() => {{
                const form = document.querySelector({});
                for (const [name, value] of {}) form.elements[name].value = value;
                form.requestSubmit();
            }})()",
            json!(form),
            json!(fields)
        ));
    }

    /// The value of a JavaScript expression; a promise is awaited.
    ///
    /// # Panics
    /// If it throws.
    #[must_use]
    pub fn evaluate(&self, expression: &str) -> Value {
        let answer = self.call("Runtime.evaluate", &evaluation(expression));
        assert!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {}",
            answer["exceptionDetails"]
        );
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true. Exceptions count as false: the page may be loading.
    ///
    /// # Panics
    /// After [`TIMEOUT`], with the page.
    pub fn wait_until(&self, expression: &str) {
        let started = Instant::now();
        loop {
            let answer = self.devtools.try_call(
                Some(&self.session),
                "Runtime.evaluate",
                &evaluation(&format!("Boolean({expression})")),
            );
            if answer.is_ok_and(|answer| answer["result"]["value"] == true) {
                return;
            }
            assert!(
                started.elapsed() < TIMEOUT,
                "still waiting for {expression}:\n{}",
                self.html()
            );
            // The pause keeps the CPU for the server.
            thread::sleep(POLL_INTERVAL);
        }
    }

    /// Waits until the page has an element for a selector.
    ///
    /// # Panics
    /// After [`TIMEOUT`], with the page.
    pub fn wait_for(&self, selector: &str) {
        self.wait_until(&format!("document.querySelector({})", json!(selector)));
    }

    /// The visible text of the first element for a selector.
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

    /// Presses a key, as `Tab`, `Enter` or a space.
    ///
    /// # Panics
    /// If the browser has ended.
    pub fn press(&self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let code = match key {
                "Tab" => 9,
                "Enter" => 13,
                " " => 32,
                _ => 0,
            };
            let pressed =
                json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", &pressed);
        }
    }

    /// Saves a picture of the whole page as PNG.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn screenshot(&self, file: &Path) {
        self.capture(true, file);
    }

    /// Saves a picture of the visible part as PNG.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn screenshot_window(&self, file: &Path) {
        self.capture(false, file);
    }

    fn capture(&self, beyond_window: bool, file: &Path) {
        let params = json!({ "captureBeyondViewport": beyond_window });
        let taken = self.call("Page.captureScreenshot", &params);
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

    /// Errors since the window was opened: exceptions, errors on the console, failed loads and violations of the page's
    /// content security policy.
    ///
    /// # Panics
    /// If a thread of the test has panicked.
    #[must_use]
    pub fn console_errors(&self) -> Vec<String> {
        let inbox = self.devtools.inbox();
        let page_events = inbox
            .events
            .iter()
            .filter(|event| event["sessionId"] == self.session.as_str());
        page_events.filter_map(console_error).collect()
    }

    fn call(&self, method: &str, params: &Value) -> Value {
        self.devtools.call(Some(&self.session), method, params)
    }
}

fn evaluation(expression: &str) -> Value {
    json!({ "expression": expression, "awaitPromise": true, "returnByValue": true })
}

/// The text of an event that reports an error.
fn console_error(event: &Value) -> Option<String> {
    let params = &event["params"];
    let is_error = match event["method"].as_str()? {
        "Runtime.exceptionThrown" => true,
        "Runtime.consoleAPICalled" => params["type"] == "error",
        "Log.entryAdded" => params["entry"]["level"] == "error",
        _ => false,
    };
    is_error.then(|| params.to_string())
}

/// The connection to the browser by its DevTools protocol: a pipe for commands and one for answers and events.
#[derive(Debug)]
struct DevTools {
    commands: Mutex<ChildStdin>,
    next_id: AtomicU64,
    received: Arc<(Mutex<Inbox>, Condvar)>,
}

/// Received answers and events.
#[derive(Debug, Default)]
struct Inbox {
    answers: HashMap<u64, Value>,
    events: Vec<Value>,
    has_ended: bool,
}

impl DevTools {
    fn new(commands: ChildStdin, mut answers: impl BufRead + Send + 'static) -> Self {
        let received = Arc::new((Mutex::<Inbox>::default(), Condvar::new()));
        // The thread ends with the browser.
        thread::spawn({
            let received = Arc::clone(&received);
            move || {
                let mut message = Vec::new();
                loop {
                    message.clear();
                    let read = answers.read_until(0, &mut message);
                    let is_end = read.is_err() || message.pop() != Some(0);
                    let (inbox, signal) = &*received;
                    let mut inbox = inbox
                        .lock()
                        .expect("no thread panics while it holds the inbox");
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
            commands: Mutex::new(commands),
            next_id: AtomicU64::new(1),
            received,
        }
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.received
            .0
            .lock()
            .expect("no thread panics while it holds the inbox")
    }

    /// Calls a method that must succeed; returns its result.
    fn call(&self, session: Option<&str>, method: &str, params: &Value) -> Value {
        self.try_call(session, method, params)
            .unwrap_or_else(|refusal| panic!("{method}: {refusal}"))
    }

    /// Calls a method; returns its result or its error.
    fn try_call(
        &self,
        session: Option<&str>,
        method: &str,
        params: &Value,
    ) -> Result<Value, Value> {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let mut command = json!({ "id": id, "method": method, "params": params });
        if let Some(session) = session {
            command["sessionId"] = json!(session);
        }
        let mut bytes = command.to_string().into_bytes();
        bytes.push(0);
        let mut pipe = self
            .commands
            .lock()
            .expect("no thread panics while it holds the pipe");
        pipe.write_all(&bytes).expect("the browser reads");
        drop(pipe);
        let waiting = |inbox: &mut Inbox| !inbox.has_ended && !inbox.answers.contains_key(&id);
        let (mut inbox, _) = self
            .received
            .1
            .wait_timeout_while(self.inbox(), TIMEOUT, waiting)
            .expect("no thread panics while it holds the inbox");
        let answer = inbox.answers.remove(&id);
        let mut answer = answer.unwrap_or_else(|| panic!("{method}: the browser has ended"));
        match answer["error"].take() {
            Value::Null => Ok(answer["result"].take()),
            error => Err(error),
        }
    }
}
