//! The keys by which a receiver knows that a message is the server's.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use faceoff_store::WebhookKeys;
use hmac::{Hmac, KeyInit as _, Mac as _};
use sha2::Sha256;
use std::fmt;

/// A new key, to be handed out once.
pub struct WebhookSecret([u8; 32]);

impl WebhookSecret {
    /// Draws one from the operating system's generator.
    ///
    /// # Errors
    /// The operating system has no randomness to give.
    pub fn generate() -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(Self(bytes))
    }

    /// As the receiver keeps it.
    #[must_use]
    pub fn shown(&self) -> String {
        format!("whsec_{}", STANDARD.encode(self.0))
    }

    /// What is stored, and signs.
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

/// The header `webhook-signature`: by each key that signs one signature.
pub(crate) fn signatures(keys: &WebhookKeys, id: &str, timestamp: i64, body: &str) -> String {
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
    fn a_signature_is_that_of_the_conventions() {
        let key = STANDARD.decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = r#"{"test": 2432232314}"#;
        let signed = format!("msg_p5jXN8AQM9LWM0D4loKWxJek.1614265330.{body}");
        let mut mac = Hmac::<Sha256>::new_from_slice(&key).unwrap();
        mac.update(signed.as_bytes());
        let signature = STANDARD.encode(mac.finalize().into_bytes());
        assert_eq!(signature, "g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn while_a_secret_is_replaced_both_sign() {
        let keys = |old_secret| WebhookKeys {
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
    fn a_secret_is_shown_as_receivers_take_it_and_hides_in_debug_output() {
        let secret = WebhookSecret::generate().unwrap();
        let shown = secret.shown();
        let bytes = STANDARD.decode(shown.strip_prefix("whsec_").unwrap());
        assert_eq!(bytes.unwrap(), secret.bytes());
        assert!(!format!("{secret:?}").contains(&shown[6..]));
    }
}
