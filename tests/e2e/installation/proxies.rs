//! The proxy configurations in `docker/proxy`, each in front of a real server. Tests change only name, addresses and
//! certificate.

use crate::{CONFIG, Team};
use faceoff_tests::{
    bundle, repository,
    server::{Server, TIMEOUT},
};
use reqwest::{blocking::Client, redirect::Policy};
use rustls::{ClientConfig, RootCertStore};
use std::{
    fs,
    io::Read as _,
    net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// A running proxy.
struct Proxy {
    process: Child,
    http: u16,
    https: u16,
    certificate: rcgen::Certificate,
}

impl Drop for Proxy {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it has an address");
    address.port()
}

// Files of a proxy's scratch folder. Configurations name them relative to it: its own path may have spaces.
const CERTIFICATE: &str = "certificate.pem";
const KEY: &str = "key.pem";

/// Writes a self-signed certificate for `localhost`, and its key, to these files.
fn make_certificate(scratch: &Path) -> rcgen::Certificate {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]);
    let made = made.expect("a certificate can be made");
    for (name, text) in [
        (CERTIFICATE, made.cert.pem()),
        (KEY, made.signing_key.serialize_pem()),
    ] {
        fs::write(scratch.join(name), text).expect("a scratch file can be written");
    }
    made.cert
}

fn example(name: &str) -> String {
    let file = repository().join("docker/proxy").join(name);
    fs::read_to_string(file).expect("there is an example")
}

/// The text with these replacements, each of which must be found.
fn replace_all(text: &str, changes: &[(&str, String)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from} is not in the example");
        text.replace(from, to)
    })
}

impl Proxy {
    fn nginx(server: &Server, scratch: &Path) -> Self {
        let certificate = make_certificate(scratch);
        let (http, https) = (free_port(), free_port());
        let site = replace_all(
            &example("nginx.conf"),
            &[
                ("listen 80;", format!("listen 127.0.0.1:{http};")),
                ("listen 443 ", format!("listen 127.0.0.1:{https} ")),
                ("faceoff.example.org", "localhost".to_owned()),
                ("/var/log/nginx/", String::new()),
                ("127.0.0.1:8080", server.address().to_string()),
                ("/etc/ssl/faceoff/fullchain.pem", CERTIFICATE.to_owned()),
                ("/etc/ssl/faceoff/privkey.pem", KEY.to_owned()),
            ],
        );
        fs::write(scratch.join("site.conf"), site).expect("a scratch file can be written");
        // The main configuration, which a distribution's nginx.conf provides.
        let whole = "daemon off; master_process off; pid pid; error_log stderr;\n\
                     events {}\n\
                     http {\n\
                     access_log off; client_body_temp_path body; proxy_temp_path proxy;\n\
                     fastcgi_temp_path fastcgi; uwsgi_temp_path uwsgi; scgi_temp_path scgi;\n\
                     include site.conf;\n\
                     }\n";
        let file = scratch.join("nginx.conf");
        fs::write(&file, whole).expect("a scratch file can be written");
        let mut nginx = Command::new("nginx");
        // Debian installs nginx in /usr/sbin, which is not in the PATH of ordinary users.
        let path = std::env::var("PATH").unwrap_or_default();
        nginx.env("PATH", format!("{path}:/usr/sbin"));
        nginx.arg("-c").arg(&file).arg("-p").arg(scratch);
        Self::run(nginx, scratch, (http, https), certificate)
    }

    fn caddy(server: &Server, scratch: &Path) -> Self {
        let certificate = make_certificate(scratch);
        let (http, https) = (free_port(), free_port());
        let site = replace_all(
            &example("Caddyfile"),
            &[
                (
                    "\nfaceoff.example.org {",
                    // Without this, Caddy requests a certificate.
                    format!("\nlocalhost {{\n\tbind 127.0.0.1\n\ttls {CERTIFICATE} {KEY}\n"),
                ),
                ("127.0.0.1:8080", server.address().to_string()),
            ],
        );
        let site = format!("{{\n\tadmin off\n\thttp_port {http}\n\thttps_port {https}\n}}\n{site}");
        let config = scratch.join("Caddyfile");
        fs::write(&config, site).expect("a scratch file can be written");
        let mut caddy = Command::new("caddy");
        caddy
            .args(["run", "--adapter", "caddyfile", "--config"])
            .arg(&config)
            .current_dir(scratch)
            .env("HOME", scratch)
            .env("XDG_DATA_HOME", scratch)
            .env("XDG_CONFIG_HOME", scratch);
        Self::run(caddy, scratch, (http, https), certificate)
    }

    /// Starts the proxy and waits until it accepts connections.
    fn run(
        mut command: Command,
        scratch: &Path,
        (http, https): (u16, u16),
        certificate: rcgen::Certificate,
    ) -> Self {
        let log = fs::File::create(scratch.join("log")).expect("a scratch file can be made");
        let process = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        let mut proxy = Self {
            process: process.expect("docker/setup.sh installs the proxies"),
            http,
            https,
            certificate,
        };
        let started = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, https)).is_err() {
            let ended = proxy.process.try_wait().expect("a child can be asked");
            let log = || fs::read_to_string(scratch.join("log")).unwrap_or_default();
            assert!(ended.is_none(), "{ended:?}: {}", log());
            assert!(started.elapsed() < TIMEOUT, "{}", log());
            // The proxy does not signal when it listens.
            thread::sleep(Duration::from_millis(20));
        }
        proxy
    }

    /// A client with this loopback address that trusts the certificate.
    fn visitor(&self, last: u8) -> Client {
        let mut roots = RootCertStore::empty();
        let certificate = self.certificate.der().clone();
        roots.add(certificate).expect("it is a certificate");
        let trusting = ClientConfig::builder()
            .with_root_certificates(roots)
            .with_no_client_auth();
        let proxy = SocketAddr::from((Ipv4Addr::LOCALHOST, self.https));
        Client::builder()
            .tls_backend_preconfigured(trusting)
            .local_address(IpAddr::from([127, 0, 0, last]))
            .resolve("localhost", proxy)
            .redirect(Policy::none())
            .timeout(TIMEOUT)
            .build()
            .expect("a client needs nothing more")
    }

    fn url(&self, path: &str) -> String {
        format!("https://localhost:{}{path}", self.https)
    }
}

/// Checks pages, internal routes, redirects, event streams, uploads and the addresses of visitors.
fn check_proxy(start: impl Fn(&Server, &Path) -> Proxy) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = replace_all(
        CONFIG,
        &[(
            "address_per_s = 0",
            "address_per_s = 1\naddress_burst = 40".to_owned(),
        )],
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    let proxy = start(&server, scratch.path());

    let visitor = proxy.visitor(2);
    let board = visitor.get(proxy.url("/")).send().expect("it answers");
    assert_eq!(board.status(), 200);
    assert!(board.headers().contains_key("strict-transport-security"));
    assert!(board.text().expect("a page").contains("<html"));
    let get = |path: &str| visitor.get(proxy.url(path)).send().expect("it answers");
    assert_eq!(get("/readyz").status(), 200);
    assert_eq!(get("/metrics").status(), 404);
    let plain = format!("http://localhost:{}/season", proxy.http);
    let to_http = SocketAddr::from((Ipv4Addr::LOCALHOST, proxy.http));
    let plain = faceoff_tests::server::http()
        .resolve("localhost", to_http)
        .redirect(Policy::none())
        .build()
        .expect("a client needs nothing")
        .get(plain)
        .send()
        .expect("it answers");
    assert!(plain.status().is_redirection(), "{}", plain.status());
    let to = plain.headers()["location"].to_str().expect("an address");
    assert!(to.starts_with("https://localhost"), "{to}");

    // Events arrive at once, although the response continues.
    let mut events = get("/api/v1/events/stream");
    assert_eq!(events.status(), 200);
    let mut first_byte = [0; 1];
    events
        .read_exact(&mut first_byte)
        .expect("the stream has data");
    drop(events);

    // Several megabytes that do not compress are uploaded and downloaded.
    let team = Team::create(&server, "Alpha");
    let source = bundle::python_agent("say(hold)");
    let agent = bundle::python_bundle(scratch.path(), "agent", &source);
    let mut noise = vec![0; 3 << 20];
    let mut state = 1_u32;
    for byte in &mut noise {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *byte = state.to_be_bytes()[0];
    }
    fs::write(agent.join("weights.bin"), noise).expect("a scratch file can be written");
    let archive = bundle::pack(&agent);
    let path = "/api/v1/submissions?file_name=agent.tar.gz";
    let uploaded = visitor
        .post(proxy.url(path))
        .bearer_auth(&team.token)
        .header("content-type", "application/octet-stream")
        .body(archive.clone())
        .send()
        .expect("it answers");
    assert_eq!(uploaded.status(), 201);
    let uploaded: serde_json::Value = uploaded.json().expect("the API speaks JSON");
    let id = uploaded["id"].as_str().expect("it has an id");
    let back = visitor
        .get(proxy.url(&format!("/api/v1/submissions/{id}/bundle")))
        .bearer_auth(&team.token)
        .send()
        .expect("it answers");
    assert_eq!(back.bytes().expect("a file"), archive);

    // The rate limit applies to the visitor's real address, whatever X-Forwarded-For says, and not to other visitors.
    let request_status = |visitor: &Client, claimed: u32| {
        let request = visitor.get(proxy.url("/livez"));
        let request = request.header("x-forwarded-for", format!("192.0.2.{}", claimed % 250));
        request.send().expect("it answers").status().as_u16()
    };
    let refused = (0..100_000)
        .map(|number| request_status(&visitor, number))
        .find(|status| *status != 200);
    assert_eq!(refused, Some(429));
    assert_eq!(request_status(&proxy.visitor(3), 0), 200);
}

#[test]
fn nginx_configuration_serves_a_server() {
    check_proxy(Proxy::nginx);
}

#[test]
fn caddy_configuration_serves_a_server() {
    check_proxy(Proxy::caddy);
}
