//! The text formats of the metrics. The library writes OpenMetrics; older programs and `promtool check metrics` read Prometheus' own
//! text format, in which types are spelled otherwise.

/// A text format of metrics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Prometheus' text format, which every program reads.
    Prometheus,
    OpenMetrics,
}

impl Format {
    /// The format that a client accepts: `accept` is its header.
    #[must_use]
    pub fn accepted(accept: Option<&str>) -> Self {
        let accepts = accept.is_some_and(|accept| accept.contains("application/openmetrics-text"));
        if accepts {
            Self::OpenMetrics
        } else {
            Self::Prometheus
        }
    }

    /// Its media type.
    #[must_use]
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Prometheus => "text/plain; version=0.0.4; charset=utf-8",
            Self::OpenMetrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
        }
    }

    /// Text in this format from OpenMetrics text.
    pub(crate) fn convert(self, open_metrics: String) -> String {
        match self {
            Self::OpenMetrics => open_metrics,
            Self::Prometheus => prometheus_text(&open_metrics),
        }
    }
}

/// Prometheus' text: the family of a counter has the name of its samples, with `_total`; an info is a gauge; there are neither units nor an
/// end mark.
fn prometheus_text(open_metrics: &str) -> String {
    let mut text = String::with_capacity(open_metrics.len() + 1024);
    // The type of a family comes after its help.
    let mut help = None;
    for line in open_metrics.lines() {
        if let Some(rest) = line.strip_prefix("# HELP ") {
            help = rest.split_once(' ');
            continue;
        }
        if let Some((name, kind)) = line
            .strip_prefix("# TYPE ")
            .and_then(|rest| rest.split_once(' '))
        {
            let (suffix, kind) = match kind {
                "counter" => ("_total", kind),
                "info" => ("_info", "gauge"),
                _ => ("", kind),
            };
            if let Some((_, description)) = help.take().filter(|(family, _)| *family == name) {
                text += &format!("# HELP {name}{suffix} {description}\n");
            }
            text += &format!("# TYPE {name}{suffix} {kind}\n");
            continue;
        }
        if !line.starts_with('#') {
            text += line;
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_follows_the_accept_header() {
        // As Prometheus asks.
        let both =
            "application/openmetrics-text;version=1.0.0;q=0.5,text/plain;version=0.0.4;q=0.4";
        assert_eq!(Format::accepted(Some(both)), Format::OpenMetrics);
        for accept in [None, Some("*/*"), Some("text/plain;version=0.0.4")] {
            assert_eq!(Format::accepted(accept), Format::Prometheus, "{accept:?}");
        }
    }

    #[test]
    fn prometheus_text_has_prometheus_names_and_types() {
        let open_metrics = "# HELP a_build Version.\n# TYPE a_build info\na_build_info{version=\"1\"} 1\n\
                            # HELP a_wait_seconds Wait.\n# TYPE a_wait_seconds gauge\n# UNIT a_wait_seconds seconds\n\
                            a_wait_seconds 0.5\n# HELP a_events All events.\n# TYPE a_events counter\na_events_total 3\n# EOF\n";
        assert_eq!(
            Format::Prometheus.convert(open_metrics.to_owned()),
            "# HELP a_build_info Version.\n# TYPE a_build_info gauge\na_build_info{version=\"1\"} 1\n\
             # HELP a_wait_seconds Wait.\n# TYPE a_wait_seconds gauge\na_wait_seconds 0.5\n\
             # HELP a_events_total All events.\n# TYPE a_events_total counter\na_events_total 3\n"
        );
        let same = Format::OpenMetrics.convert(open_metrics.to_owned());
        assert_eq!(same, open_metrics);
    }
}
