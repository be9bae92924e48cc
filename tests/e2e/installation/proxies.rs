//! The example configurations of TLS proxies in `docker/proxy`, each in front of a real server. Tests change only the site's
//! name, addresses and certificate.

use crate::{CONFIG, Team, refused_uploads};
use faceoff_tests::{
    bundle, repository,
    server::{Server, TIMEOUT},
};
use reqwest::{blocking::Client, redirect::Policy};
use rustix::{
    net::{AddressFamily, SocketType, bind, connect, socket},
    process::{Resource, Rlimit, getrlimit, setrlimit},
};
use rustls::{ClientConfig, RootCertStore};
use std::{
    fs,
    io::{ErrorKind, Read as _, Write as _},
    net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// A running proxy, with the certificate that it uses.
struct Proxy {
    process: Child,
    http_port: u16,
    https_port: u16,
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

/// The module of nginx that the configuration needs, as Debian installs it.
const NGINX_STREAM_MODULE: &str = "/usr/lib/nginx/modules/ngx_stream_module.so";
/// Connections with half a request, on two ports together. With nginx's defaults, 1529 of them from one address shut everyone
/// else out.
const HALF_REQUESTS: usize = 1600;

// Files of a proxy's scratch folder. Configurations name them relative to that folder, since its path may have spaces.
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

/// The text of an example configuration.
fn example(name: &str) -> String {
    let file = repository().join("docker/proxy").join(name);
    fs::read_to_string(file).expect("there is an example")
}

/// The text with these replacements (old, new); each old part must be found.
fn replace_all(text: &str, replacements: &[(&str, String)]) -> String {
    replacements
        .iter()
        .fold(text.to_owned(), |text, (old, new)| {
            assert!(text.contains(old), "{old} is not in the text");
            text.replace(old, new)
        })
}

impl Proxy {
    fn nginx(server: &Server, scratch: &Path) -> Self {
        Self::nginx_with(server, scratch, &[])
    }

    /// nginx with further replacements in its configuration.
    fn nginx_with(server: &Server, scratch: &Path, replacements: &[(&str, String)]) -> Self {
        let certificate = make_certificate(scratch);
        let (http_port, https_port) = (free_port(), free_port());
        let own_replacements = [
            // One process, which ends with the test.
            (
                "user www-data;",
                "daemon off; master_process off;".to_owned(),
            ),
            ("/run/nginx.pid", "pid".to_owned()),
            // The line loads Debian's modules by paths that are relative to the folder of nginx.
            (
                "include /etc/nginx/modules-enabled/*.conf;",
                format!("load_module {NGINX_STREAM_MODULE};"),
            ),
            (
                "\nhttp {",
                "\nhttp {\nclient_body_temp_path body; proxy_temp_path proxy; fastcgi_temp_path fastcgi; \
                 uwsgi_temp_path uwsgi; scgi_temp_path scgi;\n"
                    .to_owned(),
            ),
            ("listen 80;", format!("listen 127.0.0.1:{http_port};")),
            ("listen 443;", format!("listen 127.0.0.1:{https_port};")),
            ("127.0.0.1:8079", format!("127.0.0.1:{}", free_port())),
            ("127.0.0.1:8442", format!("127.0.0.1:{}", free_port())),
            ("faceoff.example.org", "localhost".to_owned()),
            ("/var/log/nginx/", String::new()),
            ("127.0.0.1:8080", server.address().to_string()),
            ("/etc/ssl/faceoff/fullchain.pem", CERTIFICATE.to_owned()),
            ("/etc/ssl/faceoff/privkey.pem", KEY.to_owned()),
        ];
        let config = replace_all(&example("nginx.conf"), &own_replacements);
        let config = replace_all(&config, replacements);
        let config_file = scratch.join("nginx.conf");
        fs::write(&config_file, config).expect("a scratch file can be written");
        let mut nginx = Command::new("nginx");
        // Debian installs nginx in /usr/sbin, which is not in the PATH of ordinary users.
        let path = std::env::var("PATH").unwrap_or_default();
        nginx.env("PATH", format!("{path}:/usr/sbin"));
        nginx.arg("-c").arg(&config_file).arg("-p").arg(scratch);
        Self::run(nginx, scratch, (http_port, https_port), certificate)
    }

    fn caddy(server: &Server, scratch: &Path) -> Self {
        let certificate = make_certificate(scratch);
        let (http_port, https_port) = (free_port(), free_port());
        let site = replace_all(
            &example("Caddyfile"),
            &[
                (
                    "\nfaceoff.example.org {",
                    // Without the line `tls`, Caddy requests a certificate from an authority.
                    format!("\nlocalhost {{\n\tbind 127.0.0.1\n\ttls {CERTIFICATE} {KEY}\n"),
                ),
                (
                    "\nhttp://faceoff.example.org {",
                    "\nhttp://localhost {\n\tbind 127.0.0.1\n".to_owned(),
                ),
                (
                    "\n{\n",
                    format!(
                        "\n{{\n\tadmin off\n\thttp_port {http_port}\n\thttps_port {https_port}\n"
                    ),
                ),
                ("127.0.0.1:8080", server.address().to_string()),
            ],
        );
        let config_file = scratch.join("Caddyfile");
        fs::write(&config_file, site).expect("a scratch file can be written");
        let mut caddy = Command::new("caddy");
        caddy
            .args(["run", "--adapter", "caddyfile", "--config"])
            .arg(&config_file)
            .current_dir(scratch)
            .env("HOME", scratch)
            .env("XDG_DATA_HOME", scratch)
            .env("XDG_CONFIG_HOME", scratch);
        Self::run(caddy, scratch, (http_port, https_port), certificate)
    }

    /// Starts the proxy and waits until it accepts connections.
    fn run(
        mut command: Command,
        scratch: &Path,
        (http_port, https_port): (u16, u16),
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
            http_port,
            https_port,
            certificate,
        };
        let started = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, https_port)).is_err() {
            let ended = proxy
                .process
                .try_wait()
                .expect("the state of a child can be read");
            let log = || fs::read_to_string(scratch.join("log")).unwrap_or_default();
            assert!(ended.is_none(), "{ended:?}: {}", log());
            assert!(started.elapsed() < TIMEOUT, "{}", log());
            // The proxy does not say when it listens, so the test tries to connect again.
            thread::sleep(Duration::from_millis(20));
        }
        proxy
    }

    /// An HTTP client with the address `127.0.0.{last_byte}` that trusts the proxy's certificate.
    fn visitor(&self, last_byte: u8) -> Client {
        let mut roots = RootCertStore::empty();
        let certificate = self.certificate.der().clone();
        roots.add(certificate).expect("it is a certificate");
        let tls_config = ClientConfig::builder()
            .with_root_certificates(roots)
            .with_no_client_auth();
        let proxy = SocketAddr::from((Ipv4Addr::LOCALHOST, self.https_port));
        Client::builder()
            .tls_backend_preconfigured(tls_config)
            .local_address(IpAddr::from([127, 0, 0, last_byte]))
            .resolve("localhost", proxy)
            .redirect(Policy::none())
            .timeout(TIMEOUT)
            .build()
            .expect("an HTTP client can be made")
    }

    /// Sends a request without TLS to this port, and returns the response.
    fn send_unencrypted(port: u16, path: &str) -> String {
        let mut stream =
            TcpStream::connect((Ipv4Addr::LOCALHOST, port)).expect("the proxy listens");
        let request =
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        stream
            .write_all(request.as_bytes())
            .expect("the proxy reads it");
        let mut answer = String::new();
        stream
            .read_to_string(&mut answer)
            .expect("the proxy answers and closes the connection");
        answer
    }

    fn url(&self, path: &str) -> String {
        format!("https://localhost:{}{path}", self.https_port)
    }
}

/// Checks a proxy that `start_proxy` starts: pages, internal routes, redirects, event streams, uploads and the addresses of
/// visitors.
fn check_proxy(start_proxy: impl Fn(&Server, &Path) -> Proxy) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = replace_all(
        CONFIG,
        &[(
            "address_per_s = 0",
            "address_per_s = 1\naddress_burst = 40".to_owned(),
        )],
    );
    let server = Server::start(&scratch.path().join("data"), &config);
    let proxy = start_proxy(&server, scratch.path());

    let visitor = proxy.visitor(2);
    let board = visitor
        .get(proxy.url("/"))
        .send()
        .expect("the proxy answers");
    assert_eq!(board.status(), 200);
    assert!(board.headers().contains_key("strict-transport-security"));
    assert!(board.text().expect("a page").contains("<html"));
    let get = |path: &str| {
        visitor
            .get(proxy.url(path))
            .send()
            .expect("the proxy answers")
    };
    assert_eq!(get("/readyz").status(), 200);
    assert_eq!(get("/metrics").status(), 404);
    let http_url = format!("http://localhost:{}/season", proxy.http_port);
    let http_address = SocketAddr::from((Ipv4Addr::LOCALHOST, proxy.http_port));
    let redirect = faceoff_tests::server::http()
        .resolve("localhost", http_address)
        .redirect(Policy::none())
        .build()
        .expect("an HTTP client can be made")
        .get(http_url)
        .send()
        .expect("the proxy answers");
    assert!(redirect.status().is_redirection(), "{}", redirect.status());
    let location = redirect.headers()["location"].to_str().expect("an address");
    assert!(location.starts_with("https://localhost"), "{location}");

    // The proxy passes events on immediately, although the response does not end.
    let mut events = get("/api/v1/events/stream");
    assert_eq!(events.status(), 200);
    let mut first_byte = [0; 1];
    events
        .read_exact(&mut first_byte)
        .expect("the stream has data");
    drop(events);

    // A bundle of several megabytes is uploaded and downloaded. Its noise from a linear congruential generator does not
    // compress.
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
        .expect("the proxy answers");
    assert_eq!(uploaded.status(), 201);
    let uploaded: serde_json::Value = uploaded.json().expect("the API speaks JSON");
    let id = uploaded["id"].as_str().expect("it has an id");
    let downloaded = visitor
        .get(proxy.url(&format!("/api/v1/submissions/{id}/bundle")))
        .bearer_auth(&team.token)
        .send()
        .expect("the proxy answers");
    assert_eq!(downloaded.bytes().expect("a file"), archive);

    // The rate limit applies to the visitor's real address, whatever address the visitor claims in
    // X-Forwarded-For, and not to other visitors.
    let request_status = |visitor: &Client, claimed_address: u32| {
        let request = visitor.get(proxy.url("/livez"));
        let request = request.header(
            "x-forwarded-for",
            format!("192.0.2.{}", claimed_address % 250),
        );
        request.send().expect("the proxy answers").status().as_u16()
    };
    let refused = (0..100_000)
        .map(|number| request_status(&visitor, number))
        .find(|status| *status != 200);
    assert_eq!(refused, Some(429));
    assert_eq!(request_status(&proxy.visitor(3), 0), 200);
}

/// A connection from 127.0.0.2 that sends the beginning of a request or of a TLS handshake, and then nothing.
fn send_half_request(port: u16, first_bytes: &[u8]) -> TcpStream {
    let client = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 2), 0);
    let stream = socket(AddressFamily::INET, SocketType::STREAM, None).expect("a socket");
    bind(&stream, &client).expect("each address 127.x.x.x is this host");
    let proxy = SocketAddrV4::new(Ipv4Addr::LOCALHOST, port);
    connect(&stream, &proxy).expect("the system accepts the connection");
    let mut stream = TcpStream::from(stream);
    // The proxy may have closed the connection already.
    let _ = stream.write_all(first_bytes);
    stream
}

/// Whether the proxy has closed the connection.
fn is_closed(mut stream: &TcpStream) -> bool {
    stream
        .set_nonblocking(true)
        .expect("a socket can be made non-blocking");
    match stream.read(&mut [0; 1000]) {
        Ok(read) => read == 0,
        Err(error) => error.kind() != ErrorKind::WouldBlock,
    }
}

/// Checks that half requests of one address do not shut out another one, and returns their connections.
fn check_half_requests(proxy: &Proxy) -> Vec<TcpStream> {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit {
        current: limit.maximum,
        ..limit
    };
    setrlimit(Resource::Nofile, raised).expect("a process may raise its limit");
    let half_requests: Vec<_> = (0..HALF_REQUESTS / 2)
        .flat_map(|_| {
            [
                send_half_request(proxy.http_port, b"GET /season HTT"),
                send_half_request(proxy.https_port, &[0x16, 3, 1]),
            ]
        })
        .collect();
    let visitor = proxy.visitor(3);
    let season = visitor.get(proxy.url("/api/v1/season")).send();
    assert_eq!(season.expect("the proxy answers").status(), 200);
    let redirect = Proxy::send_unencrypted(proxy.http_port, "/season");
    assert!(redirect.starts_with("HTTP/1.1 30"), "{redirect}");
    half_requests
}

/// Waits until the proxy has closed all but `expected` of these connections.
fn wait_until_closed(mut connections: Vec<TcpStream>, expected: usize) {
    let started = Instant::now();
    loop {
        connections.retain(|connection| !is_closed(connection));
        if connections.len() <= expected {
            break;
        }
        assert!(
            started.elapsed() < TIMEOUT,
            "{} are open",
            connections.len()
        );
        // The proxy does not say when it closes a connection.
        thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(connections.len(), expected);
}

/// Checks that a proxy closes half requests after its own time limits.
fn check_half_requests_end(start_proxy: impl Fn(&Server, &Path) -> Proxy) {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let proxy = start_proxy(&server, scratch.path());
    let half_requests = check_half_requests(&proxy);
    wait_until_closed(half_requests, 0);
}

#[test]
fn half_requests_to_nginx_end_in_time() {
    check_half_requests_end(Proxy::nginx);
}

#[test]
fn half_requests_to_caddy_end_in_time() {
    check_half_requests_end(Proxy::caddy);
}

#[test]
fn nginx_limits_half_requests_of_an_address() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    // Without timeouts, only the number of an address's connections is limited.
    let no_timeout = [(
        "client_header_timeout 10s",
        "client_header_timeout 1d".to_owned(),
    )];
    let proxy = Proxy::nginx_with(&server, scratch.path(), &no_timeout);
    let half_requests = check_half_requests(&proxy);
    wait_until_closed(half_requests, 128);
}

/// Checks that no file of a proxy has a secret part of an address. Returns the text of the files.
fn check_logs(start_proxy: impl Fn(&Server, &Path) -> Proxy) -> String {
    const SECRET: &str = "fo_secret";
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(data.path(), CONFIG);
    let proxy = start_proxy(&server, scratch.path());
    let visitor = proxy.visitor(2);
    let request_all = || {
        for path in ["/join/", "//join/", "/api/v1/season?signature="] {
            let path = format!("{path}{SECRET}");
            let answer = visitor.get(proxy.url(&path)).send();
            answer.expect("the proxy answers");
            for port in [proxy.http_port, proxy.https_port] {
                let answer = Proxy::send_unencrypted(port, &path);
                assert!(answer.starts_with("HTTP/1."), "{answer}");
            }
        }
    };
    request_all();
    // Now the proxy has no server.
    server.kill();
    request_all();
    let answer = visitor.get(proxy.url("/season")).send();
    assert_eq!(answer.expect("the proxy answers").status(), 502);
    drop(proxy);
    let mut text = String::new();
    for entry in fs::read_dir(scratch.path()).expect("a folder can be read") {
        let path = entry.expect("a folder can be read").path();
        if path.is_file() {
            text += &fs::read_to_string(path).expect("a file is text");
        }
    }
    assert!(!text.contains(SECRET), "{text}");
    text
}

#[test]
fn logs_of_nginx_have_no_secrets() {
    let logs = check_logs(Proxy::nginx);
    assert!(logs.contains("\"GET /join/\" "), "{logs}");
    assert!(logs.contains("\"GET /api/v1/season\" 200 "), "{logs}");
    assert!(logs.contains("\"GET /season\" 502 "), "{logs}");
}

#[test]
fn logs_of_caddy_have_no_secrets() {
    let logs = check_logs(Proxy::caddy);
    assert!(logs.contains("connection refused"), "{logs}");
}

#[test]
fn nginx_configuration_serves_a_server() {
    check_proxy(Proxy::nginx);
}

#[test]
fn client_that_sends_first_gets_refusal_through_nginx() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let proxy = Proxy::nginx(&server, scratch.path());
    let refusal = refused_uploads::upload_by_python(
        &proxy.url("/api/v1/submissions"),
        ("fo_unknown", "application/octet-stream"),
        &refused_uploads::large_file(scratch.path()),
        &[("SSL_CERT_FILE", scratch.path().join(CERTIFICATE))],
    );
    assert!(refusal.starts_with("401 "), "{refusal}");
}

#[test]
fn caddy_configuration_serves_a_server() {
    check_proxy(Proxy::caddy);
}
