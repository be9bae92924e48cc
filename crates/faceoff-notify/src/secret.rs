//! Secrets of webhooks: with them, receivers verify that a message comes from the server.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use faceoff_store::WebhookSecrets;
use hmac::{Hmac, KeyInit as _, Mac as _};
use sha2::Sha256;
use std::fmt;

/// A new secret. Its text is shown to the owner once.
pub struct WebhookSecret([u8; 32]);

impl WebhookSecret {
    /// Generates a secret with the operating system's random generator.
    ///
    /// # Errors
    /// If the operating system provides no randomness.
    pub fn generate() -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(Self(bytes))
    }

    /// Text form for the receiver, with the prefix `whsec_`.
    #[must_use]
    pub fn encoded(&self) -> String {
        format!("whsec_{}", STANDARD.encode(self.0))
    }

    /// Key that is stored and signs messages.
    #[must_use]
    pub const fn bytes(&self) -> [u8; 32] {
        self.0
    }
}

impl fmt::Debug for WebhookSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("WebhookSecret(..)")
    }
}

fn signature(key: &[u8; 32], signed: &str) -> String {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).unwrap_or_else(|_| unreachable!());
    mac.update(signed.as_bytes());
    format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()))
}

/// Value of the header `webhook-signature`: one signature of each active secret.
pub(crate) fn signatures(keys: &WebhookSecrets, id: &str, timestamp: i64, body: &str) -> String {
    let signed = format!("{id}.{timestamp}.{body}");
    let all = [Some(&keys.secret), keys.old_secret.as_ref()];
    let all: Vec<String> = all
        .into_iter()
        .flatten()
        .map(|key| signature(key, &signed))
        .collect();
    all.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the Standard Webhooks' own libraries.
    #[test]
    fn signature_matches_the_reference_example() {
        let key = STANDARD.decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = r#"{"test": 2432232314}"#;
        let signed = format!("msg_p5jXN8AQM9LWM0D4loKWxJek.1614265330.{body}");
        let mut mac = Hmac::<Sha256>::new_from_slice(&key).unwrap();
        mac.update(signed.as_bytes());
        let signature = STANDARD.encode(mac.finalize().into_bytes());
        assert_eq!(signature, "g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn replaced_secret_also_signs() {
        let keys = |old_secret| WebhookSecrets {
            secret: [1; 32],
            old_secret,
        };
        let alone = signatures(&keys(None), "a", 1, "{}");
        let both = signatures(&keys(Some([2; 32])), "a", 1, "{}");
        let parts: Vec<&str> = both.split(' ').collect();
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], alone);
        assert!(parts[1].starts_with("v1,"));
        assert_ne!(parts[1], alone);
    }

    #[test]
    fn secret_has_standard_encoding_and_no_debug_output() {
        let secret = WebhookSecret::generate().unwrap();
        let encoded = secret.encoded();
        let bytes = STANDARD.decode(encoded.strip_prefix("whsec_").unwrap());
        assert_eq!(bytes.unwrap(), secret.bytes());
        assert!(!format!("{secret:?}").contains(&encoded[6..]));
    }
}
