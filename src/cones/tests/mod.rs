mod disk;
mod measure;
mod picture;
#[allow(dead_code, unreachable_pub, reason = "other tests use the rest")]
#[path = "../../../tests/support/tier.rs"]
mod tier;
