//! The plan's hash: SHA-256 of the canonical JSON of its hashed part.

use sha2::{Digest, Sha256};

use super::Body;

/// Hexadecimal SHA-256 of the body. Struct fields serialise in declared order, maps in key order and floats in the shortest
/// form that reads back the same, so equal bodies have equal hashes on every machine.
pub(super) fn of(body: &Body) -> String {
    // A plan body holds no map with non-string keys and no failing serialiser, so this cannot fail.
    let json = serde_json::to_vec(body).expect("a plan body always serialises");
    hex(&Sha256::digest(json))
}

/// Hexadecimal SHA-256 of bytes: used for imported files.
pub fn of_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
