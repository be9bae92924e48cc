//! Secrets of webhooks. The server signs its messages with a secret, and receivers verify the signature as Standard Webhooks
//! defines it.

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

    /// The secret as it is stored and signs messages.
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

/// The signature of a text, with the version prefix of Standard Webhooks.
fn signature(secret: &[u8; 32], signed_text: &str) -> String {
    let mut mac = Hmac::<Sha256>::new_from_slice(secret).unwrap_or_else(|_| unreachable!());
    mac.update(signed_text.as_bytes());
    format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()))
}

/// Value of the header `webhook-signature`: one signature of each active secret.
pub(crate) fn signatures(secrets: &WebhookSecrets, id: &str, timestamp: i64, body: &str) -> String {
    let signed_text = format!("{id}.{timestamp}.{body}");
    let active_secrets = [Some(&secrets.secret), secrets.old_secret.as_ref()];
    let signatures: Vec<String> = active_secrets
        .into_iter()
        .flatten()
        .map(|secret| signature(secret, &signed_text))
        .collect();
    signatures.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example in the reference libraries of Standard Webhooks.
    #[test]
    fn signature_matches_the_reference_example() {
        let key = STANDARD.decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = r#"{"test": 2432232314}"#;
        let signed_text = format!("msg_p5jXN8AQM9LWM0D4loKWxJek.1614265330.{body}");
        let mut mac = Hmac::<Sha256>::new_from_slice(&key).unwrap();
        mac.update(signed_text.as_bytes());
        let signature = STANDARD.encode(mac.finalize().into_bytes());
        assert_eq!(signature, "g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn replaced_secret_also_signs() {
        let sign = |old_secret| {
            let secrets = WebhookSecrets {
                secret: [1; 32],
                old_secret,
            };
            let (message_id, timestamp, body) = ("a", 1, "{}");
            signatures(&secrets, message_id, timestamp, body)
        };
        let new_only = sign(None);
        let new_and_old = sign(Some([2; 32]));
        let [new, old] = new_and_old.split(' ').collect::<Vec<_>>()[..] else {
            panic!("expected two signatures, got {new_and_old}");
        };
        assert_eq!(new, new_only);
        assert!(old.starts_with("v1,"));
        assert_ne!(old, new_only);
    }

    #[test]
    fn secret_has_standard_encoding_and_no_debug_output() {
        let secret = WebhookSecret::generate().unwrap();
        let encoded = secret.encoded();
        let bytes = STANDARD.decode(encoded.strip_prefix("whsec_").unwrap());
        assert_eq!(bytes.unwrap(), secret.bytes());
        assert!(!format!("{secret:?}").contains(&encoded["whsec_".len()..]));
    }
}
