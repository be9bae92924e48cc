//! A local server with the protocol of S3 (object storage), and a bucket, a store for files, on it.

use crate::{
    repository,
    server::{Process, http},
};
use std::{
    io::{BufRead as _, BufReader},
    net::SocketAddr,
    process::{ChildStdin, Command, Stdio},
};

/// A bucket. Dropping it ends its server.
#[derive(Debug)]
pub struct Bucket {
    _process: Process,
    /// Kept open: the server ends when its standard input is closed.
    _input: ChildStdin,
    endpoint: String,
}

const NAME: &str = "matches";

impl Bucket {
    /// Beginning of the keys of all objects that the server stores; part of [`Self::url`].
    pub const PREFIX: &str = "of/season";

    /// Starts a server with an empty bucket.
    ///
    /// # Panics
    /// If its server is not installed, or does not start.
    #[must_use]
    pub fn start() -> Self {
        let test = std::env::current_exe().expect("a running test has a path");
        // <target>/<profile>/deps/<test>
        let target = test.ancestors().nth(3).expect("a target folder");
        let python = target.join("s3-test/bin/python");
        let started = Command::new(&python)
            .arg(repository().join("tests/s3/server.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut process = Process(started.unwrap_or_else(|error| {
            panic!(
                "{}: {error}; TARGET_DIR={} tests/s3/setup.sh installs it",
                python.display(),
                target.display()
            )
        }));
        let input = process.0.stdin.take().expect("its input is piped");
        let output = process.0.stdout.take().expect("its output is piped");
        let mut endpoint = String::new();
        BufReader::new(output)
            .read_line(&mut endpoint)
            .expect("it prints its address");
        let endpoint = endpoint.trim().to_owned();
        let made = http()
            .build()
            .expect("a client needs nothing")
            .put(format!("{endpoint}/{NAME}"))
            .send()
            .expect("it answers");
        assert!(made.status().is_success(), "{}", made.status());
        Self {
            _process: process,
            _input: input,
            endpoint,
        }
    }

    /// `s3://…`, for a configuration.
    #[must_use]
    pub fn url(&self) -> String {
        format!("s3://{NAME}/{}", Self::PREFIX)
    }

    /// The address of its server.
    ///
    /// # Panics
    /// If the server printed no valid address.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        let address = self.endpoint.strip_prefix("http://").unwrap_or_default();
        address.parse().expect("it prints its address")
    }

    /// Environment variables with which a server reaches the bucket at `address` and signs its requests.
    #[must_use]
    pub fn environment(address: SocketAddr) -> Vec<(&'static str, String)> {
        let endpoint = format!("http://{address}");
        let variables = [
            ("AWS_ENDPOINT", &*endpoint),
            ("AWS_ALLOW_HTTP", "true"),
            ("AWS_REGION", "us-east-1"),
            ("AWS_ACCESS_KEY_ID", "server"),
            ("AWS_SECRET_ACCESS_KEY", "secret"),
        ];
        variables
            .map(|(name, value)| (name, value.to_owned()))
            .into()
    }

    /// The keys of all its objects.
    ///
    /// # Panics
    /// If the server does not answer.
    #[must_use]
    pub fn keys(&self) -> Vec<String> {
        let client = http().build().expect("a client needs nothing");
        let request = client.get(format!("{}/{NAME}?list-type=2", self.endpoint));
        let listed = request.send().and_then(|answer| answer.text());
        let listed = listed.expect("it answers");
        let keys = listed.split("<Key>").skip(1);
        keys.filter_map(|rest| Some(rest.split_once("</Key>")?.0.to_owned()))
            .collect()
    }
}
